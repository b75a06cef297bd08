"""What can be said of a scenario before it is run: what it leaves unsaid, what it will take."""
