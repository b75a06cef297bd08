"""How the ping of an ASV spreads to the AUVs: whom it reaches, and when.  Compiled."""

from math import hypot, nan
from typing import Annotated, NamedTuple

import numpy as np

from ...acoustics.propagation import (
    SignalPath,
    Spread,
    drowns,
    late,
    lost,
    overlap,
    reaches,
    snr,
    sound,
)
from ...acoustics.travel_time import NEARLY_THERE, PASSED, distance, travel_time_to
from ...core.arrays import Floats, Ints
from ...core.compiled import compiled
from ...core.packed import unpacked
from ...records.events import BURST, CHANCE, COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from ...records.rows import FIX, NONE, PING, RECEPTION, Row, Rows
from ...usbl.instrument import note
from ...usbl.inverted import HeardBeacon, located_astray, located_itself
from ...usbl.measuring import GNSS_NOISE, NOISE_WIDTH, PackedInstrument, instrument_of
from ...usbl.sights import copy_direction, no_sights
from ...usbl.systematic_fixes import PackedErrors, systematic_of
from ...vehicles.motion import Motion, where
from ..hf.reception import PairNoise, begin_fix, by_luck, note_strongest, take_noise


@compiled
def radiate(
    packed: int, asv: int, round_number: int, slot: int, time: float, foreseen: bool,
    ping: int, row: int,
) -> int:  # fmt: skip
    """Let an ASV ping at an instant (s): write its row, `ping`, and from `row` on one for each AUV
    that it reaches.

    Return the row that comes after the last reception.  `packed` is the address of a
    :class:`Spread`.  Where the way of AUVs is not `foreseen`, the arrivals written are
    those at which it is nearly there (:func:`arrive`).
    """
    into = unpacked(packed, Spread)
    pings, receptions, auvs, asvs = into.pings, into.receptions, into.auvs, into.asvs
    way, sound_speed = into.way, into.way.band.sound_speed
    here, line = where(asvs, asv, time), pings[ping]
    line.ping, line.round, line.slot, line.auv, line.asv = ping, round_number, slot, NONE, asv
    line.sent_at_s = time
    line.x_m, line.y_m, line.z_m = here[0], here[1], here[2]
    line.called_at_s = line.call_time_s = line.waited_s = float("nan")
    line.called_by = line.call = line.call_why = NONE
    line.first, line.in_range_of, line.heard_by, line.calls = row, 0, 0, 0
    last = longest = 0.0
    longest_so_far = pings[ping - 1].longest_s if ping else 0.0
    for auv in range(auvs.first.size - 1):
        there = where(auvs, auv, time)
        in_range, strength = reaches(there, here, auv, asv, way), sound(there, here, auv, asv, way)
        if not (in_range or into.everything or strength > 0.0):
            continue
        reception = receptions[row]
        reception.ping, reception.auv, reception.asv = ping, auv, asv
        reception.outcome = IN_FLIGHT if in_range else OUT_OF_RANGE
        reception.why, reception.overlapped_by = NONE if in_range else OUT_OF_RANGE, NONE
        reception.slow_range = nan
        reception.sound, reception.snr_db = strength, snr(auv, asv, way)
        reception.azimuth_deg = reception.elevation_deg = nan  # until it is measured
        reception.body_azimuth_deg = reception.body_elevation_deg = nan
        bent = late(auv, asv, way)
        if foreseen:
            straight = travel_time_to(here, auvs, auv, time + bent, sound_speed)
        else:
            straight = NEARLY_THERE * distance(here, there) / sound_speed
            bent *= NEARLY_THERE if bent > 0.0 else 1.0 / NEARLY_THERE
        travel = straight + bent
        _meet(reception, time, straight, bent, way)
        row += 1
        longest = max(longest, travel) if strength > 0.0 else longest
        if in_range:
            line.in_range_of += 1
            last = max(last, travel)
    line.end, line.longest_s = row, max(longest, longest_so_far)
    line.passed_at_s = time + last + way.band.duration
    return row


@compiled
def _meet(reception: Row, sent_at: float, straight: float, bent: float, way: SignalPath) -> None:
    """Write when a ping arrives that would travel for so long (s) straight on and comes so much
    later (s), and how likely it is lost.
    """
    travel = straight + bent
    reception.arrived_at_s, reception.travel_time_s = sent_at + travel, travel
    reception.slant_range_m, reception.bent_s = straight * way.band.sound_speed, bent
    reception.loss = (
        1.0
        if reception.outcome == OUT_OF_RANGE
        else lost(reception.slant_range_m, reception.auv, reception.asv, way)
    )


@compiled
def arrive(packed: int, row: int, straight: float, bent: float) -> None:
    """Write the arrival of a ping that is nearly there, now that it is known how long it travels
    (:func:`_meet`); `packed` as of :func:`radiate`.
    """
    into = unpacked(packed, Spread)
    reception = into.receptions[row]
    line = into.pings[reception.ping]
    _meet(reception, line.sent_at_s, straight, bent, into.way)
    if reception.outcome == IN_FLIGHT:
        line.passed_at_s = max(line.passed_at_s, reception.arrived_at_s + into.way.band.duration)


