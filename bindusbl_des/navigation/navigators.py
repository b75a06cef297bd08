"""AUVs' own idea of where they are: dead reckoning, corrected by the fixes that they receive.

A navigator serves the whole fleet, and never sees the true position: it is given fixes as they are
delivered, and what the AUVs' own sensors tell.  Those that ship differ in one thing, the gain by
which a fix changes what is believed of dead reckoning (:mod:`.belief`): a fixed share of the
position (eq. update), the share that the covariances say (Kalman), or none.
"""

from math import hypot, nan
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled, entry
from ..core.growing import lengthened
from ..records.rows import Row, Rows
from ..vehicles.motion import Floats, Ints, Motion
from .belief import BELIEF, STATES, Growth, carry, covariances, positions, weigh
from .dead_reckoning import DeadReckoning, Odometry, Reckoned, reckoned

Array = NDArray[np.float64]

# A gain that is worked out anew for each fix from the covariances.
WEIGHED = -1.0

# After so many refused in a row it is the belief that is wrong, and the next fix is taken in.
MOST_REFUSED = 5

# An AUV is sure in a direction when det P is below this share of the square of tr P.
SURE = 1e-12

# Fixes that a late one may be earlier than, and still be put in its place.
REMEMBERED = 16


class Navigator(Protocol):
    """What the AUVs make of the fixes that reach them."""

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Take in the fixes (:data:`.rows.FIX`) whose rows are due, in the order of delivery."""

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        """Return where an AUV believed to be (n, 2), m, at the instants of its odometry."""

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        """Return how sure it was of that: variances and covariance xx, yy, xy (n, 3), m2."""


class Rule(NamedTuple):
    """How a fix changes a belief.

    `gain` is the share of the innovation that goes to the position, or WEIGHED; a fix is compared
    with what is believed of the instant at which it holds (`at_ping`), or of its delivery, as the
    paper does.  A fix whose normalised innovation squared exceeds the `gate` is refused; 0: none.
    """

    gain: float
    at_ping: bool
    gate: float


class Memory(NamedTuple):
    """What each of n AUVs remembers: its latest belief (n,), and of its last `known` fixes the
    rows, `past` (n, REMEMBERED), in the order in which they are taken in, and what it believed
    before each of them (n, REMEMBERED).
    """

    latest: Rows
    before: Rows
    past: Ints
    known: Ints


class LinearNavigator:
    """Navigators that believe in a drift of their dead reckoning, and correct it by one rule.

    A fix takes effect when it is delivered, as knowledge about the instant at which it holds.  One
    that arrives after fixes of later instants is put in its place, and those are weighed anew.
    """

    def __init__(
        self,
        reckoning: DeadReckoning,
        rule: Rule,
        growth: Growth,
        first: Rows,
        corrections: Array,
        learnt: Rows,
    ) -> None:
        """Take dead reckoning, how to correct it, and what is believed at first.

        `first` (1,) as of :func:`.belief.first_belief`.  For autopilots are written what to add to
        dead reckoning, `corrections` (n, 2), m, and which bias and current go on carrying it off
        since when, `learnt` (n,), :data:`.rows.LEARNT`.
        """
        count = len(corrections)
        self._reckoning, self._rule, self._growth = reckoning, rule, growth
        self._corrections, self._learnt = corrections, learnt
        self._held = Beliefs(np.repeat(first, count))
        self._memory = Memory(
            np.repeat(first, count),
            np.empty((count, REMEMBERED), dtype=BELIEF),
            np.zeros((count, REMEMBERED), dtype=np.int64),
            np.zeros(count, dtype=np.int64),
        )

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Take in the fixes whose rows are due; note innovation, its weight, and the change (m)."""
        self._held.make_room(len(due))
        parts: tuple[Any, ...] = (*self._rule, *self._growth, *self._memory)
        _correct(
            fixes, due, *self._held.rows, self._held.count, self._corrections, self._learnt,
            *parts, *self._reckoning.flat,
        )  # fmt: skip
        self._held.count += len(due)

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        """Return where an AUV believed to be (n, 2), m, at the instants of its odometry."""
        return positions(*self._held.of(auv), *odometry, self._growth.in_body)

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        """Return how sure it was of that: variances and covariance xx, yy, xy (n, 3), m2."""
        times, headings = np.array(odometry.times), np.array(odometry.headings, order="C")
        return covariances(times, headings, *self._growth, *self._held.of(auv))


