"""Exports: a mission's tables for viewers (MCAP) and for spreadsheets (CSV).

Inside the package the sea is north-east-down; whatever a viewer draws leaves it east-north-up.
"""
