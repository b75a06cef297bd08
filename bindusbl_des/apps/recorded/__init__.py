"""Recorded missions through our navigators: logs, where they began, what noise was in them."""
