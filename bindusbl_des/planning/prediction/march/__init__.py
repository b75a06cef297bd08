"""The errors of AUVs, marched through the fixes that they may expect."""
