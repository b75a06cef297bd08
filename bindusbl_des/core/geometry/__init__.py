"""Places and ways: formations, coverage, Dubins paths, routes, geographic coordinates."""