class Held(NamedTuple):
    """Beliefs that were held: by which AUV (n,), since when (n,), s, and what was believed (n,)."""

    auvs: Ints
    since: Floats
    beliefs: Rows


class Beliefs:
    """All beliefs that the AUVs of a fleet have held, in the order in which they came about."""

    def __init__(self, first: Rows) -> None:
        """Take the first beliefs (n,), held from the start on."""
        self.count = self._fleet = len(first)
        self._sorted = 0
        self.rows = Held(np.arange(self.count), np.zeros(self.count), first)

    def make_room(self, count: int) -> None:
        """Have room in the rows for further ones after the first `self.count`."""
        if self.count + count > len(self.rows.since):
            length = max(2 * len(self.rows.since), self.count + count)
            self.rows = Held(*(lengthened(column[: self.count], length) for column in self.rows))

    def of(self, auv: int) -> tuple[Array, Rows]:
        """Return since when (k,), s, an AUV has believed what (k,)."""
        if self._sorted != self.count:  # not a search of all for each AUV
            holders = self.rows.auvs[: self.count]
            self._order = np.argsort(holders, kind="stable")
            self._ends = np.searchsorted(holders[self._order], np.arange(self._fleet + 1))
            self._sorted = self.count
        own = self._order[self._ends[auv] : self._ends[auv + 1]]
        return self.rows.since[own], self.rows.beliefs[own]


@entry
def _correct(
    fixes: Rows, due: Ints, holders: Ints, since: Floats, beliefs: Rows, count: int,
    corrections: Floats, learnt: Rows, gain: float, at_ping: bool, gate: float,
    walk: float, wander: float, in_body: bool,
    latest: Rows, before: Rows, past: Ints, known: Ints,
    table: Floats, first: Ints, step: float, walks: Floats, rate: float, biases: Floats,
    biases_in_body: bool,
) -> None:  # fmt: skip
    """Take in the fixes `due`; note what is believed then in the rows of :class:`Held` from `count`
    on, and for autopilots.
    """
    rule, growth = Rule(gain, at_ping, gate), Growth(walk, wander, in_body)
    memory = Memory(latest, before, past, known)
    reckoning = Reckoned(Motion(table, first, step), walks, rate, biases, biases_in_body)
    own = np.empty(1, BELIEF)
    for number in range(due.size):
        fix = fixes[due[number]]
        auv, now = fix.auv, fix.delivered_at_s
        _, _, cosine, sine = reckoned(auv, now, reckoning)
        own[0] = latest[auv]
        carry(own[0], now, cosine, sine, growth)
        was_x, was_y = own[0].state[0], own[0].state[1]
        taken = _take_in(fixes, due[number], rule, growth, memory, reckoning)
        own[0] = latest[auv]
        carry(own[0], now, cosine, sine, growth)
        moved = hypot(own[0].state[0] - was_x, own[0].state[1] - was_y)
        fix.correction_m = moved if taken else nan
        belief = latest[auv]
        corrections[auv, 0], corrections[auv, 1] = -belief.state[0], -belief.state[1]
        told = learnt[auv]
        told.at_s, told.cosine_s, told.sine_s = belief.at_s, belief.cosine_s, belief.sine_s
        for axis in range(2):
            told.bias[axis], told.current[axis] = belief.state[2 + axis], belief.state[4 + axis]
        holders[count + number], since[count + number] = auv, now
        beliefs[count + number] = belief


