"""What became of signals in a mission: counts for each AUV, and what broke the schedule."""
