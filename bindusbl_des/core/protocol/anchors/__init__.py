"""Vessels that move: placed anew as the mission goes on, by what the fleet knows of its AUVs."""
