"""The keys of a scenario: a pydantic model for each section, a key with unit, range and source."""
