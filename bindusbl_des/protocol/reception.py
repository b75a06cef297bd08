"""What becomes of a ping at the ASVs in range: who hears it, and who does not."""

from math import erfc, hypot, inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from ..acoustics.loss import LossTerms, loss_probability
from ..acoustics.propagation import overlap
from ..core.compiled import compiled, entry
from ..records.events import COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from ..records.rows import NONE, Row, Rows
from ..usbl.instrument import NOISE_WIDTH, Instrument
from ..usbl.measurement import measured
from ..vehicles.motion import Floats, Ints, Motion
from .calling import drowned


class Air(NamedTuple):
    """All sound on record: pings, their receptions, calls; and how long (s) each lasts."""

    pings: Rows
    receptions: Rows
    calls: Rows
    duration: float


class Noise(NamedTuple):
    """Numbers drawn for each pair of an AUV and an ASV (:class:`.streams.NoiseStore`)."""

    shelf: Ints
    taken: Ints
    blocks: Floats


class Listeners(NamedTuple):
    """The ASVs as listeners: where they are, what they measure with, how likely they hear nothing.

    `strayed` (n,) is how far each AUV may have gone between a call and the answer (variance along
    its course, m2).
    """

    asvs: Motion
    instrument: Instrument
    loss: LossTerms
    strayed: Floats


@compiled
def overlapped(row: int, air: Air) -> bool:
    """Tell whether another ping overlaps this one at its ASV; touching is no overlap.

    Pings are on record in the order in which they were sent, so the search ends at one that was
    over before this arrival, or sent after it.
    """
    pings, receptions = air.pings, air.receptions
    it = receptions[row]
    longest = pings[it.ping].longest_s
    for other in range(row - 1, -1, -1):
        sent_at = pings[receptions[other].ping].sent_at_s
        if sent_at + longest + air.duration < it.arrived_at_s:
            break
        if _meet(it, receptions[other], air.duration):
            return True
    for other in range(row + 1, len(receptions)):
        if pings[receptions[other].ping].sent_at_s > it.arrived_at_s + air.duration:
            break
        if _meet(it, receptions[other], air.duration):
            return True
    return False


@compiled
def _meet(it: Row, other: Row, duration: float) -> bool:
    """Tell whether another ping is at the same ASV while this one lasts; one not sent is not."""
    if other.asv != it.asv or other.outcome == OUT_OF_RANGE:
        return False
    return overlap(it.arrived_at_s, other.arrived_at_s, duration)


@entry
def settle(
    time: float, first: int, only: int, pings: Rows, receptions: Rows, calls: Rows,
    duration: float, fixes: Rows, fix: int, shelf: Ints, taken: Ints, blocks: Floats,
    coefficients: Floats, combine: int, contention: float, cap: float,
    asv_table: Floats, asv_first: Ints, asv_step: float,
    array: Floats, metric: Floats, levels: Rows, strayed: Floats,
) -> tuple[int, int, int]:  # fmt: skip
    """Decide all pings from `first` on that have passed every ASV by an instant (s), as they did;
    or of the ping `first` the reception `only`, if that is not NONE.

    Return the number of fixes then, and NONE, NONE; or, when the noise of a pair of an AUV and an
    ASV is used up, these: it must be refilled and the function called again.
    """
    air, noise = Air(pings, receptions, calls, duration), Noise(shelf, taken, blocks)
    listeners = Listeners(
        Motion(asv_table, asv_first, asv_step),
        Instrument(array, metric, levels[0]),
        LossTerms(coefficients, combine, contention, cap),
        strayed,
    )
    if only != NONE:
        made, dry = _decide(first, only, only + 1, air, fixes, fix, noise, listeners)
        return fix + made, pings[first].auv if dry != NONE else NONE, dry
    for ping in _due(pings, first, time):
        line = pings[ping]
        made, dry = _decide(ping, line.first, line.end, air, fixes, fix, noise, listeners)
        if dry != NONE:
            return fix, line.auv, dry
        fix += made
        line.passed_at_s = inf
    return fix, NONE, NONE


