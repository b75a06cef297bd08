"""Who runs the missions: batches, the pools that run them, and the supervisor of a pool."""
