"""Passive ranging (piUSBL): ASVs take turns to ping, and every AUV that hears one fixes itself."""
