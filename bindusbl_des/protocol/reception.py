"""What becomes of a ping at the ASVs in range: who hears it, and who does not."""

from math import erfc, hypot, inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from ..acoustics.loss import loss_probability
from ..acoustics.propagation import overlap
from ..core.compiled import compiled
from ..records.columns import (
    ARRIVED_AT,
    AT_ASV,
    AUV,
    AUV_OF_FIX,
    BROADCAST_AT,
    COVARIANCE,
    END,
    ERROR,
    FIRST,
    FIX,
    FIX_COLUMNS,
    FUSED,
    FUSED_END,
    HEARD_BY,
    LONGEST,
    OF_PING,
    OUTCOME,
    OUTCOME_OF_FIX,
    PASSED_AT,
    PING,
    PING_OF_FIX,
    PING_X,
    PINGED_AT,
    POSITION,
    ROUND,
    ROUND_OF_FIX,
    SD,
    SENT_AT,
    SLANT_RANGE,
    VALID_AT,
)
from ..records.events import COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from ..usbl.instrument import NOISE_WIDTH
from ..usbl.measurement import measured
from ..vehicles.motion import Floats, Ints
from .calling import drowned

NOBODY = -1


class LossTerms(NamedTuple):
    """How likely a ping is lost on its way (:func:`.loss_probability`)."""

    coefficients: Floats
    combine: int
    contention: float
    cap: float


@compiled
def overlapped(row: int, count: int, duration: float, pings: Floats, receptions: Floats) -> bool:
    """Tell whether another ping overlaps this one at its ASV; touching is no overlap.

    `duration` is that of a ping (s).  Pings are on record in the order in which they were sent, so
    the search ends at one that was over before this arrival, or sent after it.
    """
    starts, ends = receptions[row, ARRIVED_AT], receptions[row, ARRIVED_AT] + duration
    longest = pings[int(receptions[row, OF_PING]), LONGEST]
    for other in range(row - 1, -1, -1):
        if pings[int(receptions[other, OF_PING]), SENT_AT] + longest + duration < starts:
            break
        if _meet(row, other, duration, receptions):
            return True
    for other in range(row + 1, count):
        if pings[int(receptions[other, OF_PING]), SENT_AT] > ends:
            break
        if _meet(row, other, duration, receptions):
            return True
    return False


@compiled
def _meet(row: int, other: int, duration: float, receptions: Floats) -> bool:
    """Tell whether another ping is at the same ASV while this one lasts; one not sent is not."""
    if receptions[other, AT_ASV] != receptions[row, AT_ASV]:
        return False
    if receptions[other, OUTCOME] == OUT_OF_RANGE:
        return False
    return overlap(receptions[row, ARRIVED_AT], receptions[other, ARRIVED_AT], duration)


@compiled
def passed(
    time: float, first: int, pings: Floats, ping_count: int, receptions: Floats, count: int,
    fixes: Floats, fix: int, calls: Floats, duration: float, shelf: Ints, taken: Ints,
    blocks: Floats, coefficients: Floats, combine: int, contention: float, cap: float,
    asv_table: Floats, asv_first: Ints, asv_step: float, array: Floats, metric: Floats,
    levels: Floats, strayed: Floats,
) -> tuple[int, int, int]:  # fmt: skip
    """Decide all pings from `first` on that have passed every ASV by an instant (s), as they did.

    Return the number of fixes then, and NOBODY, NOBODY; or, when the noise of a pair of an AUV and
    an ASV is used up, these: it must be refilled and the function called again.
    """
    due = np.empty(ping_count - first, dtype=np.int64)
    size = 0
    for ping in range(first, ping_count):
        if pings[ping, PASSED_AT] <= time:
            place = size
            while place > 0 and pings[due[place - 1], PASSED_AT] > pings[ping, PASSED_AT]:
                due[place] = due[place - 1]
                place -= 1
            due[place] = ping
            size += 1
    for ping in due[:size]:
        made, dry = decide(
            ping, int(pings[ping, FIRST]), int(pings[ping, END]), pings, receptions, count, fixes,
            fix, calls, duration, shelf, taken, blocks, coefficients, combine, contention, cap,
            asv_table, asv_first, asv_step, array, metric, levels, strayed,
        )  # fmt: skip
        if dry != NOBODY:
            return fix, int(pings[ping, AUV]), dry
        fix += made
        pings[ping, PASSED_AT] = inf
    return fix, NOBODY, NOBODY


