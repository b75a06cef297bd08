"""What a campaign found: means over seeds, paired differences, and how sure they are."""
