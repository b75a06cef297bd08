"""Arrivals that were predicted, amended when they have come: where an ASV was then, it was heard.

An ASV that an outside program moves has no sure future.  So the arrival of a ping is at first where
a constant velocity would have it (:mod:`..vehicles.poses`), which is right within a microsecond.
The sound of a call that may drown it at other ASVs stays where it was predicted.
"""

from math import isfinite, isnan

from ..core.compiled import compiled, entry
from ..records.events import OUT_OF_RANGE
from ..records.rows import Row, Rows
from ..vehicles.motion import Floats, Ints, Motion
from .travel_time import light_time


@entry
def amend(
    time: float, first: int, pings: Rows, receptions: Rows, duration: float, sound_speed: float,
    asv_table: Floats, asv_first: Ints, asv_step: float,
) -> int:  # fmt: skip
    """Work out anew when the pings from `first` on arrive, as ASVs have moved by an instant (s).

    Arrivals before that are then exact, and what is not there by then has a later one.  Return the
    first of the pings that have not arrived everywhere.
    """
    asvs, under_way = Motion(asv_table, asv_first, asv_step), len(pings)
    for number in range(first, len(pings)):
        ping = pings[number]
        latest, last, longest = _travel(ping, receptions[ping.first : ping.end], asvs, sound_speed)
        if ping.sent_at_s + latest > time:
            under_way = min(under_way, number)
        ping.longest_s = max(longest, pings[number - 1].longest_s if number else 0.0)
        if isfinite(ping.passed_at_s):
            ping.passed_at_s = ping.sent_at_s + last + duration
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
