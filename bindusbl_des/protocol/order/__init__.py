"""In which order AUVs speak, and how long each may: what schedules know, and those that order."""
