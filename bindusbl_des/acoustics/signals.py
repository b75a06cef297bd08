"""Signals that any vehicle sends to all others: where each sounds, and what becomes of it there.

Compiled, as :mod:`.sounds`, on whose sea they are.
"""

from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled
from ..core.packed import unpacked
from ..core.streams import uniform
from ..records.events import BY_PING, CHANCE, COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from ..records.rows import NONE, Rows
from .loss import LossTerms, loss_probability
from .propagation import drowns, within
from .sounds import Sea, emit, interference, place_of, solve
from .travel_time import PASSED, distance


@compiled
def spread_signal(
    packed: int, row: int, kind: int, signal: int, sender: int, time: float, lasts: float,
    deaf: NDArray[np.bool_], slant: bool, reach: float, loss: LossTerms, prospects: Rows,
    keys: NDArray[np.uint64], nth: int,
) -> int:  # fmt: skip
    """Write the sounds of a signal from a row on, at all that are not `deaf` (n,); return the row
    after the last.

    Each is lost by a chance of its pair of vehicles, by its key of `keys` (n,): that of the `nth`
    signal of its sender.  On the disc there are no `prospects`, else (n,).
    """
    sea = unpacked(packed, Sea)
    strengths, lates, here = np.full(deaf.size, nan), np.zeros(deaf.size), place_of(
        sender, time, sea
    )  # fmt: skip
    chances = np.ones(deaf.size)
    for listener in range(deaf.size):
        if deaf[listener]:
            continue
        there = place_of(listener, time, sea)
        if prospects.size:
            prospect = prospects[listener]
            chances[listener] = prospect.loss
            if prospect.loss < 1.0 or prospect.sound > 0.0:
                strengths[listener], lates[listener] = prospect.sound, prospect.late_s
        elif within(here, there, slant, reach):
            strengths[listener] = 1.0
            chances[listener] = loss_probability(distance(here, there), loss)
    end = emit(sea, row, kind, signal, sender, time, lasts, strengths, lates)
    for number in range(row, end):
        sound = sea.sounds[number]
        sound.loss = chances[sound.listener]
        if sound.loss >= 1.0:
            sound.outcome, sound.why = OUT_OF_RANGE, OUT_OF_RANGE
        elif uniform(keys[sound.listener], 0, nth, 0) < sound.loss:
            sound.outcome, sound.why = LOST, CHANCE
        if not sea.long and sound.listener >= sea.auvs.first.size - 1:  # what pings meet at ASVs
            solve(sound, inf, sea)
    return end


@compiled
def solve_row(packed: int, row: int, known: float) -> None:
    """Solve one sound of a sea by its address (:func:`.sounds.solve`)."""
    sea = unpacked(packed, Sea)
    solve(sea.sounds[row], known, sea)


@compiled
def solve_all(packed: int, count: int, known: float) -> None:
    """Solve the first `count` sounds of a sea by its address."""
    sea = unpacked(packed, Sea)
    for row in range(count):
        solve(sea.sounds[row], known, sea)


@compiled
def outcome_of(
    packed: int, row: int, time: float, known: float, count: int, receptions: Rows, pings: Rows,
    ping_s: float, auvs: int, capture: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Return :func:`signal_outcome` of a sound of the first `count` of a sea, by its address."""
    sea = unpacked(packed, Sea)
    solve(sea.sounds[row], known, sea)
    return signal_outcome(
        row, sea.sounds[:count], time, receptions, pings, ping_s, auvs, capture, sea, known
    )


@compiled
def signal_outcome(
    row: int, sounds: Rows, time: float, receptions: Rows, pings: Rows, ping_s: float, auvs: int,
    capture: float, sea: Sea | None, known: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Return what has become of a sound by an instant (s), why and by what; in flight if it is not
    over by then.

    At ASVs pings of `ping_s` (s) sound as well: `receptions`.  `sea` and `known` as of
    :func:`.sounds.interference`.
    """
    sound = sounds[row]
    if sound.outcome == OUT_OF_RANGE:
        return OUT_OF_RANGE, OUT_OF_RANGE, NONE
    if sound.ended_at_s > time:
        return IN_FLIGHT, NONE, NONE
    begins, ends, listener = sound.arrived_at_s, sound.ended_at_s, sound.listener
    others, strongest = interference(
        sounds, row, row + 1, listener, begins, ends, sounds[-1].longest_s, None, sea, known
    )
    why, by, most = NONE, NONE, 0.0
    if strongest != NONE:
        why, by, most = sounds[strongest].kind, sounds[strongest].signal, sounds[strongest].sound
    if listener >= auvs and len(pings):
        longest, met = PASSED * pings[-1].longest_s + ping_s, len(receptions)
        more, strongest = interference(
            receptions, met, met, listener - auvs, begins, ends, longest, None, None, inf
        )
        others += more
        if strongest != NONE and receptions[strongest].sound > most:
            why, by = BY_PING, receptions[strongest].ping
    if drowns(sound.sound, others, capture):
        return COLLIDED, why, by
    return (LOST, sound.why, NONE) if sound.outcome == LOST else (HEARD, NONE, NONE)
