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
from ..records.recorder import Levers
from ..records.rows import Row, Rows
from ..vehicles.expected_drift import Told, expected_error, learn, way_since
from ..vehicles.motion import Floats, Ints, Motion
from ..vehicles.reckoning import Wrong
from .belief import Belief, Growth, begun_at, carry, expected, next_stop, note, one, step_on
from .common_errors import Expected, Said, said_of
from .dead_reckoning import DeadReckoning, Odometry, Reckoned, reckoned
from .held import Beliefs, believed, copies
from .weighing import WEIGHED, take

Array = NDArray[np.float64]

# Fixes of which each errs by itself
NOTHING = Levers(0)

# Fixes that a late one may be earlier than, and still be put in its place.
REMEMBERED = 16

# One of them: its row, and the place of what was believed before it
PAST = np.dtype([("fix", "i8"), ("place", "i8")])


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
    """What each of n AUVs remembers: its latest belief (n,), and its last `known` fixes, `past`
    (n, REMEMBERED), PAST, in the order in which they are taken in, with what it believed before
    each of them (n, REMEMBERED).
    """

    latest: Belief
    before: Belief
    past: Rows
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
        first: Belief,
        corrections: Array,
        learnt: Rows,
    ) -> None:
        """Take dead reckoning, how to correct it, and what is believed at first.

        `first` as of :func:`.belief.first_belief`.  For autopilots are written what to add to
        dead reckoning, `corrections` (n, 2), m, and which bias and current go on carrying it off
        since when, `learnt` (n,), :data:`.rows.LEARNT`.
        """
        count = len(corrections)
        start = copies(first, count)
        if growth.stretched > 0:
            for auv in range(count):
                note(start, auv, begun_at(first, reckoning.at(auv, 0.0)))
        self._held = Beliefs(start)
        past = np.zeros((count, REMEMBERED), dtype=PAST)
        past["place"] = np.arange(REMEMBERED)
        # as compiled equations take them
        self._going_on: tuple[Any, ...] = (*growth, *reckoning.flat)
        self._memory: tuple[Any, ...] = (
            corrections, learnt, *rule, *[part.copy() for part in start],
            *copies(first, count, REMEMBERED),
            past, np.zeros(count, dtype=np.int64), *self._going_on,
        )  # fmt: skip
        #: What each fix contains of the last states: nothing, but for whoever sets it.
        self.common = NOTHING

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Take in the fixes whose rows are due; note innovation, its weight, and the change (m)."""
        self._held.make_room(len(due))
        parts: tuple[Any, ...] = (*self._held.flat, self._held.count, *self._memory)
        common = (self.common.of, self.common.left) if self.common.columns else (None, None)
        _correct(fixes, due, *common, *parts)
        self._held.count += len(due)

    def latest(self, auv: int) -> tuple[Array, Array]:
        """Return the states (k,) that an AUV believes in after its last fix, and their covariance
        (k, k).
        """
        _, _, _, states, covariances = self._held.flat
        last = self._held.of(auv)[-1]
        return states[last], covariances[last]

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        """Return where an AUV believed to be (n, 2), m, at the instants of its odometry."""
        return self._believed(auv, odometry, sure=False)

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        """Return how sure it was of that: variances and covariance xx, yy, xy (n, 3), m2."""
        return self._believed(auv, odometry, sure=True)

    def _believed(self, auv: int, odometry: Odometry, *, sure: bool) -> Array:
        found = np.empty((len(odometry.times), 2 + sure))
        told: tuple[Any, ...] = tuple([np.ascontiguousarray(column) for column in odometry])
        known: tuple[Any, ...] = (self._held.of(auv), *self._held.flat, *self._going_on, found)
        believed(auv, sure, *told, *known)
        return found


@entry
def _correct(
    rows: Rows, due: Ints, common: Floats | None, left: Floats | None, holders: Ints, since: Floats,
    held_moment: Rows, held_state: Floats, held_covariance: Floats, count: int,
    corrections: Floats, learnt: Rows, gain: float, at_ping: bool, gate: float,
    moment: Rows, state: Floats, covariance: Floats,
    past_moment: Rows, past_state: Floats, past_covariance: Floats, past: Rows, known: Ints,
    walk: float, wander: float, in_body: bool, stretched: int, wandering: int, sds: Floats,
    time_constants: Floats, longest: float,
    table: Floats, first: Ints, step: float, walks: Floats, rate: float, biases: Floats,
    offsets: Floats, held_s: float, biases_in_body: bool, skews: Rows,
) -> None:  # fmt: skip
    """Take in the fixes `due`; note what is believed then in the rows of `held` from
    `count` on, and for autopilots.

    Each fix contains of the m last states, errors that fixes have in common, beside the true
    position `common` (n or more, 2, 4 m), as of :class:`.recorder.Levers`; its noise is what is
    `left` of its covariance without them, xx, yy, xy (n or more, 3), m2.  None: there are none.
    """
    rule = Rule(gain, at_ping, gate)
    growth = Growth(walk, wander, in_body, stretched, wandering, sds, time_constants, longest)
    before = Belief(past_moment, past_state, past_covariance)
    memory = Memory(Belief(moment, state, covariance), before, past, known)
    held = Belief(held_moment, held_state, held_covariance)
    wrong = Wrong(walks, rate, biases, offsets, held_s, biases_in_body, skews)
    reckoning = Reckoned(Motion(table, first, step), wrong)
    scratch = Belief(moment[:1].copy(), state[:1].copy(), covariance[:1].copy())
    for number in range(due.size):
        fix = rows[due[number]]
        auv, now = fix.auv, fix.delivered_at_s
        latest, told = one(memory.latest, auv), reckoned(auv, now, reckoning)
        was_x, was_y = _error_at(told, auv, latest, growth, reckoning, scratch)
        taken = _take_in(rows, common, left, due[number], rule, growth, memory, reckoning)
        now_x, now_y = _error_at(told, auv, latest, growth, reckoning, scratch)
        moved = hypot(now_x - was_x, now_y - was_y)
        fix.correction_m = moved if taken else nan
        corrections[auv, 0], corrections[auv, 1] = -latest.state[0], -latest.state[1]
        learn(learnt[auv], expected(latest, growth))
        holders[count + number], since[count + number] = auv, now
        note(held, count + number, latest)


@compiled
def _error_at(
    told: Told, auv: int, belief: Belief, growth: Growth, reckoning: Reckoned, scratch: Belief
) -> tuple[float, float]:
    """Return the error (m) that a belief expects at an instant; `scratch` (1,) is written over."""
    if next_stop(belief, growth) < told.time:
        note(scratch, 0, belief)
        belief = one(scratch, 0)
        step_on(belief, auv, told.time, growth, reckoning)
    drift = expected(belief, growth)
    return expected_error(drift, way_since(drift, told, growth.in_body))


@compiled
def _take_in(
    rows: Rows,
    common: Floats | None,
    left: Floats | None,
    row: int,
    rule: Rule,
    growth: Growth,
    memory: Memory,
    reckoning: Reckoned,
) -> bool:
    """Put a fix in its place among those of its AUV, and weigh anew those that come after it.

    Note its innovation and normalised square; tell whether the gate let it pass.
    """
    auv = rows[row].auv
    latest, past = one(memory.latest, auv), memory.past[auv]
    earlier = memory.before
    before = Belief(earlier.moment[auv], earlier.state[auv], earlier.covariance[auv])
    by_ping = rule.gain == WEIGHED
    begin, end = _place(rows, row, past, memory.known[auv], by_ping)
    if begin < end - 1:
        note(memory.latest, auv, one(before, past[begin].place))
    memory.known[auv] = end
    rows[row].innovation_m = rows[row].nis = nan
    taken = False
    for k in range(begin, end):
        note(before, past[k].place, latest)
        number = past[k].fix
        fix = rows[number]
        time = fix.valid_at_s if rule.at_ping else rows[row].delivered_at_s
        step_on(latest, auv, time, growth, reckoning)
        told = reckoned(auv, time, reckoning)
        carry(latest, told, growth)
        said = _said(fix, number, common, left, latest, told)
        off, weight, is_taken = take(latest, said, told, rule.gain, rule.gate)
        if number == row:
            fix.innovation_m, fix.nis, taken = off, weight, is_taken
    return taken


@compiled
def _said(
    fix: Row, number: int, common: Floats | None, left: Floats | None, belief: Belief, told: Told
) -> Said:
    """Return what a fix says to an AUV that believes in a position already."""
    if common is None:
        noise = fix.sd_x_m**2, fix.sd_y_m**2, fix.cov_xy_m2
        return Said(fix.x_m, fix.y_m, noise, np.empty((2, 0)))
    assert left is not None  # as `common`
    state, spread, count = belief.state, belief.covariance, common.shape[2] // 4
    begin = state.size - count
    variances, together = np.empty(count), np.empty((2, count))
    for k in range(count):
        variances[k] = spread[begin + k, begin + k]
        for axis in range(2):  # of the place, which is less what dead reckoning errs by
            together[axis, k] = -spread[axis, begin + k]
    own = Expected(told.x - state[0], told.y - state[1], state[begin:], variances, together)
    noise = left[number, 0], left[number, 1], left[number, 2]
    return said_of(fix.x_m, fix.y_m, noise, common[number], own)


@compiled
def _place(fixes: Rows, row: int, past: Rows, known: int, by_ping: bool) -> tuple[int, int]:
    """Put a fix in its place among those of an AUV; return that, and how many there are then.

    That is the last one, or `by_ping` where its ping belongs; a fix older than all remembered comes
    too late for any place.
    """
    was_full = known == REMEMBERED
    if was_full:
        known -= 1
        free = past[0].place
        for k in range(known):
            past[k].fix, past[k].place = past[k + 1].fix, past[k + 1].place
        past[known].place = free
    begin = known
    while by_ping and begin > 0 and fixes[past[begin - 1].fix].valid_at_s > fixes[row].valid_at_s:
        begin -= 1
    if was_full and begin == 0:
        return known, known
    for k in range(known, begin, -1):
        past[k].fix = past[k - 1].fix
    past[begin].fix = row
    return begin, known + 1
