"""Measured advice: changes of a plan are simulated beside it, and only what was measured is said.

A change is *chosen* on some seeds and *measured* on others.  Whoever picks the best of many by the
numbers that are then reported reports luck as well (the winner's curse); on fresh seeds luck has no
favourites.  Intervals are widened so that all of one report hold together with 95 % (Bonferroni),
since a reader will look at the first of the list: the largest of them all.
"""
