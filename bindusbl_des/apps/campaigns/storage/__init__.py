"""How a campaign lies on the disk: its folder and record, its tables in parts, parts joined."""
