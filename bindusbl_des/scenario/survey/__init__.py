"""What a survey is made of, and whether it can be swept as a scenario asks for."""
