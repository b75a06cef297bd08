"""The sea as sound meets it: how fast it travels there, and what is taken of it on the way."""
