"""What happens in a mission, as rows: the events, their columns, and the record that holds them."""
