"""Sounds where vehicles may hear them: any vehicle sends, any vehicle listens.

A signal spreads from where its sender is as it begins (:func:`emit`): a sound for each vehicle that
it reaches.  When it is there follows from where the listener is by then, the light-time equation;
that is solved once somebody asks and it is known (:func:`expect`).  Sounds stay on record in the
order in which their signals were sent, so that what else arrives meanwhile stands beside them
(:func:`interference`): one search for all kinds of signals and listeners.

Vehicles are numbered AUVs first, then ASVs.
"""

from dataclasses import dataclass
from math import inf, isnan, nan
from typing import Annotated, NamedTuple

import numpy as np

from ..core.arrays import Floats
from ..core.compiled import compiled
from ..core.packed import unpacked
from ..records.rows import NONE, Row, Rows, row_type
from ..vehicles.motion import Motion, Place, where
from .propagation import TOUCH, meet
from .travel_time import PASSED, distance, travel_time_by, travel_time_to

# How strong a sound is that drowns all others: a vehicle hears nothing while it sends.
DEAFENING = inf


@dataclass(slots=True)
class Sound:
    """A signal where a vehicle may hear it; `signal` is its number among those of its kind.

    It lasts `lasts_s` and comes `late_s` later than straight on, `travel_s` after it was sent; NaN
    until that is known.  It is as strong as the `sound` of :data:`.propagation.PROSPECT`.  No sound
    so far is over later than `longest_s` after it was sent.
    """

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


SOUND = row_type(Sound)


class Sea(NamedTuple):
    """What sounds spread in, handed over once: all on record, with room for more, how AUVs and ASVs
    move, and the sound speed (m/s).
    """

    sounds: Annotated[Rows, SOUND]
    auvs: Motion
    asvs: Motion
    sound_speed: float


@compiled
def place_of(vehicle: int, time: float, sea: Sea) -> Place:
    """Return where (m) a vehicle is at an instant (s)."""
    auvs = sea.auvs.first.size - 1
    if vehicle < auvs:
        return where(sea.auvs, vehicle, time)
    return where(sea.asvs, vehicle - auvs, time)


@compiled
def emit(
    sea: Sea, row: int, signal: int, sender: int, time: float, lasts: float, strengths: Floats,
    lates: Floats,
) -> int:  # fmt: skip
    """Let a vehicle send a signal at an instant (s), for so long (s): write a sound from `row` on
    for each vehicle that it reaches: whose number among `strengths` (vehicles,) is not NaN; it
    comes to that so much later (s) than straight on.  Return the row after the last.
    """
    longest, here = sea.sounds[row - 1].longest_s if row else 0.0, place_of(sender, time, sea)
    for listener in range(len(strengths)):
        if not isnan(strengths[listener]):
            line, late = sea.sounds[row], lates[listener]
            line.signal, line.sender, line.listener = signal, sender, listener
            line.sent_at_s, line.lasts_s, line.late_s = time, lasts, late
            line.travel_s = line.arrived_at_s = line.ended_at_s = nan
            line.sound = strengths[listener]
            way = PASSED * distance(here, place_of(listener, time, sea)) / sea.sound_speed
            longest = max(longest, way + max(late, 0.0) + lasts)
            line.longest_s = longest
            row += 1
    return row


@compiled
def expect(listener: int, since: float, known: float, count: int, sea: Sea) -> None:
    """Write when sounds are at a listener, of the first `count` those that may not be over by an
    instant (s), as far as its motion is known: up to another one, infinite if to the end.
    """
    for row in range(count - 1, -1, -1):
        sound = sea.sounds[row]
        if sound.sent_at_s + sea.sounds[count - 1].longest_s < since - TOUCH:
            break
        if sound.listener == listener and isnan(sound.travel_s):
            _solve(sound, known, sea)


