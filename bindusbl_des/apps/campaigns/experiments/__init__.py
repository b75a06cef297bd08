"""What a campaign is to run: an experiment, read from a file or from options, and its plan."""
