"""How the ping of an ASV spreads to the AUVs: whom it reaches, and when.  Compiled."""

from math import sqrt

from ...acoustics.propagation import Spread, Way, lost, reaches, snr, sound
from ...acoustics.travel_time import light_time
from ...core.compiled import compiled
from ...core.handed import opened
from ...records.events import IN_FLIGHT, OUT_OF_RANGE
from ...records.rows import NONE, Row
from ...vehicles.motion import Place, where

# Share of the way after which an arrival is worked out at an AUV that has no sure future; nobody is
# a fiftieth as fast as sound.
NEARLY_THERE = 0.98


@compiled
def radiate(
    handed: int, asv: int, round_number: int, slot: int, time: float, foreseen: bool,
    ping: int, row: int,
) -> int:  # fmt: skip
    """Let an ASV ping at an instant (s): write its row, `ping`, and from `row` on one for each AUV
    that it reaches.

    Return the row that comes after the last reception.  `handed` is the address of a
    :class:`.propagation.Spread`.  Where the way of AUVs is not `foreseen`, the arrivals written are
    those at which it is nearly there (:func:`arrive`).
    """
    into = opened(handed, Spread)
    pings, receptions, auvs, asvs = into.pings, into.receptions, into.auvs, into.asvs
    way, sound_speed = into.way, into.way.band.sound_speed
    here, line = where(asvs, asv, time), pings[ping]
    line.ping, line.round, line.slot, line.auv, line.asv = ping, round_number, slot, NONE, asv
    line.sent_at_s = time
    line.x_m, line.y_m, line.z_m = here[0], here[1], here[2]
    line.called_at_s = line.call_time_s = line.waited_s = float("nan")
    line.called_by = line.call = NONE
    line.first, line.in_range_of, line.heard_by, line.calls = row, 0, 0, 0
    last = longest = 0.0
    longest_so_far = pings[ping - 1].longest_s if ping else 0.0
    for auv in range(auvs.first.size - 1):
        there = where(auvs, auv, time)
        in_range, strength = reaches(there, here, auv, asv, way), sound(there, here, auv, asv, way)
        if not (in_range or into.everything or strength > 0.0):
            continue
        it = receptions[row]
        it.ping, it.auv, it.asv = ping, auv, asv
        it.outcome = IN_FLIGHT if in_range else OUT_OF_RANGE
        it.sound, it.snr_db = strength, snr(auv, asv, way)
        if foreseen:
            travel = light_time(here, auvs, auv, time, sound_speed)
        else:
            travel = NEARLY_THERE * _apart(here, there) / sound_speed
        _meet(it, time, travel, way)
        row += 1
        longest = max(longest, travel) if strength > 0.0 else longest
        if in_range:
            line.in_range_of += 1
            last = max(last, travel)
    line.end, line.longest_s = row, max(longest, longest_so_far)
    line.passed_at_s = time + last + way.band.duration
    return row


@compiled
def _apart(here: Place, there: Place) -> float:
    return sqrt((here[0] - there[0]) ** 2 + (here[1] - there[1]) ** 2 + (here[2] - there[2]) ** 2)


@compiled
def _meet(it: Row, sent_at: float, travel: float, way: Way) -> None:
    """Write when a ping arrives that travels for so long (s), and how likely it is lost."""
    it.arrived_at_s, it.travel_time_s = sent_at + travel, travel
    it.slant_range_m = travel * way.band.sound_speed
    it.loss = 1.0 if it.outcome == OUT_OF_RANGE else lost(it.slant_range_m, it.auv, it.asv, way)


@compiled
def arrive(handed: int, row: int, travel: float) -> None:
    """Write the arrival of a ping that is nearly there, now that its travel time (s) is known;
    `handed` as of :func:`radiate`.
    """
    into = opened(handed, Spread)
    it = into.receptions[row]
    line = into.pings[it.ping]
    _meet(it, line.sent_at_s, travel, into.way)
    if it.outcome == IN_FLIGHT:
        line.passed_at_s = max(line.passed_at_s, it.arrived_at_s + into.way.band.duration)
