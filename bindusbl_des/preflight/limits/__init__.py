"""What the best protocol could make of a scenario: its limits, from where its vehicles are."""
