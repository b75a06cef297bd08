"""The page of a plan: vessels that can be dragged, and what was simulated."""