@compiled
def _solve(sound: Row, known: float, sea: Sea) -> None:
    """Write when a sound is at its listener, by the light-time equation."""
    auvs, listener, motion = sea.auvs.first.size - 1, sound.listener, sea.auvs
    if listener >= auvs:
        listener, motion = listener - auvs, sea.asvs
    sent_at, travel = sound.sent_at_s + sound.late_s, inf
    here = place_of(sound.sender, sound.sent_at_s, sea)
    if known == inf:
        travel = travel_time_to(here, motion, listener, sent_at, sea.sound_speed)
    elif max(sound.sent_at_s, sent_at) <= known:
        travel = travel_time_by(here, motion, listener, sent_at, sea.sound_speed, known)
    if travel < inf:
        sound.travel_s = travel + sound.late_s
        sound.arrived_at_s = sound.sent_at_s + sound.travel_s
        sound.ended_at_s = sound.arrived_at_s + sound.lasts_s


@compiled
def interference(
    sounds: Rows, before: int, after: int, listener: int, begins: float, ends: float,
    longest: float, echoes: Rows | None,
) -> tuple[float, int]:  # fmt: skip
    """Return how strong sounds are together that a listener has between two instants (s), and the
    row of the strongest, of equally strong ones the last that was sent before; NONE if none is.

    Rows `before` a number and from another on, `after`, are sought: what stands between is not
    asked.  None is over later than `longest` (s) after it was sent.  Their `echoes`, row by row, as
    of :data:`.sonar_channel.ECHO`, sound too, where there are any.  `sounds` are those of a
    :class:`Sea`, or rows that have the same columns.
    """
    total, most, strongest = 0.0, 0.0, NONE
    for row in range(before - 1, -1, -1):
        if sounds[row].sent_at_s + longest < begins:
            break
        strength = _meanwhile(row, sounds, listener, begins, ends, echoes)
        total += strength
        if strength > most:
            most, strongest = strength, row
    for row in range(after, len(sounds)):
        if sounds[row].sent_at_s > ends:
            break
        strength = _meanwhile(row, sounds, listener, begins, ends, echoes)
        total += strength
        if strength > most:
            most, strongest = strength, row
    return total, strongest


@compiled
def _meanwhile(
    row: int, sounds: Rows, listener: int, begins: float, ends: float, echoes: Rows | None
) -> float:
    """Return how strong a sound and its echoes are at a listener between two instants (s)."""
    sound, strength = sounds[row], 0.0
    if sound.listener == listener:
        if meet(begins, ends, sound.arrived_at_s, sound.ended_at_s):
            strength = sound.sound
        if echoes is not None:
            echo = echoes[row]
            for way in range(len(echo.later_s)):
                later = echo.later_s[way]
                if meet(begins, ends, sound.arrived_at_s + later, sound.ended_at_s + later):
                    strength += echo.sound[way]
    return strength


@compiled
def heard_meanwhile(
    packed: int, count: int, listener: int, since: float, time: float, known: float
) -> Floats:
    """Return when (s) sounds began at a listener, (n,) in order, that it has had anything of
    between two instants (s), the later of which is now; its motion is `known` up to an instant (s).

    `packed` is the address of a :class:`Sea` with so many sounds.  One that begins as another ends
    counts; of a signal that begins at this very instant nobody knows.
    """
    sea = unpacked(packed, Sea)
    expect(listener, since, known, count, sea)
    begun, size = np.empty(count), 0
    for row in range(count - 1, -1, -1):
        sound = sea.sounds[row]
        if sound.sent_at_s + sea.sounds[count - 1].longest_s < since - TOUCH:
            break
        if sound.listener == listener and sound.sent_at_s < time - TOUCH:  # noqa: SIM102
            if sound.arrived_at_s <= time + TOUCH and sound.ended_at_s > since + TOUCH:
                begun[size] = sound.arrived_at_s
                size += 1
    return np.sort(begun[:size])


@compiled
def send(
    packed: int, row: int, signal: int, sender: int, time: float, lasts: float, strengths: Floats,
    lates: Floats,
) -> int:  # fmt: skip
    """:func:`emit` for Python; `packed` is the address of a :class:`Sea`."""
    return emit(unpacked(packed, Sea), row, signal, sender, time, lasts, strengths, lates)
