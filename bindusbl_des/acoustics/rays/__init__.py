"""Sound along bent rays: tables of travel time and loss, from a file or from a ray tracer."""
