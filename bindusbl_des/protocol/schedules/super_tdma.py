"""Transmit times that allow for the way: arrivals are packed at the ASVs, departures overlap.

Each ping sets out so that it comes in when the one before it is over, t_i = a_i - D_i, instead of
when that has had time to come from anywhere: the schedule of bound B1, 1 / (T_P + T_clear) pings
per second and ASV.
"""

from typing import NamedTuple

import numpy as np

from ...core.arrays import Flags, Floats, Ints
from ...core.compiled import compiled
from .view import Groups, TimedGroups, View

# A tick count this near to a whole number is whole; and what of a gap (s) rounding may take.
TICK_ROUNDING, ROUNDING = 1e-9, 1e-12


class PingArrivals(NamedTuple):
    """How pings come in: travel times (s) to ASVs, by which AUVs are heard, (n, m) each; how far
    off (s) they may be (n,), and how much more so each second (n,); how long (s) an ASV is busy
    with each, and what of that may be lost to rounding.
    """

    ways: Floats
    heard: Flags
    blurs: Floats
    rates: Floats
    lasts: float
    rounding: float


def super_tdma(view: View, *, clear_s: float = 0.02, sds: float = 2.0) -> Groups:
    """Let every AUV ping at an instant of its own, so that arrivals follow each other closely.

    Wherever one ASV may hear two AUVs, their arrivals are predicted to be `clear_s` (s) apart and
    more by what either may be misplaced: the places the fleet believes by so many `sds` of fixes
    and the way since, and vehicles that move meanwhile.  AUVs set out as early as that allows,
    those that are heard farthest away first.
    """
    slots = view.slots
    if slots is None:
        raise LookupError("super_tdma plans with the protocol's slots; this view has none")
    lasts, speed = slots.ping_duration + clear_s + slots.answer, slots.sound_speed
    longest, rates = slots.longest_travel_time, view.range_rates_m_per_s / speed
    misplaced = view.misplaced_m(sds) + view.range_rates_m_per_s * view.ahead_s
    ways = np.linalg.norm(view.auvs[:, None] - view.asvs[None], axis=2) / speed
    ways, blurs = np.minimum(ways, longest), np.minimum(misplaced / speed, longest)
    horizon = len(rates) * lasts + longest  # about as long as the round pings
    while True:
        heard = view.may_hear(misplaced + view.range_rates_m_per_s * horizon)
        departs = departures(ways, heard, blurs, rates, lasts, slots.clock.rate)
        last = float(departs.max())
        if last <= horizon:
            break
        horizon = 1.1 * last
    farthest = np.where(heard, ways, 0.0).max(axis=1) + blurs
    comes = np.where(heard.any(axis=1), farthest, longest)
    ends = float((departs * (1.0 + rates) + comes).max()) + lasts
    instants, slot_of = np.unique(departs, return_inverse=True)
    groups = [np.flatnonzero(slot_of == slot).tolist() for slot in range(len(instants))]
    return TimedGroups(groups, np.diff([*instants, ends]).tolist())


def departures(
    ways: Floats, heard: Flags, blurs: Floats, rates: Floats, lasts: float, tick_rate: float = 0.0
) -> Floats:
    """Return when (s) AUVs set out, (n,), each as early as those heard from farther away allow.

    `ways` (n, m) are travel times (s) to ASVs, by which AUVs are `heard` (n, m).  At each of these
    two pings come in at least `lasts` (s) apart, more by the `blurs` (n,) of both, s, and by the
    `rates` (n,), s per s, at which these grow.  With a `tick_rate` (Hz) other than 0 AUVs set out
    on ticks.

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
    """Return the earliest instant (s) past the first of `others` that an AUV would come in too near
    to, wherever both are heard, if it set out at an instant; that instant if there is none.
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