@compiled
def decide(
    ping: int, first: int, end: int, pings: Floats, receptions: Floats, count: int, fixes: Floats,
    fix: int, calls: Floats, duration: float, shelf: Ints, taken: Ints, blocks: Floats,
    coefficients: Floats, combine: int, contention: float, cap: float, asv_table: Floats,
    asv_first: Ints, asv_step: float, array: Floats, metric: Floats, levels: Floats,
    strayed: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Decide the receptions first..end of a ping; fuse what was heard, if nobody heard it before.

    Return 1 if that made a fix, which is then row `fix`, else 0; and NOBODY.  `count` receptions
    are on record, and all `calls`.  `strayed` is how far AUVs may have gone between a call and the
    answer (variance along their course, m2).  Where an ASV's noise is used up, nothing is done and
    its number returned.
    """
    line = pings[ping]
    auv = int(line[AUV])
    for row in range(first, end):
        asv = int(receptions[row, AT_ASV])
        if receptions[row, OUTCOME] == IN_FLIGHT and taken[auv, asv] == blocks.shape[1]:
            return 0, asv
    heard, noise = np.empty(end - first, dtype=np.int64), np.zeros((end - first, NOISE_WIDTH))
    hearers = 0
    for row in range(first, end):
        it = receptions[row]
        if it[OUTCOME] != IN_FLIGHT:
            continue
        asv = int(it[AT_ASV])
        drawn = blocks[shelf[auv, asv], taken[auv, asv]]
        taken[auv, asv] += 1  # whatever comes of it, so that worlds that differ share their noise
        noise[row - first] = drawn[:NOISE_WIDTH]
        chance = 0.5 * erfc(-drawn[NOISE_WIDTH] / sqrt(2.0))  # uniform, of a standard normal
        if overlapped(row, count, duration, pings, receptions) or drowned(
            row, duration, pings, receptions, calls
        ):
            it[OUTCOME] = COLLIDED
        elif chance < loss_probability(it[SLANT_RANGE], coefficients, combine, contention, cap):
            it[OUTCOME] = LOST
        else:
            it[OUTCOME] = HEARD
            heard[hearers] = row
            hearers += 1
    makes = hearers > 0 and line[HEARD_BY] == 0
    line[HEARD_BY] += hearers
    if makes:
        estimate, covariance = measured(
            line, heard[:hearers], receptions, first, noise, asv_table, asv_first, asv_step, array,
            metric, levels, strayed[auv],
        )  # fmt: skip
        _note(fixes[fix], fix, line, first, end, estimate, covariance)
    return int(makes), NOBODY


@compiled
def _note(
    row: Floats, fix: int, ping: Floats, first: int, end: int, estimate: Floats, covariance: Floats
) -> None:
    """Write the row of a fix that has been made of the receptions first..end of a ping."""
    row[FIX], row[PING_OF_FIX], row[ROUND_OF_FIX] = fix, ping[PING], ping[ROUND]
    row[AUV_OF_FIX], row[PINGED_AT], row[VALID_AT] = ping[AUV], ping[SENT_AT], ping[SENT_AT]
    row[FUSED], row[FUSED_END] = first, end
    for axis in range(3):
        row[POSITION + axis] = estimate[axis]
        row[SD + axis] = sqrt(max(covariance[axis, axis], 0.0))
    row[COVARIANCE], row[COVARIANCE + 1] = covariance[0, 1], covariance[0, 2]
    row[COVARIANCE + 2] = covariance[1, 2]
    row[ERROR] = hypot(estimate[0] - ping[PING_X], estimate[1] - ping[PING_X + 1])
    for column in range(BROADCAST_AT, OUTCOME_OF_FIX):
        row[column] = nan
    for column in range(FUSED_END + 1, FIX_COLUMNS):
        row[column] = nan
    row[OUTCOME_OF_FIX] = IN_FLIGHT
