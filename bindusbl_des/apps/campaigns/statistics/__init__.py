"""Statistics of a campaign: means over seeds and paired differences, with confidence intervals."""
