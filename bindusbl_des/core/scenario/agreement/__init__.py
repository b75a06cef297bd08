"""What the keys of a scenario must agree on, a file for each subject."""
