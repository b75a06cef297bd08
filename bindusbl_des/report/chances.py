"""Passive ranging as a report reads it: a ping of an ASV is a chance of each AUV to be fixed."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Columns = dict[str, NDArray[Any]]
Whole = NDArray[np.int64]
Floats = NDArray[np.float64]


def chances(
    auvs: int, fixes: Columns, pings: Columns, receptions: Columns
) -> tuple[Whole, Columns, Columns]:
    """Return the rows of chances that fixes are made of; the chances, as pings; and the receptions.

    There is a reception of each ping at each of so many AUVs, one after the other, and so a chance
    for each, in the same order.  It has the columns of its ping, but is that of the AUV.
    """
    ping, near = receptions["ping"], receptions["outcome"] != "out_of_range"
    rows = {name: column[ping] for name, column in pings.items()}
    rows |= {
        "auv": receptions["auv"],
        "in_range_of": near.astype(np.int64),
        "heard_by": (receptions["outcome"] == "heard").astype(np.int64),
    }
    own = np.arange(len(ping), dtype=np.int64)
    return fixes["ping"] * auvs + fixes["auv"], rows, {**receptions, "ping": own}


def depth_at(times: Floats, depths: Floats, receptions: Columns) -> Floats:
    """Return how deep (m) the AUV of each reception was as the ping arrived.

    `depths` (vehicles, instants), m, are those of all vehicles at the instants `times` (s).
    """
    found = np.empty(len(receptions["ping"]))
    for auv in np.unique(receptions["auv"]):
        own = receptions["auv"] == auv
        found[own] = np.interp(receptions["arrived_at_s"][own], times, depths[auv])
    return found
