"""An experiment, read from a file or from options, and its plan of missions."""
