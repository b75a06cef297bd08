"""The HF band: pings of AUVs, and calls for them, at the arrays of ASVs."""
