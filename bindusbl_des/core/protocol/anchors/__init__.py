"""ASVs that move: placed anew during the mission, by what the fleet knows of its AUVs."""
