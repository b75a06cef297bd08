"""Decided before a mission: whether any two signals of its protocol may overlap at a receiver."""
