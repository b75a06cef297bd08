"""The keys of a scenario, section by section."""
