"""The result of a mission: tables, summary, and the folder that holds them."""