class PassiveDecided(NamedTuple):
    """What receptions are decided by, handed over once: as of
    :class:`..hf.reception.Decided`, but that AUVs hear and measure; `gnss_noise` (pings, 3) is how
    far off each ASV believed to be as it pinged, in standard deviations.
    """

    pings: Annotated[Rows, PING]
    receptions: Annotated[Rows, RECEPTION]
    fixes: Annotated[Rows, FIX]
    gnss_noise: Annotated[Floats, 2]
    noise: PairNoise
    auvs: Motion
    instrument: PackedInstrument
    duration: float
    capture: float
    shadowing_sd_db: float


@compiled
def resolve(
    packed: int, time: float, first: int, ping_count: int, reception_count: int, fix: int,
    errors: int | None,
) -> tuple[int, int, int]:  # fmt: skip
    """Decide all receptions from the row `first` on that have ended by an instant (s), as they did.

    Return the number of fixes then, the first row that is not decided, and NONE; or, when the noise
    of a pair is used up, in place of that its row: the pair must have new noise and the function be
    called again.  `packed` is the address of a :class:`PassiveDecided`, of which so many
    pings, receptions and fixes are on record; the rest as of :func:`..hf.reception.resolve`.
    """
    by = unpacked(packed, PassiveDecided)
    noise, pings, receptions = by.noise, by.pings[:ping_count], by.receptions[:reception_count]
    drawn = noise.taken_now[0]
    for row in _ended(receptions, first, time, by.duration):
        reception = receptions[row]
        if noise.taken[reception.auv, reception.asv] == noise.blocks.shape[1]:
            return fix, first, row
        luck = take_noise(reception, noise, drawn)
        reception.outcome = _outcome(row, luck, pings, receptions, by.duration, by.capture)
        if reception.outcome == LOST:
            reception.why = BURST if noise.bursts.size > 0 else CHANCE
        elif reception.outcome == COLLIDED:
            note_strongest(row, pings, receptions, by.duration, None, True)
        reception.snr_db += by.shadowing_sd_db * luck
        if reception.outcome == HEARD:
            pings[reception.ping].heard_by += 1
            _make(fix, row, drawn, packed, errors)
            fix += 1
    while first < len(receptions) and receptions[first].outcome != IN_FLIGHT:
        first += 1
    return fix, first, NONE


@compiled
def _make(fix: int, row: int, drawn: Floats, packed: int, errors: int | None) -> None:
    """Write the row of a fix that an AUV makes of a reception, by the noise `drawn` for that."""
    by = unpacked(packed, PassiveDecided)
    reception, line = by.receptions[row], by.fixes[fix]
    ping = by.pings[reception.ping]
    line.fix = fix
    _begin_own(line, ping, reception, row, by.duration)
    if by.instrument.array.size == 0:  # one of somebody's own measures later
        no_sights(by.receptions[row : row + 1])
        copy_direction(line, by.receptions[row : row + 1])
        return
    instrument = instrument_of(by.instrument)
    x, y, z, yaw = where(by.auvs, reception.auv, reception.arrived_at_s)
    drawn[GNSS_NOISE:NOISE_WIDTH] = by.gnss_noise[reception.ping]  # the ASV's, for all that hear it
    own = HeardBeacon(ping, reception, (x, y, z), yaw, drawn)
    if errors is not None:
        packed_errors = unpacked(errors, PackedErrors)
        place, covariance, jacobian, packed_errors.left[fix] = located_astray(
            own, instrument, systematic_of(packed_errors)
        )
        packed_errors.jacobians[fix] = jacobian[:2]
    else:
        place, covariance = located_itself(own, instrument)
    note(line, ping, place, covariance)
    copy_direction(line, by.receptions[row : row + 1])
    line.error_m = hypot(place[0] - x, place[1] - y)


@compiled
def _ended(receptions: Rows, first: int, time: float, duration: float) -> Ints:
    """Return the receptions from `first` on that have ended by an instant (s) and are not decided,
    in the order in which they did.
    """
    rows = np.empty(len(receptions) - first, dtype=np.int64)
    size = 0
    for row in range(first, len(receptions)):
        reception = receptions[row]
        if reception.outcome == IN_FLIGHT and reception.arrived_at_s + duration <= time:
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
    reception = receptions[row]
    lasts, others = PASSED * pings[reception.ping].longest_s + duration, 0.0
    for number in range(reception.ping - 1, -1, -1):
        if pings[number].sent_at_s + lasts < reception.arrived_at_s:
            break
        arrivals = receptions[pings[number].first : pings[number].end]
        others += _interference_of(reception, arrivals, duration)
    for number in range(reception.ping + 1, len(pings)):
        if pings[number].sent_at_s > reception.arrived_at_s + duration:
            break
        arrivals = receptions[pings[number].first : pings[number].end]
        others += _interference_of(reception, arrivals, duration)
    return others


@compiled
def _interference_of(reception: Row, others: Rows, duration: float) -> float:
    """Return how strong another ping, of these receptions, is at the same AUV while this lasts."""
    for other in others:
        if other.auv == reception.auv and overlap(
            reception.arrived_at_s, other.arrived_at_s, duration
        ):
            return float(other.sound)
    return 0.0


@compiled
def _begin_own(row: Row, ping: Row, reception: Row, number: int, duration: float) -> None:
    """Write the row of a fix that an AUV makes of a reception: it holds as the ping arrives, and is
    had as soon as that is decoded.
    """
    begin_fix(row, ping, number)
    row.auv, row.valid_at_s = reception.auv, reception.arrived_at_s
    row.arrives_at_s = reception.arrived_at_s + duration
