"""Hulls: the forces on each, and its autopilot; one file for each."""
