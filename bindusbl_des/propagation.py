"""How sound spreads from one vehicle to others that move: who is within range, and how late.

These are the compiled inner loops of the bands.  Motions come as the fields of
:class:`.motion.Motion`, because numba unpacks plain arrays faster than tuples of them.
"""

from .compiled import compiled
from .events import IN_FLIGHT, OUT_OF_RANGE
from .motion import Floats, Ints, Motion, light_time, where

# Columns of the ledgers of events.Ping and events.Reception
PING, ROUND, SLOT, AUV, SENT_AT, PING_X, PING_Y, PING_Z, IN_RANGE_OF, HEARD_BY = range(10)
OF_PING, OF_AUV, AT_ASV, ARRIVED_AT, SLANT_RANGE, TRAVEL_TIME, OUTCOME = range(7)


@compiled
def spread(
    auv_table: Floats, auv_first: Ints, auv_step: float, auv: int, round_number: int, slot: int,
    time: float, asv_table: Floats, asv_first: Ints, asv_step: float, hf_range: float, slant: bool,
    sound_speed: float, everything: bool, pings: Floats, ping: int, receptions: Floats, row: int,
) -> int:  # fmt: skip
    """Let a ping set out at an instant (s): write its row, and one for each ASV; return how many.

    The edge of the HF range (m) counts as within; it is compared with the slant range if `slant`,
    else with the horizontal one.  Without `everything` ASVs out of range get no row.
    """
    auvs, asvs = Motion(auv_table, auv_first, auv_step), Motion(asv_table, asv_first, asv_step)
    x, y, z, _ = where(auvs, auv, time)
    written = in_range = 0
    for asv in range(asv_first.size - 1):
        vessel = where(asvs, asv, time)
        rise = z - vessel[2] if slant else 0.0
        square = (x - vessel[0]) ** 2 + (y - vessel[1]) ** 2 + rise**2
        heard = square <= hf_range**2
        if heard or everything:
            travel = light_time(x, y, z, asvs, asv, time, sound_speed)
            line = receptions[row + written]
            line[OF_PING], line[OF_AUV], line[AT_ASV] = ping, auv, asv
            line[ARRIVED_AT], line[TRAVEL_TIME] = time + travel, travel
            line[SLANT_RANGE] = travel * sound_speed
            line[OUTCOME] = IN_FLIGHT if heard else OUT_OF_RANGE
            written += 1
        in_range += heard
    line = pings[ping]
    line[PING], line[ROUND], line[SLOT], line[AUV], line[SENT_AT] = (
        ping, round_number, slot, auv, time,
    )  # fmt: skip
    line[PING_X], line[PING_Y], line[PING_Z] = x, y, z
    line[IN_RANGE_OF], line[HEARD_BY] = in_range, 0
    return written


@compiled
def within(
    asv_table: Floats, asv_first: Ints, asv_step: float, asv: int, time: float,
    auv_table: Floats, auv_first: Ints, auv_step: float, auvs: Ints, reach: float,
) -> list[bool]:  # fmt: skip
    """Tell which of some AUVs are within a horizontal range (m) of an ASV at an instant (s)."""
    vessel = where(Motion(asv_table, asv_first, asv_step), asv, time)
    fleet = Motion(auv_table, auv_first, auv_step)
    near = []
    for auv in auvs:
        place = where(fleet, auv, time)
        near.append((place[0] - vessel[0]) ** 2 + (place[1] - vessel[1]) ** 2 <= reach**2)
    return near


@compiled
def travel_times(
    asv_table: Floats, asv_first: Ints, asv_step: float, asv: int, time: float,
    auv_table: Floats, auv_first: Ints, auv_step: float, auvs: Ints, sound_speed: float,
) -> list[float]:  # fmt: skip
    """Return how long (s) a sound that leaves an ASV at an instant (s) takes to some AUVs."""
    x, y, z, _ = where(Motion(asv_table, asv_first, asv_step), asv, time)
    fleet = Motion(auv_table, auv_first, auv_step)
    return [light_time(x, y, z, fleet, auv, time, sound_speed) for auv in auvs]
