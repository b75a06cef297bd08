"""How sound spreads from one vehicle to others that move: who is within range, and how late.

These are the compiled inner loops of the bands.  Motions come as the fields of a
:class:`.motion.Motion`.
"""

from math import inf, isnan, nan

from ..core.clock import after
from ..core.compiled import compiled
from ..records.columns import (
    ARRIVED_AT,
    ARRIVES_AT,
    AT_ASV,
    AUV,
    AUV_OF_FIX,
    BROADCAST_AT,
    BROADCAST_BY,
    CALL,
    CALL_TIME,
    CALLED_AT,
    CALLS,
    END,
    FIRST,
    HEARD_BY,
    IN_RANGE_OF,
    LONGEST,
    OF_AUV,
    OF_PING,
    OUTCOME,
    OUTCOME_OF_FIX,
    PASSED_AT,
    PING,
    PING_X,
    PING_Y,
    PING_Z,
    ROUND,
    SENT_AT,
    SLANT_RANGE,
    SLOT,
    TRAVEL_TIME,
)
from ..records.events import HEARD, IN_FLIGHT, OUT_OF_RANGE
from ..vehicles.motion import Floats, Ints, where
from .travel_time import light_time

# Arrivals that overlap by less (s) only touch: rounding of the instants is far smaller.
TOUCH = 1e-9


@compiled
def overlap(one: float, other: float, duration: float) -> bool:
    """Tell whether two sounds of one length (s) that begin at two instants (s) overlap."""
    return bool(other < one + duration - TOUCH and other + duration > one + TOUCH)


@compiled
def spread(
    group: Ints, round_number: int, slot: int, time: float, call: Floats, calls: int,
    pings: Floats, ping: int, receptions: Floats, row: int, everything: bool, slant: bool,
    hf_range: float, duration: float, sound_speed: float, auv_table: Floats, auv_first: Ints,
    auv_step: float, asv_table: Floats, asv_first: Ints, asv_step: float,
) -> int:  # fmt: skip
    """Let a group of AUVs ping at an instant (s): write their rows, and one for each of their ASVs.

    Return the row that comes after the last reception.  Pings last `duration` (s).  The edge of the
    HF range (m) counts as within; it is compared with the slant range if `slant`, else with the
    horizontal one.  Without `everything` ASVs out of range get no row.  `call` is the last row of
    the ping from CALLED_AT to CALL_TIME: AUVs that were called in vain do not ping.  `calls` are on
    record by now.
    """
    longest_so_far = pings[ping - 1, LONGEST] if ping else 0.0
    silent = not (isnan(call[CALL - CALLED_AT]) or call[CALL - CALLED_AT] == HEARD)
    for auv in group:
        x, y, z, _ = where(auv_table, auv_first, auv_step, auv, time)
        first, in_range, longest = row, 0, 0.0
        for asv in range(asv_first.size - 1):
            vessel = where(asv_table, asv_first, asv_step, asv, time)
            heard = within(x, y, z, vessel[0], vessel[1], vessel[2], hf_range, slant)
            if heard or everything:
                travel = light_time(x, y, z, asv_table, asv_first, asv_step, asv, time, sound_speed)
                line = receptions[row]
                line[OF_PING], line[OF_AUV], line[AT_ASV] = ping, auv, asv
                line[ARRIVED_AT], line[TRAVEL_TIME] = time + travel, travel
                line[SLANT_RANGE] = travel * sound_speed
                line[OUTCOME] = IN_FLIGHT if heard else OUT_OF_RANGE
                row += 1
                if heard:
                    in_range += 1
                    longest = max(longest, travel)
                if silent:
                    line[ARRIVED_AT] = nan
                    if heard:
                        line[OUTCOME] = call[CALL - CALLED_AT]
        longest_so_far = max(longest_so_far, longest)
        line = pings[ping]
        line[PING], line[ROUND], line[SLOT], line[AUV] = ping, round_number, slot, auv
        line[SENT_AT], line[PING_X], line[PING_Y], line[PING_Z] = time, x, y, z
        line[IN_RANGE_OF], line[HEARD_BY], line[FIRST], line[END] = in_range, 0, first, row
        line[CALLED_AT : CALL_TIME + 1] = call
        line[PASSED_AT] = inf if silent or not in_range else time + longest + duration
        line[LONGEST], line[CALLS] = longest_so_far, calls
        ping += 1
    return row


@compiled
def within(
    x: float, y: float, z: float, other_x: float, other_y: float, other_z: float, reach: float,
    slant: bool,
) -> bool:  # fmt: skip
    """Tell whether two places (m) are within a reach (m), seen from above unless `slant`."""
    rise = z - other_z if slant else 0.0
    return bool((x - other_x) ** 2 + (y - other_y) ** 2 + rise**2 <= reach**2)


@compiled
def arrivals(
    fixes: Floats, first: int, end: int, asv: int, time: float, airtime: float, foreseen: bool,
    reach: float, sound_speed: float, rate: float, auv_table: Floats, auv_first: Ints,
    auv_step: float, asv_table: Floats, asv_first: Ints, asv_step: float,
) -> float:  # fmt: skip
    """Let an ASV send the fixes first..end in a frame at an instant (s), which lasts `airtime` (s).

    Their rows tell when they will be at their AUVs, on a clock of a `rate` (Hz, see
    :func:`.clock.after`); an AUV out of the horizontal range (m) when the frame begins never gets
    its fix, and where its way is not `foreseen` the arrival is left open (NaN).  Return the last
    instant (s) of those known, or -1.
    """
    begins = where(asv_table, asv_first, asv_step, asv, time)
    x, y, z, _ = where(asv_table, asv_first, asv_step, asv, time + airtime)
    last = -1.0
    for row in range(first, end):
        line, auv = fixes[row], int(fixes[row, AUV_OF_FIX])
        line[BROADCAST_AT], line[BROADCAST_BY], line[ARRIVES_AT] = time, asv, nan
        place = where(auv_table, auv_first, auv_step, auv, time)
        if (place[0] - begins[0]) ** 2 + (place[1] - begins[1]) ** 2 > reach**2:
            line[OUTCOME_OF_FIX] = OUT_OF_RANGE
        elif foreseen:
            travel = light_time(
                x, y, z, auv_table, auv_first, auv_step, auv, time + airtime, sound_speed
            )
            line[ARRIVES_AT] = after(rate, time, airtime + travel)
            last = max(last, line[ARRIVES_AT])
    return last
