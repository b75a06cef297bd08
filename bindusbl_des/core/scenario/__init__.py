"""What a mission is to be: its keys as frozen data, and what they must agree on."""
