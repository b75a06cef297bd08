"""Who sounds when: slots, schedules, both bands, and the rounds that the fleet runs through."""
