"""Tasks that methods of navigation, peers, schedules and placements enter, and how they score."""
