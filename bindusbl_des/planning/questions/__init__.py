"""What a plan is asked: its file, its options, and the question that they make together."""
