"""Doppler: how fast the way between two vehicles grows, and which signals that loses.

A signal that is stretched by more than its receiver bears is not decoded, though it is a sound as
any other.  The rate is that of the instant at which the signal begins.
"""

from math import sqrt

import numpy as np

from ..core.arrays import Flags, Ints
from ..core.compiled import compiled
from ..core.packed import unpacked
from ..records.events import DOPPLER, IN_FLIGHT, LOST
from ..vehicles.motion import Place, velocity
from .sounds import Sea, Sounds, place_of

Velocity = tuple[float, float, float]


@compiled
def rate_of(here: Place, moves: Velocity, there: Place, goes: Velocity) -> float:
    """Return how fast (m/s) the way from one place to another grows, of whose vehicles one `moves`,
    the other `goes` (m/s).

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
    """Return the velocity (m/s) of a vehicle at an instant (s); AUVs are numbered before ASVs."""
    auvs = sea.auvs.first.size - 1
    if vehicle < auvs:
        return velocity(sea.auvs, vehicle, time)
    return velocity(sea.asvs, vehicle - auvs, time)


def lose_shifted(sounds: Sounds, first: int, time: float, limit: float | None) -> None:
    """Let those who would decode signals that begin at an instant (s), the sounds from `first` on,
    lose them where the way changes faster than a limit (m/s), if there is one.
    """
    if limit is None:
        return
    rows = sounds.rows[first:]
    senders, listeners = rows["sender"].copy(), rows["listener"].copy()
    shifted = beyond(sounds.sea.address, senders, listeners, time, limit)
    shifted &= rows["outcome"] == IN_FLIGHT
    rows["outcome"][shifted], rows["why"][shifted] = LOST, DOPPLER


@compiled
def beyond(packed: int, senders: Ints, listeners: Ints, time: float, limit: float) -> Flags:
    """Tell which ways from senders to listeners (n,), by their numbers among all vehicles, change
    faster than a limit (m/s) at an instant (s); `packed` is the address of a :class:`.sounds.Sea`.
    """
    sea, found = unpacked(packed, Sea), np.empty(len(senders), np.bool_)
    for k in range(len(senders)):
        here, there = place_of(senders[k], time, sea), place_of(listeners[k], time, sea)
        moves, goes = velocity_of(senders[k], time, sea), velocity_of(listeners[k], time, sea)
        found[k] = abs(rate_of(here, moves, there, goes)) > limit
    return found
