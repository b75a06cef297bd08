"""ASVs that move: placed again and again during the mission, by what the fleet knows of its
AUVs.
"""
