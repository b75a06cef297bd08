"""Readers of files with positions on Earth, all of them checked: GeoJSON, KML, GPX, CSV, MCAP,
grids.
"""
