"""How sound spreads from one vehicle to others that move: who is within range, and how late.

These are the compiled inner loops of the bands.  Motions come as the fields of a
:class:`.motion.Motion`.
"""

from math import nan

from .compiled import compiled
from .events import IN_FLIGHT, OUT_OF_RANGE
from .motion import Floats, Ints, light_time, where

# Columns of the ledgers of events.Ping and events.Reception
PING, ROUND, SLOT, AUV, SENT_AT, PING_X, PING_Y, PING_Z, IN_RANGE_OF, HEARD_BY = range(10)
OF_PING, OF_AUV, AT_ASV, ARRIVED_AT, SLANT_RANGE, TRAVEL_TIME, OUTCOME = range(7)


@compiled
def spread(
    auv_table: Floats, auv_first: Ints, auv_step: float, auv: int, round_number: int, slot: int,
    time: float, asv_table: Floats, asv_first: Ints, asv_step: float, hf_range: float, slant: bool,
    sound_speed: float, everything: bool, pings: Floats, ping: int, receptions: Floats, row: int,
) -> tuple[int, float]:  # fmt: skip
    """Let a ping set out at an instant (s): write its row, and one for each ASV.

    Return how many, and the longest travel time (s) to an ASV in range, or -1.  The edge of the HF
    range (m) counts as within; it is compared with the slant range if `slant`, else with the
    horizontal one.  Without `everything` ASVs out of range get no row.
    """
    x, y, z, _ = where(auv_table, auv_first, auv_step, auv, time)
    written, in_range, longest = 0, 0, -1.0
    for asv in range(asv_first.size - 1):
        vessel = where(asv_table, asv_first, asv_step, asv, time)
        rise = z - vessel[2] if slant else 0.0
        square = (x - vessel[0]) ** 2 + (y - vessel[1]) ** 2 + rise**2
        heard = square <= hf_range**2
        if heard or everything:
            travel = light_time(x, y, z, asv_table, asv_first, asv_step, asv, time, sound_speed)
            line = receptions[row + written]
            line[OF_PING], line[OF_AUV], line[AT_ASV] = ping, auv, asv
            line[ARRIVED_AT], line[TRAVEL_TIME] = time + travel, travel
            line[SLANT_RANGE] = travel * sound_speed
            line[OUTCOME] = IN_FLIGHT if heard else OUT_OF_RANGE
            written += 1
            if heard:
                in_range += 1
                longest = max(longest, travel)
    line = pings[ping]
    line[PING], line[ROUND], line[SLOT], line[AUV], line[SENT_AT] = (
        ping, round_number, slot, auv, time,
    )  # fmt: skip
    line[PING_X], line[PING_Y], line[PING_Z] = x, y, z
    line[IN_RANGE_OF], line[HEARD_BY] = in_range, 0
    return written, longest


@compiled
def arrivals(
    asv_table: Floats, asv_first: Ints, asv_step: float, asv: int, time: float, airtime: float,
    auv_table: Floats, auv_first: Ints, auv_step: float, auvs: Ints, reach: float, foreseen: bool,
    sound_speed: float,
) -> list[float]:  # fmt: skip
    """Return when (s after its start) a frame that an ASV sends at an instant (s) is at some AUVs.

    Where an AUV is out of the horizontal range (m) when the frame begins, it is NaN; where its way
    is not `foreseen`, the travel time is left out.
    """
    begins = where(asv_table, asv_first, asv_step, asv, time)
    ends = where(asv_table, asv_first, asv_step, asv, time + airtime)
    after = []
    for auv in auvs:
        place = where(auv_table, auv_first, auv_step, auv, time)
        if (place[0] - begins[0]) ** 2 + (place[1] - begins[1]) ** 2 > reach**2:
            after.append(nan)
        elif foreseen:
            x, y, z, _ = ends
            travel = light_time(
                x, y, z, auv_table, auv_first, auv_step, auv, time + airtime, sound_speed
            )
            after.append(airtime + travel)
        else:
            after.append(airtime)
    return after
