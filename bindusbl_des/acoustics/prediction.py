"""Arrivals that were predicted, amended when they have come: where an ASV was then, it was heard.

An ASV that an outside program moves has no sure future.  So the arrival of a ping is at first where
a constant velocity would have it (:mod:`..vehicles.poses`), which is right within a microsecond.
The sound of a call that may drown it at other ASVs stays where it was predicted.
"""

from math import isfinite, isnan

from ..core.compiled import compiled
from ..core.handed import opened
from ..records.events import OUT_OF_RANGE
from ..records.rows import Row, Rows
from ..vehicles.motion import Motion
from .propagation import Spread
from .travel_time import light_time


@compiled
def amend(handed: int, time: float, first: int, end: int) -> int:
    """Work out anew when the pings `first` to `end` (not included) arrive, as ASVs have moved by an
    instant (s).

    Arrivals before that are then exact, and what is not there by then has a later one.  Return the
    first of the pings that have not arrived everywhere.  `handed` is the address of a
    :class:`.propagation.Spread`.
    """
    of = opened(handed, Spread)
    pings, band, under_way = of.pings, of.way.band, end
    for number in range(first, end):
        ping = pings[number]
        receptions = of.receptions[ping.first : ping.end]
        latest, last, longest = _travel(ping, receptions, of.asvs, band.sound_speed)
        if ping.sent_at_s + latest > time:
            under_way = min(under_way, number)
        ping.longest_s = max(longest, pings[number - 1].longest_s if number else 0.0)
        if isfinite(ping.passed_at_s):
            ping.passed_at_s = ping.sent_at_s + last + band.duration
    return under_way


@compiled
def _travel(
    ping: Row, receptions: Rows, asvs: Motion, sound_speed: float
) -> tuple[float, float, float]:
    """Write how long (s) a ping travels to its ASVs; return the longest way (s): to any of them, to
    any in range, and to any where it is a sound at all.
    """
    here = ping.x_m, ping.y_m, ping.z_m, 0.0
    latest, last, longest = 0.0, 0.0, 0.0
    for line in receptions:
        travel = light_time(here, asvs, line.asv, ping.sent_at_s, sound_speed)
        line.travel_time_s, line.slant_range_m = travel, travel * sound_speed
        if not isnan(line.arrived_at_s):  # whom no call reached does not ping
            line.arrived_at_s = ping.sent_at_s + travel
        latest = max(latest, travel)
        if line.outcome != OUT_OF_RANGE:
            last = max(last, travel)
        if line.sound > 0.0:
            longest = max(longest, travel)
    return latest, last, longest
