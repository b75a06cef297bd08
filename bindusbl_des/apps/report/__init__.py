"""Reports: one HTML file that tells what happened in a mission, offline and for years to come.

A page holds its text, styles, scripts and data; it loads nothing.  Pages are made from the result
tables only, never from a live simulation.
"""
