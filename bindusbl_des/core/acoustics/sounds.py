"""Sounds where vehicles may hear them: any vehicle sends, any vehicle listens (compiled).

A signal leaves its sender's position as it begins (:func:`emit`), and is one sound for each vehicle
that it reaches.  Its arrival follows from the listener's position by then, by the light-time
equation, which is solved once it is needed and both motions are known (:func:`solve`).  Sounds stay
on record in the order in which their signals were sent, so one search (:func:`interference`) finds
what else arrives meanwhile, for all kinds of signals and listeners.

Doppler: a signal whose range changes faster than its receiver tolerates is not decoded, but sounds
as any other.  The rate is that of the instant at which the signal begins.

Vehicles are numbered AUVs first, then ASVs.
"""

from dataclasses import dataclass
from math import inf, isnan, nan, sqrt
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Flags, Floats, Ints
from ...support.compiled import compiled
from ...support.packed import unpacked
from ..records.events import BLOCKED, IN_FLIGHT
from ..records.rows import NONE, Row, Rows, row_type
from ..vehicles.motion import Motion, Place, velocity, where
from .propagation import TOUCH, overlap
from .travel_time import PASSED, distance, travel_time_by, travel_time_to

# Strength of a vehicle's own sound, which drowns all others: it hears nothing while it sends.
DEAFENING = inf


@dataclass(slots=True)
class Sound:
    """A signal where a vehicle may hear it: its `kind`, the word for it where it overlaps another,
    and its number among signals of that kind.

    It lasts `lasts_s`, arrives `travel_s` after it was sent, and `late_s` later than on a straight
    ray.  Arrival and end are infinite until they are known.  `sound` is its strength, as of
    :data:`.propagation.PROSPECT`.  No sound so far is over later than `longest_s` after it was
    sent.  `outcome`, `why` and `loss` are its outcome if nothing overlaps it (in flight: it will be
    heard), the reason, and its loss probability.
    """

    kind: int
    signal: int
    sender: int
    listener: int
    sent_at_s: float
    lasts_s: float
    late_s: float
    travel_s: float
    arrived_at_s: float
    ended_at_s: float
    sound: float
    longest_s: float
    outcome: int
    why: int
    loss: float


SOUND = row_type(Sound)


class Sea(NamedTuple):
    """What sounds of a band propagate in, packed once: all sounds on record, with free rows, the
    motions of AUVs and ASVs, and the sound speed (m/s).  Where signals are `long`, a signal's end
    leaves its sender's position of that instant.
    """

    sounds: Annotated[Rows, SOUND]
    auvs: Motion
    asvs: Motion
    sound_speed: float
    long: bool


@compiled
def place_of(vehicle: int, time: float, sea: Sea) -> Place:
    """Return the position (m) of a vehicle at an instant (s)."""
    auvs = sea.auvs.first.size - 1
    if vehicle < auvs:
        return where(sea.auvs, vehicle, time)
    return where(sea.asvs, vehicle - auvs, time)


@compiled
def emit(
    sea: Sea, row: int, kind: int, signal: int, sender: int, time: float, lasts: float,
    strengths: Floats, lates: Floats,
) -> int:  # fmt: skip
    """Let vehicle `sender` send a signal, of a `kind` and a number, at an instant (s) for `lasts`
    (s): write a sound, from `row` on, for each vehicle whose number in `strengths` (vehicles,) is
    not NaN; it arrives `lates` (vehicles,), s, later than on a straight ray.  Return the row after
    the last.
    """
    longest, here = sea.sounds[row - 1].longest_s if row else 0.0, place_of(sender, time, sea)
    for listener in range(len(strengths)):
        if not isnan(strengths[listener]):
            line, late = sea.sounds[row], lates[listener]
            line.kind, line.signal, line.sender, line.listener = kind, signal, sender, listener
            line.sent_at_s, line.lasts_s, line.late_s, line.travel_s = time, lasts, late, nan
            line.arrived_at_s = line.ended_at_s = inf
            line.sound = strengths[listener]
            line.outcome, line.why, line.loss = IN_FLIGHT, NONE, nan
            if line.sound > 0.0:
                way = distance(here, place_of(listener, time, sea)) / sea.sound_speed
                longest = max(longest, PASSED * (way + lasts) + max(late, 0.0))
            line.longest_s = longest
            row += 1
    return row


