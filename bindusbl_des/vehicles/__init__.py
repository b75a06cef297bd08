"""Whatever moves: its way at any instant, hulls and their guidance, currents, recorded tracks."""
