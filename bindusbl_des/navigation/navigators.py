"""AUVs' own idea of where they are: dead reckoning, corrected by the fixes that they receive.

A navigator serves the whole fleet, and never sees the true position: it is given fixes as they are
delivered, and what the AUVs' own sensors tell.  Those that ship differ in one thing, the gain by
which a fix changes what is believed of dead reckoning (:mod:`.belief`): a fixed share of the
position (eq. update), the share that the covariances say (Kalman), or none.
"""

from math import hypot, nan
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled
from ..core.growing import lengthened
from ..records.columns import (
    AUV_OF_FIX,
    CORRECTION,
    COVARIANCE,
    DELIVERED_AT,
    INNOVATION,
    NIS,
    POSITION,
    SD,
    VALID_AT,
)
from ..vehicles.motion import Floats, Ints
from .belief import (
    BELIEF_COLUMNS,
    REFUSED,
    SPREAD,
    STATE,
    STATES,
    Growth,
    carry,
    covariances,
    positions,
    weigh,
)
from .dead_reckoning import DeadReckoning, Odometry, reckoned

Array = NDArray[np.float64]

# A gain that is worked out anew for each fix from the covariances.
WEIGHED = -1.0

# After so many refused in a row it is the belief that is wrong, and the next fix is taken in.
MOST_REFUSED = 5.0

# An AUV is sure in a direction when det P is below this share of the square of tr P.
SURE = 1e-12

# Fixes that a late one may be earlier than, and still be put in its place.
REMEMBERED = 16


class Navigator(Protocol):
    """What the AUVs make of the fixes that reach them."""

    def correct(self, fixes: Floats, due: Ints) -> None:
        """Take in the fixes whose rows are due, in this order, which is that of their delivery."""

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
    """What each of n AUVs remembers: its latest belief (n, BELIEF_COLUMNS), and of its last `known`
    fixes the rows, `past` (n, REMEMBERED), in the order in which they are taken in, and what it
    believed before each of them (n, REMEMBERED, BELIEF_COLUMNS).
    """

    latest: Floats
    before: Floats
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
        first: Array,
        corrections: Array,
        learnt: Array,
    ) -> None:
        """Take dead reckoning, how to correct it, and what is believed at first.

        `first` (BELIEF_COLUMNS,) as of :func:`.belief.first_belief`.  For autopilots are written
        what to add to dead reckoning, `corrections` (n, 2), m, and as of when, and which bias and
        current go on carrying it off, `learnt` (n, 7): AT, COS, SIN and the rest of the state.
        """
        count = len(corrections)
        self._reckoning, self._rule, self._growth = reckoning, rule, growth
        self._corrections, self._learnt = corrections, learnt
        self._held = Beliefs(np.tile(first, (count, 1)))
        self._memory = Memory(
            np.tile(first, (count, 1)),
            np.empty((count, REMEMBERED, BELIEF_COLUMNS)),
            np.zeros((count, REMEMBERED), dtype=np.int64),
            np.zeros(count, dtype=np.int64),
        )

    def correct(self, fixes: Floats, due: Ints) -> None:
        """Take in the fixes whose rows are due; note innovation, its weight, and the change (m)."""
        held, everything = self._held, (*self._rule, *self._growth, *self._memory)
        _correct(
            fixes, due, held.room_for(len(due)), held.count, self._corrections, self._learnt,
            *everything, *self._reckoning.known,
        )  # fmt: skip
        self._held.count += len(due)

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        """Return where an AUV believed to be (n, 2), m, at the instants of its odometry."""
        return positions(*self._held.of(auv), *odometry, self._growth.in_body)

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        """Return how sure it was of that: variances and covariance xx, yy, xy (n, 3), m2."""
        times, _, headings = odometry
        return covariances(times, headings, *self._growth, *self._held.of(auv))


# A belief that was held: by which AUV, from which instant (s) on, and what was believed.
HOLDER, SINCE, BELIEF = 0, 1, 2


class Beliefs:
    """All beliefs that the AUVs of a fleet have held, in the order in which they came about."""

    def __init__(self, first: Array) -> None:
        """Take the first beliefs (n, BELIEF_COLUMNS), held from the start on."""
        self.count = self._fleet = len(first)
        self._sorted = 0
        self._rows = np.zeros((2 * self.count, BELIEF + BELIEF_COLUMNS))
        self._rows[: self.count, HOLDER] = np.arange(self.count)
        self._rows[: self.count, BELIEF:] = first

    def room_for(self, count: int) -> Floats:
        """Return the rows, with room for further ones after the first `self.count`."""
        if self.count + count > len(self._rows):
            length = max(2 * len(self._rows), self.count + count)
            self._rows = lengthened(self._rows[: self.count], length)
        return self._rows

    def of(self, auv: int) -> tuple[Array, Array]:
        """Return since when (k,), s, an AUV has believed what (k, BELIEF_COLUMNS)."""
        if self._sorted != self.count:  # not a search of all for each AUV
            holders = self._rows[: self.count, HOLDER]
            self._order = np.argsort(holders, kind="stable")
            self._ends = np.searchsorted(holders[self._order], np.arange(self._fleet + 1))
            self._sorted = self.count
        own = self._rows[self._order[self._ends[auv] : self._ends[auv + 1]]]
        return own[:, SINCE].copy(), own[:, BELIEF:].copy()


