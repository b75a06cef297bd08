"""The AUVs' dead reckoning, and the random walk of its error.

The errors of each AUV are drawn in `mission.sensor_errors`.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled, inlined
from ...support.packed import Packed, unpacked
from ..vehicles.currents import CONTROL_S
from ..vehicles.fleet import FleetTracksCache, VehicleTrack
from ..vehicles.motion import Motion, headed, places
from ..vehicles.reckoning import (
    NOTHING,
    DeadReckoned,
    Missed,
    Wrong,
    by_compass,
    error,
    follow,
    missed_at,
    sweep,
)


def random_walk(rate: float, sds: Floats, noise: Floats) -> Floats:
    """Return random walks (m) of `sds` (n,), m/sqrt(s), at the samples k / rate; they overwrite
    `noise`.

    `noise` (n, k + 1, 2) are standard normal numbers, but the first row of each walk is where it
    begins (m).  The variance is sd^2 t per axis whatever the path, so walks are drawn in the survey
    frame, and do not depend on anything else.
    """
    _sum_up(noise, sds / math.sqrt(rate))
    return noise


@compiled
def _sum_up(walks: Floats, steps: Floats) -> None:
    for walk in range(walks.shape[0]):
        step = steps[walk]
        x, y = walks[walk, 0, 0], walks[walk, 0, 1]
        for k in range(1, walks.shape[1]):
            x += step * walks[walk, k, 0]
            y += step * walks[walk, k, 1]
            walks[walk, k, 0], walks[walk, k, 1] = x, y


class Reckoned(NamedTuple):
    """A fleet's dead reckoning: its motion, and the errors of its sensors."""

    motion: Motion
    wrong: Wrong


class Odometry(NamedTuple):
    """What an AUV's own sensors have measured by n instants (n,), s.

    `position` (n, 2), m, is its dead reckoning, `headings` (n, 2), s, the integrals of the cosine
    and sine of its compass heading from the start of the mission.
    """

    times: Floats
    position: Floats
    headings: Floats


@inlined
def dr_at(odometry: Odometry, n: int) -> DeadReckoned:
    """Return the dead reckoning at the n-th instant of an odometry."""
    position, headings = odometry.position, odometry.headings
    return DeadReckoned(
        odometry.times[n], position[n, 0], position[n, 1], headings[n, 0], headings[n, 1]
    )


class DeadReckoning:
    """The dead reckoning of a fleet: its motion as measured with the sensors' errors."""

    def __init__(self, motion: Motion, wrong: Wrong, missed: Missed = NOTHING) -> None:
        """Take the true motion of n AUVs, the errors of their dead reckoning, and the current that
        their logs miss beside these.

        Walks hold at the samples of the IMUs, which keep their velocity between them; there are two
        samples or more.
        """
        wrong.skews["begin_x"], wrong.skews["begin_y"] = places(motion, 0.0)[:, :2].T
        self._followed, self._steps, self._held_s = 1, wrong.biases.shape[1], wrong.held_s
        self._swept, self._missed = 1, Packed(missed)
        #: The same for compiled equations.
        self.known = Reckoned(motion, wrong)
        self._packed = Packed(self.known)

    def follow(self, time: float, auvs: Sequence[int] | None = None) -> None:
        """Sum up the effect of wandering biases and of the current's field up to `time` (s), for
        `auvs` whose motion is known by then (None: all).
        """
        count = len(self.known.wrong.biases)
        whose = np.arange(count) if auvs is None else np.array(auvs, dtype=np.int64)
        end = min(int(time / self._held_s) + 1, self._steps)
        if end > self._followed:
            _follow(self._packed.address, self._followed, end, whose)
            self._followed = end
        end = min(int(time / CONTROL_S) + 2, self.known.wrong.swept.shape[1])
        if end > self._swept:
            _sweep(self._packed.address, self._missed.address, self._swept, end, whose)
            self._swept = end

    def at(self, auv: int, time: float) -> tuple[float, float]:
        """Return an AUV's position by dead reckoning alone (m) at an instant (s)."""
        x, y = self.sample(auv, np.array((time,)))[1].position[0]
        return float(x), float(y)

    def sample(self, auv: int, times: Floats) -> tuple[Floats, Odometry]:
        """Return truth x, y, z (m), yaw (rad), (n, 4), and the AUV's odometry at instants (s)."""
        way = FleetTracksCache(self.known.motion, foreseen=False).of(auv, times)
        return way.truth, self.odometry(auv, way)

    def odometry(self, auv: int, way: VehicleTrack) -> Odometry:
        """Return what an AUV's own sensors have measured along its motion."""
        n = len(way.times)
        position, headings = np.empty((n, 2)), np.empty((n, 2))
        _reckoned_all(self._packed.address, auv, way.times, way.lines, position, headings)
        return Odometry(way.times, position, headings)


