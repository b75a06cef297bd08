"""What becomes of an ASV's ping at the AUVs in range, and the fixes that they make of it.

Compiled.  Each reception is decided once it has ended: all sound that could overlap it is on record
by then.
"""

from math import hypot
from typing import Annotated, NamedTuple

import numpy as np

from ...acoustics.propagation import drowns, overlap
from ...core.compiled import compiled
from ...core.handed import opened
from ...records.events import COLLIDED, HEARD, IN_FLIGHT
from ...records.rows import FIX, NONE, PING, RECEPTION, Row, Rows
from ...usbl.instrument import NOISE_WIDTH, HandedInstrument, instrument_of
from ...usbl.inverted import Hearing, located_astray, located_itself
from ...usbl.measurement import note
from ...usbl.sights import unknown_sights
from ...usbl.systematic.errors import HandedErrors, lasting_of
from ...vehicles.motion import Floats, Ints, Motion, where
from ..hf.reception import Noise, begin, by_luck

# Factor on the longest way on record after which sound has passed whoever was in range, be his
# arrival one at which it was nearly there (:mod:`.radiation`); nobody is as fast.
PASSED = 1.05


class Decided(NamedTuple):
    """What receptions are decided by, handed over once: as of :class:`..hf.reception.Decided`, but
    that AUVs hear and measure; `gnss_noise` (pings, 3) is how far off each ASV believed to be as it
    pinged, in standard deviations.
    """

    pings: Annotated[Rows, PING]
    receptions: Annotated[Rows, RECEPTION]
    fixes: Annotated[Rows, FIX]
    gnss_noise: Annotated[Floats, 2]
    noise: Noise
    auvs: Motion
    instrument: HandedInstrument
    duration: float
    capture: float
    shadowing_sd_db: float


@compiled
def settle(
    handed: int, time: float, first: int, ping_count: int, reception_count: int, fix: int,
    has_sheet: bool | None, errors: int | None,
) -> tuple[int, int, int]:  # fmt: skip
    """Decide all receptions from the row `first` on that have ended by an instant (s), as they did.

    Return the number of fixes then, the first row that is not decided, and NONE; or, when the noise
    of a pair is used up, in place of that its row: the pair must have new noise and the function be
    called again.  `handed` is the address of a :class:`Decided`, of which so many pings, receptions
    and fixes are on record; the rest as of :class:`..hf.reception.Extras`.
    """
    by = opened(handed, Decided)
    noise, pings, receptions = by.noise, by.pings[:ping_count], by.receptions[:reception_count]
    for row in _ended(receptions, first, time, by.duration):
        it = receptions[row]
        if noise.taken[it.auv, it.asv] == noise.blocks.shape[1]:
            return fix, first, row
        drawn = noise.blocks[noise.shelf[it.auv, it.asv], noise.taken[it.auv, it.asv]]
        noise.taken[it.auv, it.asv] += 1  # whatever comes of it: worlds that differ share it
        it.outcome = _outcome(row, drawn[NOISE_WIDTH], pings, receptions, by.duration, by.capture)
        it.snr_db += by.shadowing_sd_db * drawn[NOISE_WIDTH]
        if it.outcome == HEARD:
            pings[it.ping].heard_by += 1
            _make(fix, row, drawn, handed, has_sheet, errors)
            fix += 1
    while first < len(receptions) and receptions[first].outcome != IN_FLIGHT:
        first += 1
    return fix, first, NONE


@compiled
def _make(
    fix: int, row: int, drawn: Floats, handed: int, has_sheet: bool | None, errors: int | None
) -> None:
    """Write the row of a fix that an AUV makes of a reception, by the noise `drawn` for that."""
    by = opened(handed, Decided)
    it, line = by.receptions[row], by.fixes[fix]
    ping = by.pings[it.ping]
    line.fix = fix
    _begin_own(line, ping, it, row, by.duration)
    if by.instrument.array.size == 0:  # one of somebody's own measures later
        unknown_sights(by.receptions[row : row + 1])
        return
    instrument = instrument_of(by.instrument, has_sheet)
    x, y, z, yaw = where(by.auvs, it.auv, it.arrived_at_s)
    noise = drawn.copy()
    noise[9:12] = by.gnss_noise[it.ping]  # one error of the ASV for all that hear it
    own = Hearing(ping, it, (x, y, z), yaw, noise)
    if errors is not None:
        told = opened(errors, HandedErrors)
        place, covariance, lever, told.left[fix] = located_astray(own, instrument, lasting_of(told))
        told.levers[fix] = lever[:2]
    else:
        place, covariance = located_itself(own, instrument)
    note(line, ping, place, covariance)
    line.error_m = hypot(place[0] - x, place[1] - y)


@compiled
def _ended(receptions: Rows, first: int, time: float, duration: float) -> Ints:
    """Return the receptions from `first` on that have ended by an instant (s) and are not decided,
    in the order in which they did.
    """
    rows = np.empty(len(receptions) - first, dtype=np.int64)
    size = 0
    for row in range(first, len(receptions)):
        it = receptions[row]
        if it.outcome == IN_FLIGHT and it.arrived_at_s + duration <= time:
            rows[size] = row
            size += 1
    ends = np.empty(size)
    for k in range(size):
        ends[k] = receptions[rows[k]].arrived_at_s + duration
    return rows[:size][np.argsort(ends, kind="mergesort")]


@compiled
def _outcome(
    row: int, luck: float, pings: Rows, receptions: Rows, duration: float, capture: float
) -> int:
    """Return what becomes of a ping at an AUV, where it is lost by `luck`, a standard normal."""
    if drowns(receptions[row].sound, _interference(row, pings, receptions, duration), capture):
        return COLLIDED
    return by_luck(receptions[row], luck)


@compiled
def _interference(row: int, pings: Rows, receptions: Rows, duration: float) -> float:
    """Return how strong the pings are that overlap this one at its AUV, together; touching is no
    overlap.

    Pings are on record in the order in which they were sent, so the search ends at one that was
    over before this arrival, or sent after it.
    """
    it = receptions[row]
    lasts, others = PASSED * pings[it.ping].longest_s + duration, 0.0
    for number in range(it.ping - 1, -1, -1):
        if pings[number].sent_at_s + lasts < it.arrived_at_s:
            break
        its = receptions[pings[number].first : pings[number].end]
        others += _interference_of(it, its, duration)
    for number in range(it.ping + 1, len(pings)):
        if pings[number].sent_at_s > it.arrived_at_s + duration:
            break
        its = receptions[pings[number].first : pings[number].end]
        others += _interference_of(it, its, duration)
    return others


@compiled
def _interference_of(it: Row, others: Rows, duration: float) -> float:
    """Return how strong another ping, of these receptions, is at the same AUV while this lasts."""
    for other in others:
        if other.auv == it.auv and overlap(it.arrived_at_s, other.arrived_at_s, duration):
            return float(other.sound)
    return 0.0


@compiled
def _begin_own(row: Row, ping: Row, it: Row, number: int, duration: float) -> None:
    """Write the row of a fix that an AUV makes of a reception: it holds as the ping arrives, and is
    had as soon as that is decoded.
    """
    begin(row, ping, number)
    row.auv, row.valid_at_s = it.auv, it.arrived_at_s
    row.arrives_at_s = it.arrived_at_s + duration
