"""Decided before a mission: whether any two signals of its protocol may overlap at a receiver.

A scenario and its bounds are a `Case` (:mod:`.case`): intervals of where each vehicle may be, how
late each clock, how fast sound is.  Gaussian errors have no bound: they are taken within so many
standard deviations that one mission in a million exceeds them (:mod:`.bounds`).  For each kind of
pair of signals :mod:`.rules` has one inequality, with what it proves, and what it leaves undecided.
Where one fails, :mod:`.witnesses` builds the scenario that it fails in, and :mod:`.playing` runs
it: only an overlap that was seen refuses a protocol.  :mod:`.verdict` puts all kinds together, and
searches the least change of guards, margin or schedule that would be accepted.
"""
