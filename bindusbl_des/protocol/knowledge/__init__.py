"""What AUVs know of the rounds: the slots that frames have told them, and what they do without."""
