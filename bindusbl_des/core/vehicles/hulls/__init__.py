"""Hulls: what moves them through the sea, and how each is steered, one file for each."""
