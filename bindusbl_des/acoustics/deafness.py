"""What ASVs that fail miss of the pings that come to them."""

import numpy as np

from ..records.events import IN_FLIGHT, LOST, OUT_OF_RANGE
from ..records.rows import Rows
from ..vehicles.failures import Failures
from .propagation import Band


def deafen(failures: Failures, pings: Rows, receptions: Rows, band: Band) -> None:
    """Let ASVs that have failed, or fail meanwhile, not hear pings that have just been sent.

    `receptions` are those of `pings`.  Who has failed before a ping comes is as good as not there:
    nothing is in range of it.  Who fails while one is arriving has lost it.
    """
    sender = receptions["ping"] - pings["ping"][0]
    arrive = pings["sent_at_s"][sender] + receptions["travel_time_s"]
    missed, cut = failures.met(receptions["asv"], arrive, arrive + band.duration)
    missed &= receptions["outcome"] != OUT_OF_RANGE
    cut &= receptions["outcome"] == IN_FLIGHT
    receptions["outcome"][missed], receptions["outcome"][cut] = OUT_OF_RANGE, LOST
    receptions["loss"][missed | cut] = 1.0
    np.subtract.at(pings["in_range_of"], sender[missed], 1)
    for number in np.unique(sender[missed]):
        ping = pings[number]
        if ping["passed_at_s"] < np.inf:
            others = (sender == number) & (receptions["outcome"] != OUT_OF_RANGE)
            last = (arrive[others] + band.duration).max(initial=-np.inf)
            ping["passed_at_s"] = last if others.any() else np.inf
