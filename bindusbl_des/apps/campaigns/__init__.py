"""Campaigns: one scenario varied over many points and seeds, safe against crashes and power cuts.

An experiment file (experiments/) becomes a plan, the numbered list of missions.  Workers (workers/)
simulate batches of missions and write their rows themselves (storage/); a mission is done when its
row is on the disk.  statistics/ computes means over seeds with 95 % intervals (Student's t), and
compares campaigns by paired differences on common seeds.
"""