@compiled
def deafen(
    sounds: Rows, row: int, kind: int, signal: int, vehicle: int, time: float, lasts: float
) -> int:
    """Let a vehicle hear nothing from an instant on for `lasts` (s), as it sends a signal itself:
    write that as a sound to a row, and return the next row.
    """
    line, before = sounds[row], sounds[row - 1].longest_s if row else 0.0
    line.kind, line.signal, line.sender, line.listener = kind, signal, vehicle, vehicle
    line.sent_at_s, line.lasts_s, line.late_s, line.travel_s = time, lasts, 0.0, 0.0
    line.arrived_at_s, line.ended_at_s, line.sound = time, time + lasts, DEAFENING
    line.longest_s = max(before, lasts)
    line.outcome, line.why, line.loss = IN_FLIGHT, NONE, nan
    return row + 1


@compiled
def solve(sound: Row, known: float, sea: Sea) -> None:
    """Write when a sound arrives at its listener and ends there, by the light-time equation, as far
    as both motions are known: up to the instant `known` (s), or infinite.
    """
    if isnan(sound.travel_s):
        way = _way(sound, sound.sent_at_s, known, sea)
        if way < inf:
            sound.travel_s = way + sound.late_s
            sound.arrived_at_s = sound.sent_at_s + sound.travel_s
            if not sea.long:
                sound.ended_at_s = sound.arrived_at_s + sound.lasts_s
    if sea.long and sound.ended_at_s == inf and sound.arrived_at_s < inf:
        leaves = sound.sent_at_s + sound.lasts_s
        sound.ended_at_s = leaves + (_way(sound, leaves, known, sea) + sound.late_s)


@compiled
def _way(sound: Row, leaves: float, known: float, sea: Sea) -> float:
    """Return the travel time (s) on a straight ray of sound that leaves the sender at an instant
    (s); infinite if it does not arrive by `known` (s).
    """
    begins, auvs, listener, motion = (
        leaves + sound.late_s, sea.auvs.first.size - 1, sound.listener, sea.auvs
    )  # fmt: skip
    if max(leaves, begins) > known:
        return inf
    here = place_of(sound.sender, leaves, sea)
    if listener >= auvs:
        listener, motion = listener - auvs, sea.asvs
    if known == inf:
        return travel_time_to(here, motion, listener, begins, sea.sound_speed)
    return travel_time_by(here, motion, listener, begins, sea.sound_speed, known)


@compiled
def interference(
    sounds: Rows, before: int, after: int, listener: int, begins: float, ends: float,
    longest: float, echoes: Rows | None, sea: Sea | None, known: float,
) -> tuple[float, int]:  # fmt: skip
    """Return the summed strength of the sounds that arrive at a listener between two instants (s),
    and the row of the strongest, of equals the last of those sent before; NONE if there is none.

    Rows below `before` and from `after` on are searched.  None is over later than `longest` (s)
    after it was sent.  Their `echoes`, one row for each, :data:`.sonar_channel.ECHO`, sound too, if
    not None. `sounds` are those of a `sea`, where motion is known up to `known` (s); or, with `sea`
    None, rows with the same columns that are already solved.
    """
    total, most, strongest = 0.0, 0.0, NONE
    for row in range(before - 1, -1, -1):
        if sounds[row].sent_at_s + longest < begins:
            break
        strength = _meanwhile(row, sounds, listener, begins, ends, echoes, sea, known)
        total += strength
        if strength > most:
            most, strongest = strength, row
    for row in range(after, len(sounds)):
        if sounds[row].sent_at_s > ends:
            break
        strength = _meanwhile(row, sounds, listener, begins, ends, echoes, sea, known)
        total += strength
        if strength > most:
            most, strongest = strength, row
    return total, strongest


