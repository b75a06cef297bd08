"""Where on Earth a scenario is, and its places in metres, however they were given."""
