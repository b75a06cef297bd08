"""What a prediction is made of, gathered from a scenario."""
