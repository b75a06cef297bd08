"""What AUVs have believed, and since when: where they took themselves for at any instant."""

from math import inf
from typing import Any

import numpy as np

from ..core.compiled import compiled, entry
from ..core.growing import lengthened
from ..records.rows import Rows
from ..vehicles.expected_drift import Drift, Told, expected_error, way_since
from ..vehicles.motion import Floats, Ints, Motion
from ..vehicles.reckoning import Wrong
from .belief import Belief, Growth, carry, expected, note, one, step_on
from .dead_reckoning import Odometry, Reckoned


def copies(first: Belief, *counts: int) -> Belief:
    """Return many beliefs, along axes of some lengths, that are all the first."""
    moment, state, covariance = first
    return Belief(
        np.tile(moment, counts),
        np.tile(state, (*counts, 1)),
        np.tile(covariance, (*counts, 1, 1)),
    )


class Beliefs:
    """All beliefs that the AUVs of a fleet have held, in the order in which they came about."""

    def __init__(self, first: Belief) -> None:
        """Take the first beliefs (n,), held from the start on."""
        self.count = self._fleet = len(first.moment)
        self._sorted = 0
        #: By which AUV (n,), since when (n,), s, and what was believed: moments (n,), states (n, k)
        #: and covariances (n, k, k), as compiled equations take them.
        self.flat: tuple[Any, ...] = (np.arange(self.count), np.zeros(self.count), *first)

    def make_room(self, count: int) -> None:
        """Have room in the rows for further ones after the first `self.count`."""
        room = len(self.flat[0])
        if self.count + count > room:
            length = max(2 * room, self.count + count)
            self.flat = tuple(lengthened(column[: self.count], length) for column in self.flat)

    def of(self, auv: int) -> Ints:
        """Return the rows of what an AUV has believed (k,), one after the other."""
        if self._sorted != self.count:  # not a search of all for each AUV
            holders = self.flat[0][: self.count]
            self._order = np.argsort(holders, kind="stable")
            self._ends = np.searchsorted(holders[self._order], np.arange(self._fleet + 1)).tolist()
            self._sorted = self.count
        return self._order[self._ends[auv] : self._ends[auv + 1]]


@compiled
def _blank(beliefs: Belief) -> Belief:
    """Return room for a belief (1,) of as many states."""
    moment, state, covariance = beliefs
    return Belief(moment[:1].copy(), state[:1].copy(), covariance[:1].copy())


@entry
def believed(
    auv: int, sure: bool, times: Floats, position: Floats, headings: Floats, own: Ints,
    holders: Ints, since: Floats, moment: Rows, state: Floats, covariance: Floats,
    walk: float, wander: float, in_body: bool, stretched: int, wandering: int, sds: Floats,
    time_constants: Floats, longest: float,
    table: Floats, first: Ints, step: float, walks: Floats, rate: float, biases: Floats,
    offsets: Floats, held_s: float, biases_in_body: bool, skews: Rows, out: Floats,
) -> None:  # fmt: skip
    """Write the positions (n, 2), m, that an AUV believed in at instants (n,), s, that rise.

    Or how `sure` it was of them: covariances xx, yy, xy (n, 3), m2.  Its `own` beliefs (k,), by
    their rows, are held from the instants `since`, s, on, the first from before all `times`; times,
    position and headings as in :class:`.dead_reckoning.Odometry`.
    """
    growth = Growth(walk, wander, in_body, stretched, wandering, sds, time_constants, longest)
    wrong = Wrong(walks, rate, biases, offsets, held_s, biases_in_body, skews)
    reckoning = Reckoned(Motion(table, first, step), wrong)
    beliefs, told = Belief(moment, state, covariance), Odometry(times, position, headings)
    scratch, ahead, n = _blank(beliefs), _blank(beliefs), 0
    belief = one(scratch, 0)
    for k in range(own.size):
        until = since[own[k + 1]] if k + 1 < own.size else inf
        if n < times.size and times[n] < until:
            note(scratch, 0, one(beliefs, own[k]))
        while n < times.size and times[n] < until:
            stop = step_on(belief, auv, times[n], growth, reckoning)
            end = n
            while end < times.size and times[end] < until and times[end] <= stop:
                end += 1
            if sure:
                _spread(out, told, n, end, scratch, ahead, growth)
            else:
                _places(out, told, n, end, expected(belief, growth), in_body)
            n = end


@compiled
def _places(
    out: Floats, odometry: Odometry, begin: int, end: int, drift: Drift, in_body: bool
) -> None:
    """Write where dead reckoning less the drift expected of it is, of some instants."""
    times, position, headings = odometry.times, odometry.position, odometry.headings
    for n in range(begin, end):
        told = Told(times[n], position[n, 0], position[n, 1], headings[n, 0], headings[n, 1])
        x, y = expected_error(drift, way_since(drift, told, in_body))
        out[n, 0], out[n, 1] = told.x - x, told.y - y


@compiled
def _spread(
    out: Floats, odometry: Odometry, begin: int, end: int, held: Belief, ahead: Belief,
    growth: Growth,
) -> None:  # fmt: skip
    """Write what the covariance of a belief (1,) has become at some instants; `ahead` (1,) is
    written over.
    """
    times, position, headings = odometry.times, odometry.position, odometry.headings
    then = one(ahead, 0)
    spread = then.covariance
    for n in range(begin, end):
        told = Told(times[n], position[n, 0], position[n, 1], headings[n, 0], headings[n, 1])
        note(ahead, 0, one(held, 0))
        carry(then, told, growth)
        out[n, 0], out[n, 1], out[n, 2] = spread[0, 0], spread[1, 1], spread[0, 1]
