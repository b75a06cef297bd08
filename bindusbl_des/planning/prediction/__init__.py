"""The error of each AUV without simulation: from fixes that can be expected, and from drift."""
