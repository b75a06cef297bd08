"""The events of a mission as rows: their classes, columns, and the record that stores them."""
