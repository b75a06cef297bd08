"""The error of each AUV, predicted without simulation."""
