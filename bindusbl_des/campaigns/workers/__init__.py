"""Who runs the missions: batches, the crews that run them, and the supervisor of a crew."""