@compiled
def _meanwhile(
    row: int, sounds: Rows, listener: int, begins: float, ends: float, echoes: Rows | None,
    sea: Sea | None, known: float,
) -> float:  # fmt: skip
    """Return the strength of a sound (a row) and its echoes at a listener in an interval (s)."""
    sound, strength = sounds[row], 0.0
    if sound.listener == listener:
        if sea is not None:
            solve(sound, known, sea)
        if overlap(begins, ends, sound.arrived_at_s, sound.ended_at_s):
            strength = sound.sound
        if echoes is not None:
            echo = echoes[row]
            for way in range(len(echo.later_s)):
                later = echo.later_s[way]
                if overlap(begins, ends, sound.arrived_at_s + later, sound.ended_at_s + later):
                    strength += echo.sound[way]
    return strength


@compiled
def heard_meanwhile(
    packed: int, count: int, listener: int, since: float, time: float, known: float
) -> Floats:
    """Return the intervals (n, 2), s, of all sounds at a listener between `since` and now, `time`
    (s), in the order in which they begin.

    `packed` is the address of a :class:`Sea` with `count` sounds; `known` as of :func:`solve`.  A
    sound that begins as another ends counts; a signal that begins at this very instant is not known
    yet.
    """
    sea, size = unpacked(packed, Sea), 0
    spans = np.empty((count, 2))
    for row in range(count - 1, -1, -1):
        sound = sea.sounds[row]
        if sound.sent_at_s + sea.sounds[count - 1].longest_s < since - TOUCH:
            break
        if sound.listener == listener and sound.sent_at_s < time - TOUCH and sound.why != BLOCKED:
            solve(sound, known, sea)
            if sound.arrived_at_s <= time + TOUCH and sound.ended_at_s > since + TOUCH:
                spans[size, 0], spans[size, 1] = sound.arrived_at_s, sound.ended_at_s
                size += 1
    return spans[:size][np.argsort(spans[:size, 0], kind="mergesort")]


Velocity = tuple[float, float, float]


@compiled
def rate_of(here: Place, moves: Velocity, there: Place, goes: Velocity) -> float:
    """Return the rate (m/s) at which the range between two positions grows, whose vehicles have the
    velocities `moves` and `goes` (m/s).

    >>> rate_of((0.0, 0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (30.0, 0.0, 40.0, 0.0), (0.0, 0.0, -1.0))
    -1.7
    """
    x, y, z = there[0] - here[0], there[1] - here[1], there[2] - here[2]
    away = sqrt(x * x + y * y + z * z)
    if away == 0.0:
        return 0.0
    u, v, w = goes[0] - moves[0], goes[1] - moves[1], goes[2] - moves[2]
    return (u * x + v * y + w * z) / away


@compiled
def velocity_of(vehicle: int, time: float, sea: Sea) -> Velocity:
    """Return the velocity (m/s) of a vehicle at an instant (s)."""
    auvs = sea.auvs.first.size - 1
    if vehicle < auvs:
        return velocity(sea.auvs, vehicle, time)
    return velocity(sea.asvs, vehicle - auvs, time)


@compiled
def beyond(packed: int, senders: Ints, listeners: Ints, time: float, limit: float) -> Flags:
    """Return for which of the pairs of senders and listeners (n,) the range changes faster than a
    limit (m/s) at an instant (s); `packed` is the address of a :class:`Sea`.
    """
    sea, found = unpacked(packed, Sea), np.empty(len(senders), np.bool_)
    for k in range(len(senders)):
        here, there = place_of(senders[k], time, sea), place_of(listeners[k], time, sea)
        moves, goes = velocity_of(senders[k], time, sea), velocity_of(listeners[k], time, sea)
        found[k] = abs(rate_of(here, moves, there, goes)) > limit
    return found
