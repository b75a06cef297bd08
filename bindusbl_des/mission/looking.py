"""What can be seen of a mission at an instant: where vehicles are, and what is in the air."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..records.events import HEARD, Broadcast
from ..records.rows import NONE
from ..vehicles.fleet import Fleet
from ..vehicles.motion import places
from .samples import turned
from .world import World

Array = NDArray[np.float64]


class AuvStates(NamedTuple):
    """The AUVs at one instant, a row for each; survey frame, z down.

    `truth` (n, 4): x, y, z (m), yaw (rad, in (-pi, pi]).  `estimate` (n, 2): x and y (m) as the
    AUV's own navigator has them.  `covariance` (n, 2, 2), m2: how sure that is of it.
    """

    truth: Array
    estimate: Array
    covariance: Array


class PingUnderWay(NamedTuple):
    """A ping in the water: its number in the table `pings`, its AUV (row), when it began (s).

    With passive ranging it is the ping of an ASV (row), and of no AUV (None).
    """

    ping: int
    auv: int | None
    sent_at_s: float
    asv: int | None = None


def auv_states(world: World, time: float) -> AuvStates:
    """Return the AUVs at an instant (s); the estimate is of the fixes delivered so far."""
    world.auv_fleet.advance(time)
    count, now = len(world.auv_fleet), np.array([time])
    states = AuvStates(np.empty((count, 4)), np.empty((count, 2)), np.empty((count, 2, 2)))
    for auv in range(count):
        found = world.sample(auv, now)
        states.truth[auv], states.estimate[auv] = found.way.truth[0], found.estimate[0]
        xx, yy, xy = world.navigator.covariance(auv, found.odometry)[0]
        states.covariance[auv] = (xx, xy), (xy, yy)
    states.truth[:, 3] = turned(states.truth[:, 3])
    return states


def places_of(fleet: Fleet, time: float) -> Array:
    """Return x, y, z (m), yaw (rad, in (-pi, pi]) of a fleet at an instant (s), shape (n, 4)."""
    fleet.advance(time)
    found = places(fleet.motion, time)
    found[:, 3] = turned(found[:, 3])
    return found


def under_way(world: World, time: float) -> list[PingUnderWay]:
    """Return the pings that are in the water at an instant (s), of those on record by then."""
    pings = world.record.pings.rows
    # an AUV that was called in vain does not ping
    silent = ~np.isin(pings["call"], (NONE, HEARD))
    sending = ~silent & (pings["sent_at_s"] + world.network.uplink.band.duration > time)
    passing = np.isfinite(pings["passed_at_s"]) & (pings["passed_at_s"] > time)
    found = pings[list(PingUnderWay._fields)][sending | passing].tolist()
    return [
        PingUnderWay(ping, None if auv == NONE else auv, sent_at, None if asv == NONE else asv)
        for ping, auv, sent_at, asv in found
    ]


def on_air(broadcasts: Sequence[Broadcast], time: float) -> list[Broadcast]:
    """Return the frames that are being sent at an instant (s), of those on record by then."""
    return [it for it in broadcasts if time < it.sent_at_s + it.airtime_s]
