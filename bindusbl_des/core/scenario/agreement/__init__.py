"""What the keys of a scenario must agree on, a file for each subject.

Each function takes a `Site` and yields `Problem`s: the key, the message (rule, value, remedy) and
the other keys involved.  A problem that another function reports is left out here.
"""
