"""Sea water for sound: its speed and its absorption, by law or from a CTD profile."""
