"""Outcomes of a ping where it arrives, and the fix that is made of it; compiled.

Once a ping has passed all ASVs, those that heard it make one fix.  With passive ranging each AUV
makes a fix of each ping that it hears, as soon as that is over.
"""

from math import hypot, inf, nan, sqrt
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled
from ...support.packed import unpacked
from ..acoustics.bursts import PAIR, burst_luck
from ..acoustics.loss import chance_of
from ..acoustics.propagation import drowns, overlap
from ..acoustics.sounds import SOUND, interference
from ..acoustics.travel_time import PASSED
from ..records.events import (
    BURST,
    BY_ECHO,
    BY_PING,
    CHANCE,
    COLLIDED,
    HEARD,
    IN_FLIGHT,
    LOST,
)
from ..records.rows import FIX, NONE, PING, RECEPTION, Row, Rows
from ..usbl.fixes import (
    HeardBeacon,
    located_itself,
    located_with_errors,
    measured,
    measured_with_errors,
    note,
)
from ..usbl.measuring import GNSS_NOISE, NOISE_WIDTH, PackedInstrument, instrument_of
from ..usbl.sights import Heard, copy_direction, no_sights
from ..usbl.slow_errors import RANGE, SLOW, advance, blend
from ..usbl.systematic_effects import PackedErrors, systematic_of
from ..vehicles.motion import Motion, where


class Air(NamedTuple):
    """All sound on record of a band: `pings`, their `receptions`, other `sounds`; the `duration` of
    pings (s); the vehicle number of the first listener; `capture` and shadowing (dB) as of
    :class:`..acoustics.channel.Receiver`.
    """

    pings: Rows
    receptions: Rows
    sounds: Rows
    duration: float
    first_listener: int
    capture: float
    shadowing_sd_db: float


class PairNoise(NamedTuple):
    """Random numbers for each pair of an AUV and an ASV (:class:`...support.streams.NoiseStore`);
    `taken_now` (m or more, columns) are numbers of one ping, a row for each of its receptions.

    `slow` (AUVs, ASVs, n) are slow errors, :data:`..usbl.slow_errors.SLOW`, n = 0 without any;
    pings are lost in `bursts` (AUVs, ASVs), :data:`..acoustics.bursts.PAIR`, empty without any.
    """

    shelf: Annotated[Ints, 2]
    taken: Annotated[Ints, 2]
    blocks: Annotated[Floats, 3]
    taken_now: Annotated[Floats, 2]
    slow: Annotated[Rows, SLOW, 3]
    bursts: Annotated[Rows, PAIR, 2]


class Decided(NamedTuple):
    """What pings are decided by, packed once: all sound on record (:class:`Air`) and the fixes,
    buffers with free rows; `due`, space for numbers of pings; the noise; the listeners' motion; the
    instrument; and `strayed` (n,), m2: the variance, along any level axis, of how far each AUV goes
    between a call and its answer.
    """

    pings: Annotated[Rows, PING]
    receptions: Annotated[Rows, RECEPTION]
    sounds: Annotated[Rows, SOUND]
    fixes: Annotated[Rows, FIX]
    due: Ints
    noise: PairNoise
    listeners: Motion
    instrument: PackedInstrument
    strayed: Floats
    duration: float
    first_listener: int
    capture: float
    shadowing_sd_db: float