@compiled
def _due(pings: Rows, first: int, time: float) -> Ints:
    """Return the pings from `first` on that have passed by an instant (s), as they did."""
    due = np.empty(len(pings) - first, dtype=np.int64)
    size = 0
    for ping in range(first, len(pings)):
        if pings[ping].passed_at_s <= time:
            place = size
            while place > 0 and pings[due[place - 1]].passed_at_s > pings[ping].passed_at_s:
                due[place] = due[place - 1]
                place -= 1
            due[place] = ping
            size += 1
    return due[:size]


@compiled
def _decide(
    ping: int, first: int, end: int, air: Air, fixes: Rows, fix: int, noise: Noise,
    listeners: Listeners,
) -> tuple[int, int]:  # fmt: skip
    """Decide the receptions first..end of a ping; fuse what was heard, if nobody heard it before.

    Return 1 if that made a fix, which is then row `fix`, else 0; and NONE.  Where an ASV's noise is
    used up, nothing is done and its number returned.
    """
    line, receptions = air.pings[ping], air.receptions
    auv = line.auv
    for row in range(first, end):
        it = receptions[row]
        if it.outcome == IN_FLIGHT and noise.taken[auv, it.asv] == noise.blocks.shape[1]:
            return 0, it.asv
    heard, measuring = np.empty(end - first, dtype=np.int64), np.zeros((end - first, NOISE_WIDTH))
    hearers = 0
    for row in range(first, end):
        it = receptions[row]
        if it.outcome != IN_FLIGHT:
            continue
        drawn = noise.blocks[noise.shelf[auv, it.asv], noise.taken[auv, it.asv]]
        noise.taken[auv, it.asv] += 1  # whatever comes of it: worlds that differ share their noise
        measuring[row - first] = drawn[:NOISE_WIDTH]
        it.outcome = _outcome(row, drawn[NOISE_WIDTH], air, listeners.loss)
        if it.outcome == HEARD:
            heard[hearers] = row - first
            hearers += 1
    makes = hearers > 0 and line.heard_by == 0
    line.heard_by += hearers
    if makes:
        estimate, covariance = measured(
            line, heard[:hearers], receptions[first:end], measuring, listeners.asvs,
            listeners.instrument, listeners.strayed[auv],
        )  # fmt: skip
        _note(fixes[fix], line, estimate, covariance)
        fixes[fix].fix, fixes[fix].first, fixes[fix].end = fix, first, end
    return int(makes), NONE


@compiled
def _outcome(row: int, luck: float, air: Air, loss: LossTerms) -> int:
    """Return what becomes of a ping at an ASV, where it is lost by `luck`, a standard normal."""
    it = air.receptions[row]
    if overlapped(row, air) or drowned(air.pings[it.ping], it, air.duration, air.calls):
        return COLLIDED
    chance = 0.5 * erfc(-luck / sqrt(2.0))  # uniform
    return LOST if chance < loss_probability(it.slant_range_m, loss) else HEARD


@entry
def foretold(
    row: int, luck: float, pings: Rows, receptions: Rows, calls: Rows, duration: float,
    coefficients: Floats, combine: int, contention: float, cap: float,
) -> int:  # fmt: skip
    """Return what will be decided of a reception, once the ping has passed its ASV."""
    loss = LossTerms(coefficients, combine, contention, cap)
    return _outcome(row, luck, Air(pings, receptions, calls, duration), loss)


@compiled
def _note(row: Row, ping: Row, estimate: Floats, covariance: Floats) -> None:
    """Write the row of a fix that has been made of a ping."""
    row.ping, row.round, row.auv = ping.ping, ping.round, ping.auv
    row.pinged_at_s = row.valid_at_s = ping.sent_at_s
    row.x_m, row.y_m, row.z_m = estimate[0], estimate[1], estimate[2]
    row.sd_x_m = sqrt(max(covariance[0, 0], 0.0))
    row.sd_y_m = sqrt(max(covariance[1, 1], 0.0))
    row.sd_z_m = sqrt(max(covariance[2, 2], 0.0))
    row.cov_xy_m2, row.cov_xz_m2 = covariance[0, 1], covariance[0, 2]
    row.cov_yz_m2 = covariance[1, 2]
    row.error_m = hypot(estimate[0] - ping.x_m, estimate[1] - ping.y_m)
    row.broadcast_at_s, row.broadcast_by = nan, NONE
    row.delivered_at_s = row.latency_s = row.arrives_at_s = nan
    row.innovation_m = row.correction_m = row.nis = nan
    row.outcome = IN_FLIGHT
