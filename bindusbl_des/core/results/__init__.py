"""What a mission has come to: tables, summary, and the folder that holds them."""