@compiled
def _take_in(
    fixes: Rows, row: int, rule: Rule, growth: Growth, memory: Memory, reckoning: Reckoned
) -> bool:
    """Put a fix in its place among those of its AUV, and weigh anew those that come after it.

    Note its innovation and normalised square; tell whether the gate let it pass.
    """
    auv = fixes[row].auv
    latest, before, past = memory.latest, memory.before[auv], memory.past[auv]
    by_ping = rule.gain == WEIGHED
    place, end = _place(fixes, row, past, memory.known[auv], by_ping, before)
    if place < end - 1:
        latest[auv] = before[place]
    memory.known[auv] = end
    fixes[row].innovation_m = fixes[row].nis = nan
    taken = False
    for k in range(place, end):
        before[k] = latest[auv]
        fix = fixes[past[k]]
        time = fix.valid_at_s if rule.at_ping else fixes[row].delivered_at_s
        x, y, cosine, sine = reckoned(auv, time, reckoning)
        carry(latest[auv], time, cosine, sine, growth)
        off, weight, is_taken = _take(latest[auv], fix, x, y, rule.gain, rule.gate)
        if past[k] == row:
            fix.innovation_m, fix.nis, taken = off, weight, is_taken
    return taken


@compiled
def _place(
    fixes: Rows, row: int, past: Ints, known: int, by_ping: bool, before: Rows
) -> tuple[int, int]:
    """Put a fix in its place among those of an AUV; return that, and how many there are then.

    That is the last one, or `by_ping` where its ping belongs; a fix older than all remembered comes
    too late for any place.
    """
    was_full = known == REMEMBERED
    if was_full:
        known -= 1
        for k in range(known):
            past[k], before[k] = past[k + 1], before[k + 1]
    place = known
    while by_ping and place > 0 and fixes[past[place - 1]].valid_at_s > fixes[row].valid_at_s:
        place -= 1
    if was_full and place == 0:
        return known, known
    for k in range(known, place, -1):
        past[k] = past[k - 1]
    past[place] = row
    return place, known + 1


@compiled
def _take(
    belief: Row, fix: Row, x: float, y: float, gain: float, gate: float
) -> tuple[float, float, bool]:
    """Correct a belief by a fix, in its place, when dead reckoning is at `x`, `y` (m).

    Return the length of the innovation (m), its normalised square (NaN where nothing is unsure),
    and whether the gate let it pass.
    """
    spread = belief.covariance
    noise = fix.sd_x_m**2, fix.sd_y_m**2, fix.cov_xy_m2
    ahead = fix.x_m - (x - belief.state[0])
    aside = fix.y_m - (y - belief.state[1])
    xx, yy, xy = spread[0, 0] + noise[0], spread[1, 1] + noise[1], spread[0, 1] + noise[2]
    determinant = xx * yy - xy * xy
    weight = nan
    if determinant > SURE * (xx + yy) ** 2:
        weight = (yy * ahead * ahead - 2.0 * xy * ahead * aside + xx * aside * aside) / determinant
    if gate > 0.0 and weight > gate and belief.refused < MOST_REFUSED:
        belief.refused += 1
        return hypot(ahead, aside), weight, False
    belief.refused = 0
    share = np.zeros((STATES, 2))
    if gain != WEIGHED:
        share[0, 0] = share[1, 1] = gain
    elif determinant > SURE * (xx + yy) ** 2:
        for k in range(STATES):
            share[k, 0] = (spread[k, 0] * yy - spread[k, 1] * xy) / determinant
            share[k, 1] = (spread[k, 1] * xx - spread[k, 0] * xy) / determinant
    # a fix ahead of the estimate says that dead reckoning is less far ahead than believed
    weigh(belief, share, -ahead, -aside, noise)
    return hypot(ahead, aside), weight, True
