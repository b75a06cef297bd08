"""What a surface vessel measures of a ping, and the fix that the vessels make of it together."""
