"""State that compiled code is handed once, and opens again at each call."""
