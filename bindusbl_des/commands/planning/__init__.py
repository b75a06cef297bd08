"""Commands for planners: what can be said before a mission is run, and which team is enough."""