@inlined
def _reckon(
    auv: int, time: float, place: tuple[float, float], turned: tuple[float, float], wrong: Wrong
) -> DeadReckoned:
    """Return an AUV's dead reckoning at an instant (s), at which it is at a position (m); `turned`
    are the true integrals of the cosine and sine of its heading (s).
    """
    cosine, sine = by_compass(turned[0], turned[1], wrong, auv)
    way = place[0] - wrong.skews[auv].begin_x, place[1] - wrong.skews[auv].begin_y
    ahead, aside = error(time, (cosine, sine), way, wrong, auv)
    return DeadReckoned(time, place[0] + ahead, place[1] + aside, cosine, sine)


@compiled
def reckoned(auv: int, time: float, known: Reckoned) -> DeadReckoned:
    """Return an AUV's dead reckoning at an instant (s)."""
    x, y, _, _, cosine, sine = headed(known.motion, auv, time)
    return _reckon(auv, time, (x, y), (cosine, sine), known.wrong)


@compiled
def _reckoned_all(
    packed: int, auv: int, times: Floats, lines: Floats, position: Floats, headings: Floats
) -> None:
    """Write dead reckoning `position` (n, 2), m, and headings (n, 2), s, at `times` (n,), s, along
    a motion; `lines` as of :class:`VehicleTrack`, `packed` the address of a :class:`Reckoned`.
    """
    wrong = unpacked(packed, Reckoned).wrong
    for k in range(times.size):
        place, turned = (lines[k, 0], lines[k, 1]), (lines[k, 4], lines[k, 5])
        dr = _reckon(auv, times[k], place, turned, wrong)
        position[k, 0], position[k, 1] = dr.x, dr.y
        headings[k, 0], headings[k, 1] = dr.cosine, dr.sine


@compiled
def _follow(packed: int, begin: int, end: int, whose: Ints) -> None:
    """Write the effect of wandering biases of AUVs (k,) in the steps begin..end; `packed` is the
    address of a :class:`Reckoned`.
    """
    motion, wrong = unpacked(packed, Reckoned)
    for auv in whose:
        for k in range(begin, end):
            _, _, _, _, cosine, sine = headed(motion, auv, k * wrong.held_s)
            cosine, sine = by_compass(cosine, sine, wrong, auv)
            follow(wrong, auv, k, cosine, sine)


@compiled
def _sweep(packed: int, packed_missed: int, begin: int, end: int, whose: Ints) -> None:
    """Write how far the current that logs miss carries AUVs (k,), by the control instants
    begin..end; the addresses are those of a :class:`Reckoned` and a :class:`Missed`.
    """
    (motion, wrong), missed = unpacked(packed, Reckoned), unpacked(packed_missed, Missed)
    for auv in whose:
        for k in range(begin - 1, end - 1):
            x, y, z, _, _, _ = headed(motion, auv, k * CONTROL_S)
            north, east = missed_at(missed, k, x, y, z)
            sweep(wrong.swept, auv, k, north, east)
