"""Teams of ASVs that may be chosen: proposed, predicted, and narrowed to those worth flying."""
