"""Files of places on Earth, read and never believed: GeoJSON, KML, GPX, CSV and MCAP."""
