"""One mission: its world built from a scenario, run by the event kernel, sampled and measured."""
