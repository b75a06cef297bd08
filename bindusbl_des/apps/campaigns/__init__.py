"""Campaigns: one scenario varied over many points and seeds, run so that nothing is lost.

An experiment file becomes a plan (which missions), workers run batches of it and write their rows
themselves, and a mission counts as done when its row is there.
"""
