"""Departure times at which pings of several AUVs arrive one after the other, t_i = a_i - D_i."""

from typing import NamedTuple

import numpy as np

from ...support.arrays import Flags, Floats, Ints
from ...support.compiled import compiled

# Tolerance of a tick count that is whole, and of a gap (s) between arrivals, against rounding
TICK_ROUNDING, ROUNDING = 1e-9, 1e-12


class PingArrivals(NamedTuple):
    """Arrivals of pings: travel times (s) to ASVs, and which ASVs hear which AUVs, (n, m) each; the
    uncertainty of arrivals (s), (n,), and its growth per second (n,); how long (s) an ASV is busy
    with each ping, and the tolerance of that against rounding.
    """

    ways: Floats
    heard: Flags
    blurs: Floats
    rates: Floats
    lasts: float
    rounding: float


def departures(
    ways: Floats, heard: Flags, blurs: Floats, rates: Floats, lasts: float, tick_rate: float = 0.0
) -> Floats:
    """Return when (s) AUVs ping, (n,), each as early as those heard from farther away allow.

    `ways` (n, m) are travel times (s) to ASVs, by which AUVs are `heard` (n, m).  At each ASV two
    pings arrive at least `lasts` (s) apart, more by the `blurs` (n,) of both, s, and by the `rates`
    (n,), s per s, at which these grow.  With a `tick_rate` (Hz) other than 0 AUVs ping on ticks.

    >>> ways, heard, still = np.array([[0.03], [0.01]]), np.full((2, 1), True), np.zeros(2)
    >>> departures(ways, heard, still, still, 0.015).tolist()
    [0.0, 0.0]
    >>> departures(ways, heard, still, still, 0.025).round(9).tolist()
    [0.0, 0.045]
    """
    order = np.argsort(-np.where(heard, ways, 0.0).max(axis=1), kind="stable")
    departs = np.zeros(len(ways))
    _pack(order, ways, heard, blurs, rates, lasts, tick_rate, departs)
    return departs


@compiled
def _pack(
    order: Ints, ways: Floats, heard: Flags, blurs: Floats, rates: Floats, lasts: float,
    tick_rate: float, departs: Floats,
) -> None:  # fmt: skip
    rounding = ROUNDING if tick_rate == 0.0 else 2.0 * TICK_ROUNDING / tick_rate
    sound = PingArrivals(ways, heard, blurs, rates, lasts, rounding)
    for place in range(len(order)):
        auv, start = order[place], 0.0
        later = _past(auv, start, order[:place], departs, sound)
        while later > start:
            start = later
            if tick_rate > 0.0:
                start = np.ceil(start * tick_rate - TICK_ROUNDING) / tick_rate
            later = _past(auv, start, order[:place], departs, sound)
        departs[auv] = start


@compiled
def _past(auv: int, start: float, others: Ints, departs: Floats, sound: PingArrivals) -> float:
    """Return the earliest departure (s) at which an AUV's ping no longer meets that of the first of
    `others` that it would meet if it departed at `start`; `start` if it meets none.
    """
    own = sound.rates[auv]
    for other in others:
        lasts = sound.lasts + sound.blurs[auv] + sound.blurs[other]
        lasts += sound.rates[other] * departs[other]
        for asv in range(sound.ways.shape[1]):
            if sound.heard[auv, asv] and sound.heard[other, asv]:
                there = departs[other] + sound.ways[other, asv]
                here = start + sound.ways[auv, asv]
                if abs(here - there) < lasts + own * start - sound.rounding:
                    return float((there + lasts - sound.ways[auv, asv]) / (1.0 - own))
    return start
