"""The error of each AUV, predicted without simulation in milliseconds.

A prediction marches the mean and covariance of errors (march.py, drift.py) along the planned paths,
through the fixes that the AUV may expect (rounds.py: when; sights.py: with which probability and
noise).  It uses the filter's own covariance steps (core/navigation).  gathering.py turns a scenario
into the `Inputs` (inputs.py), which hold no stations, so that many placements share them;
docs/planning.md gives the measured accuracy.
"""
