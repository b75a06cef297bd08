"""What a mission came to: counts and metrics of each AUV, tracks, and what broke the schedule."""