@compiled
def _correct(
    fixes: Floats, due: Ints, held: Floats, count: int, corrections: Floats, learnt: Floats,
    gain: float, at_ping: bool, gate: float, walk: float, wander: float, in_body: bool,
    latest: Floats, before: Floats, past: Ints, known: Ints, table: Floats, first: Ints,
    step: float, walks: Floats, rate: float, biases: Floats, biases_in_body: bool,
) -> None:  # fmt: skip
    """Take in the fixes `due`; write what is believed then to `held`, from row `count` on."""
    own = np.empty(BELIEF_COLUMNS)
    for number in range(due.size):
        row = due[number]
        auv, now = int(fixes[row, AUV_OF_FIX]), fixes[row, DELIVERED_AT]
        _, _, here_cosine, here_sine = reckoned(
            auv, now, table, first, step, walks, rate, biases, biases_in_body
        )
        own[:] = latest[auv]
        carry(own, now, here_cosine, here_sine, walk, wander, in_body)
        was_x, was_y = own[STATE], own[STATE + 1]
        place, end = _place(fixes, row, past[auv], known[auv], gain == WEIGHED, before[auv])
        if place < end - 1:
            latest[auv] = before[auv, place]
        known[auv] = end
        fixes[row, INNOVATION] = fixes[row, NIS] = nan
        taken = False
        for k in range(place, end):
            before[auv, k] = latest[auv]
            fix = fixes[past[auv, k]]
            time = fix[VALID_AT] if at_ping else now
            x, y, cosine, sine = reckoned(
                auv, time, table, first, step, walks, rate, biases, biases_in_body
            )
            carry(latest[auv], time, cosine, sine, walk, wander, in_body)
            off, weight, is_taken = _take(latest[auv], fix, x, y, gain, gate)
            if past[auv, k] == row:
                fix[INNOVATION], fix[NIS], taken = off, weight, is_taken
        own[:] = latest[auv]
        carry(own, now, here_cosine, here_sine, walk, wander, in_body)
        moved = hypot(own[STATE] - was_x, own[STATE + 1] - was_y)
        fixes[row, CORRECTION] = moved if taken else nan
        corrections[auv] = -latest[auv, STATE : STATE + 2]
        learnt[auv, :3], learnt[auv, 3:] = latest[auv, :STATE], latest[auv, STATE + 2 : REFUSED]
        held[count + number, HOLDER], held[count + number, SINCE] = auv, now
        held[count + number, BELIEF:] = latest[auv]


@compiled
def _place(
    fixes: Floats, row: int, past: Ints, known: int, by_ping: bool, before: Floats
) -> tuple[int, int]:
    """Put a fix in its place among those of an AUV; return that, and how many there are then.

    That is the last one, or `by_ping` where its ping belongs; a fix older than all remembered comes
    too late for any place.
    """
    was_full = known == REMEMBERED
    if was_full:
        known -= 1
        past[:known], before[:known] = past[1:].copy(), before[1:].copy()
    place = known
    while by_ping and place > 0 and fixes[past[place - 1], VALID_AT] > fixes[row, VALID_AT]:
        place -= 1
    if was_full and place == 0:
        return known, known
    past[place + 1 : known + 1] = past[place:known].copy()
    past[place] = row
    return place, known + 1


@compiled
def _take(
    belief: Floats, fix: Floats, x: float, y: float, gain: float, gate: float
) -> tuple[float, float, bool]:
    """Correct a belief by a fix, in its place, when dead reckoning is at `x`, `y` (m).

    Return the length of the innovation (m), its normalised square (NaN where nothing is unsure),
    and whether the gate let it pass.
    """
    spread = belief[SPREAD:].reshape(STATES, STATES)
    noise = fix[SD] ** 2, fix[SD + 1] ** 2, fix[COVARIANCE]
    ahead = fix[POSITION] - (x - belief[STATE])
    aside = fix[POSITION + 1] - (y - belief[STATE + 1])
    xx, yy, xy = spread[0, 0] + noise[0], spread[1, 1] + noise[1], spread[0, 1] + noise[2]
    determinant = xx * yy - xy * xy
    weight = nan
    if determinant > SURE * (xx + yy) ** 2:
        weight = (yy * ahead * ahead - 2.0 * xy * ahead * aside + xx * aside * aside) / determinant
    if gate > 0.0 and weight > gate and belief[REFUSED] < MOST_REFUSED:
        belief[REFUSED] += 1.0
        return hypot(ahead, aside), weight, False
    belief[REFUSED] = 0.0
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
