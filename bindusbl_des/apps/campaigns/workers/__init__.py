"""Workers: batches of missions, pools that run them, and the supervisor of a pool."""
