"""The MF band: fixes in frames, from ASVs to AUVs."""