@compiled
def resolve(
    packed: int, time: float, first: int, only: int, pings: int, receptions: int, sounds: int,
    fix: int, errors: int | None, echoes: Rows | None, gnss_noise: Floats | None,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Decide all pings from `first` on that have passed every ASV by an instant (s), in the order
    in which they passed; or of the ping `first` the reception `only`, if that is not NONE.

    Return the new number of fixes, the first ping that is not decided, and NONE, NONE. When the
    noise of a pair is used up, return its AUV and ASV in their place: refill it and call again.
    `packed` is the address of a :class:`Decided`, whose buffers hold so many `pings`, `receptions`,
    `sounds`, and `fix` fixes.

    Arguments that few bands have may be None, and their code is then left out: `errors`, the
    address of a :class:`PackedErrors`; `echoes`, one row for each reception,
    :data:`..acoustics.sonar_channel.ECHO`; and, where ASVs ping, `gnss_noise` (pings, 3), the ASV's
    GNSS error in standard deviations.  With this, every reception is decided by itself, once it is
    over.
    """
    by = unpacked(packed, Decided)
    air = _on_record(by, pings, receptions, sounds)
    if gnss_noise is not None:
        for row in _over(air, first, time):
            ping = air.pings[air.receptions[row].ping]
            dry, hearers = _decide_ping(ping.ping, row, air, echoes, by.noise)
            if dry != NONE:
                return fix, first, air.receptions[row].auv, dry
            if hearers:
                _make(fix, ping, row, packed, errors, gnss_noise)
                fix += 1
    else:
        count, by.due[0] = 1, first
        if only == NONE:
            count = _write_due(by.due, air.pings, first, time)
        for number in by.due[:count]:
            ping = air.pings[number]
            dry, hearers = _decide_ping(number, only, air, echoes, by.noise)
            if dry != NONE:
                return fix, first, ping.auv, dry
            if hearers and ping.heard_by == hearers:  # no ASV has heard it before
                _make(fix, ping, only, packed, errors, None)
                fix += 1
            if only == NONE:
                ping.passed_at_s = inf
    while first < pings and not _is_under_way(air, first):
        first += 1
    return fix, first, NONE, NONE


@compiled
def _is_under_way(air: Air, ping: int) -> bool:
    """Return whether a reception of a ping is yet to be decided."""
    for row in range(air.pings[ping].first, air.pings[ping].end):
        if air.receptions[row].outcome == IN_FLIGHT:
            return True
    return False


@compiled
def _over(air: Air, first: int, time: float) -> Ints:
    """Return the undecided receptions of pings from `first` on that are over by an instant (s), in
    the order of their ends.
    """
    begin = air.pings[first].first if first < len(air.pings) else len(air.receptions)
    rows, size = np.empty(len(air.receptions) - begin, np.int64), 0
    for row in range(begin, len(air.receptions)):
        reception = air.receptions[row]
        if reception.outcome == IN_FLIGHT and reception.arrived_at_s + air.duration <= time:
            rows[size] = row
            size += 1
    ends = np.empty(size)
    for k in range(size):
        ends[k] = air.receptions[rows[k]].arrived_at_s + air.duration
    return rows[:size][np.argsort(ends, kind="mergesort")]


@compiled
def _make(
    fix: int, ping: Row, only: int, packed: int, errors: int | None, gnss_noise: Floats | None
) -> None:
    """Write the fix of row `fix`: its ping, its receptions (`only` one, if not NONE), and the
    position measured by them.

    A fix that an AUV makes itself (with `gnss_noise`) holds as the ping arrives, and the AUV has it
    once the ping is decoded.  Arguments as of :func:`resolve`.
    """
    by = unpacked(packed, Decided)
    row = by.fixes[fix]
    row.fix = fix
    begin_fix(row, ping, only)
    receptions = by.receptions[row.first : row.end]
    if gnss_noise is not None:
        row.auv, row.valid_at_s = receptions[0].auv, receptions[0].arrived_at_s
        row.arrives_at_s = receptions[0].arrived_at_s + by.duration
    if by.instrument.array.size == 0:  # a user-defined one measures later
        no_sights(receptions)
    elif gnss_noise is not None:
        _locate_itself(fix, ping, packed, errors, gnss_noise)
    else:
        heard = Heard(ping, receptions, by.noise.taken_now)
        if errors is not None:
            packed_errors = unpacked(errors, PackedErrors)
            place, covariance, jacobian, packed_errors.left[fix] = measured_with_errors(
                heard, by.listeners, by.instrument, by.strayed, systematic_of(packed_errors)
            )
            packed_errors.jacobians[fix] = jacobian[:2]
        else:
            place, covariance = measured(heard, by.listeners, by.instrument, by.strayed)
        note(row, ping, place, covariance)
    copy_direction(row, receptions)


@compiled
def _locate_itself(
    fix: int, ping: Row, packed: int, errors: int | None, gnss_noise: Floats
) -> None:
    """Write the fix that an AUV makes itself by an ASV's ping; arguments as of :func:`resolve`."""
    by = unpacked(packed, Decided)
    row, drawn = by.fixes[fix], by.noise.taken_now[0]
    instrument = instrument_of(by.instrument, 0)  # AUVs' arrays are alike
    reception = by.receptions[row.first]
    x, y, z, yaw = where(by.listeners, reception.listener, reception.arrived_at_s)
    drawn[GNSS_NOISE:NOISE_WIDTH] = gnss_noise[ping.ping]  # the ASV's, the same for all listeners
    own = HeardBeacon(ping, reception, (x, y, z), yaw, drawn)
    if errors is not None:
        packed_errors = unpacked(errors, PackedErrors)
        place, covariance, jacobian, packed_errors.left[fix] = located_with_errors(
            own, instrument, systematic_of(packed_errors)
        )
        packed_errors.jacobians[fix] = jacobian[:2]
    else:
        place, covariance = located_itself(own, instrument)
    note(row, ping, place, covariance)
    row.error_m = hypot(place[0] - x, place[1] - y)


@compiled
def _write_due(due: Ints, pings: Rows, first: int, time: float) -> int:
    """Write to `due` the pings from `first` on that have passed by an instant (s), in the order in
    which they passed; return how many.
    """
    size = 0
    for ping in range(first, len(pings)):
        if pings[ping].passed_at_s <= time:
            place = size
            while place > 0 and pings[due[place - 1]].passed_at_s > pings[ping].passed_at_s:
                due[place] = due[place - 1]
                place -= 1
            due[place] = ping
            size += 1
    return size


@compiled
def _decide_ping(
    ping: int, only: int, air: Air, echoes: Rows | None, noise: PairNoise
) -> tuple[int, int]:
    """Decide all receptions of a ping, or `only` one, each by a row of the noise.

    Return NONE and how many have heard the ping now.  Where the noise of a pair is used up, decide
    nothing and return its ASV, 0.
    """
    line = air.pings[ping]
    first, end = line.first, line.end
    if only != NONE:
        first, end = only, only + 1
    for reception in air.receptions[first:end]:
        if (
            reception.outcome == IN_FLIGHT
            and noise.taken[reception.auv, reception.asv] == noise.blocks.shape[1]
        ):
            return int(reception.asv), 0
    hearers = 0
    for row in range(first, end):
        reception, taken_now = air.receptions[row], noise.taken_now[row - first]
        if reception.outcome != IN_FLIGHT:
            taken_now[:] = 0.0
            continue
        luck = take_noise(reception, noise, taken_now)
        outcome, reception.why, reception.overlapped_by = _outcome(row, luck, air, echoes)
        reception.outcome = outcome
        if outcome == LOST:
            reception.why = BURST if noise.bursts.size > 0 else CHANCE
        reception.snr_db += air.shadowing_sd_db * luck
        hearers += outcome == HEARD
    line.heard_by += hearers
    return NONE, hearers


@compiled
def take_noise(reception: Row, noise: PairNoise, into: Floats) -> float:
    """Write the next noise of a reception's pair, slow errors added, to `into` (columns,); return
    the reception's luck, a standard normal.
    """
    auv, asv = reception.auv, reception.asv
    into[:] = noise.blocks[noise.shelf[auv, asv], noise.taken[auv, asv]]
    noise.taken[auv, asv] += 1  # whatever the outcome: scenarios that differ share their noise
    luck = float(into[NOISE_WIDTH])
    slow = noise.slow[auv, asv]
    advance(slow, reception.arrived_at_s)
    blend(into, slow)
    if slow.size > 0:
        reception.slow_range = sqrt(slow[RANGE].share) * slow[RANGE].value
    if noise.bursts.size > 0:
        luck = burst_luck(noise.bursts[auv, asv], reception.arrived_at_s, reception.loss)
    return luck


@compiled
def _outcome(row: int, luck: float, air: Air, echoes: Rows | None) -> tuple[int, int, int]:
    """Return the outcome of a reception (a row), whose loss `luck` decides, a standard normal; and,
    if it collided, the kind and number of the strongest sound that overlaps it
    (:func:`_overlapping`).
    """
    reception = air.receptions[row]
    others, why, number = _overlapping(row, air, echoes)
    if drowns(reception.sound, others, air.capture):
        return COLLIDED, why, number
    return LOST if chance_of(luck) < reception.loss else HEARD, NONE, NONE


@compiled
def _overlapping(row: int, air: Air, echoes: Rows | None) -> tuple[float, int, int]:
    """Return the summed strength of all sounds that overlap a reception; the kind of the strongest,
    and its number: of a ping, signal or packet, of the ASV that calls, or of the listener's own
    frame.
    """
    pings, sounds, reception = air.pings, air.sounds, air.receptions[row]
    begins, ends, ping = reception.arrived_at_s, reception.ended_at_s, pings[reception.ping]
    why, number, longest = BY_PING, NONE, PASSED * ping.longest_s + air.duration
    most = 0.0
    others, strongest = interference(
        air.receptions, row, row + 1, reception.listener, begins, ends, longest, echoes, None, inf
    )
    if strongest != NONE:
        other = air.receptions[strongest]
        number, most = other.ping, other.sound
        if not overlap(begins, ends, other.arrived_at_s, other.ended_at_s):
            why = BY_ECHO
    if len(sounds):
        listener, longest = air.first_listener + reception.listener, sounds[-1].longest_s
        further, strongest = interference(
            sounds, ping.calls, ping.calls, listener, begins, ends, longest, None, None, inf
        )
        others += further
        if strongest != NONE and sounds[strongest].sound > most:
            why, number = sounds[strongest].kind, sounds[strongest].signal
    return others, why, number


@compiled
def foretold(
    packed: int, row: int, luck: float, pings: int, receptions: int, sounds: int,
    echoes: Rows | None,
) -> int:  # fmt: skip
    """Return the outcome that a reception (a row) will have, whose ping has passed its ASV but is
    not decided yet; other arguments as of :func:`resolve`, `luck` a standard normal.
    """
    air = _on_record(unpacked(packed, Decided), pings, receptions, sounds)
    outcome, _, _ = _outcome(row, luck, air, echoes)
    return outcome


@compiled
def _on_record(by: Decided, pings: int, receptions: int, sounds: int) -> Air:
    """Return all sound on record: so many pings, receptions and other sounds."""
    return Air(
        by.pings[:pings], by.receptions[:receptions], by.sounds[:sounds],
        by.duration, by.first_listener, by.capture, by.shadowing_sd_db,
    )  # fmt: skip


@compiled
def begin_fix(row: Row, ping: Row, only: int) -> None:
    """Begin the row of a fix: its ping, AUV and receptions (`only` one, if not NONE).  What is not
    known yet is NaN or NONE.
    """
    row.ping, row.round, row.auv = ping.ping, ping.round, ping.auv
    row.pinged_at_s = row.valid_at_s = ping.sent_at_s
    row.first, row.end = ping.first, ping.end
    if only != NONE:
        row.first, row.end = only, only + 1
    row.broadcast_at_s, row.broadcast_by = nan, NONE
    row.delivered_at_s = row.latency_s = row.arrives_at_s = nan
    row.frame = NONE
    row.innovation_m = row.correction_m = row.nis = nan
    row.outcome = IN_FLIGHT
