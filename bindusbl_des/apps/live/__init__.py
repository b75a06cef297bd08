"""A mission that speaks what instruments speak, while it is flown against the clock."""
