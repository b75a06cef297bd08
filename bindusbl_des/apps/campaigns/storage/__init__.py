"""A campaign on the disk: its folder and record, and its tables in parts, which can be joined."""
