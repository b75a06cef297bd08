"""Who pings when, and how long each slot is: what schedules know, and those that ship."""
