"""Sound in the sea: its speed, what is lost on the way, and when it reaches whom."""
