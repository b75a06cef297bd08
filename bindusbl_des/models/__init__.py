"""Parts that ship, one file each, on the interfaces that a user's own parts have.

Each is one line in the list of `..core.scenario.families`.
"""
