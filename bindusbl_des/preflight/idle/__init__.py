"""Keys that have no effect in a scenario, and why."""
