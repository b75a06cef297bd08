"""What the paper leaves open: its readings, how each changes the numbers, which agree best."""
