"""Four vehicles in one instruction: a number for each of them, and rows of such numbers."""
