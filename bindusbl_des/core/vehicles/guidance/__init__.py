"""A fleet under its autopilots: what it senses, where its paths are, how it is moved on."""
