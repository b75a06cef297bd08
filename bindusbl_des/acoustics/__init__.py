"""Sound between vehicles: what is lost on the way, and when it reaches whom."""
