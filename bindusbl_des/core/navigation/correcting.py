"""Corrections of beliefs by fixes, each at its instant among earlier and later ones, and the memory
of navigators that this needs.
"""

from math import hypot, isnan, nan
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled
from ...support.packed import unpacked
from ..records.events import HEARD
from ..records.rows import FIX, LEARNT, NONE, RECEPTION, Row, Rows, fix_numbered
from ..vehicles.motion import where
from ..vehicles.reckoning import DeadReckoned, expected_error, learn, way_since
from .belief import (
    Belief,
    Beliefs,
    Growth,
    Growths,
    between,
    carry,
    copies,
    expected,
    grow,
    growth_of,
    move,
    next_stop,
    one,
    step_on,
    turn_about,
    turn_with,
    write,
)
from .dead_reckoning import Reckoned, reckoned
from .fix_update import WEIGHED, Expected, Rule, Said, at_place, said_of, take
from .range_rates import Rates, rate_sights, take_rates
from .turning import EXACT, PingBelief, turned

# Number of fixes that an AUV stores: a late fix is inserted among these.
REMEMBERED = 16

# One of them: its row, and the row of the belief before it
PAST = np.dtype([("fix", "i8"), ("before", "i8")])


class Memory(NamedTuple):
    """What each of n AUVs stores: its latest belief, and its last `known` (n,) fixes, `past` (n,
    REMEMBERED), PAST, in the order in which they were applied; `before` has the belief before each.
    """

    latest: Beliefs
    before: Beliefs
    past: Annotated[Rows, PAST, 2]
    known: Ints


def memory_of(first: Belief, start: Beliefs) -> Memory:
    """Return the memory of AUVs that begin with beliefs `start`, of as many states as `first`."""
    count = len(start.moments)
    past = np.zeros((count, REMEMBERED), dtype=PAST)
    past["before"] = np.arange(past.size).reshape(past.shape)
    latest = Beliefs(start.moments.copy(), start.states.copy(), start.covariances.copy())
    return Memory(latest, copies(first, past.size), past, np.zeros(count, dtype=np.int64))


class FilterHistory(NamedTuple):
    """Beliefs in the order in which they arose: AUV (n,), since when (n,), s, and belief."""

    whose: Ints
    since: Floats
    beliefs: Beliefs


class Scratch(NamedTuple):
    """Scratch arrays: two beliefs of k states, `belief` and `ahead`; a gain K^T (2, k), and the
    slopes H (2, k) of a fix; its Jacobian by the last m states, `common` (2, m).  `alone` (2, 4 m +
    2) are zeros: the Jacobians of a GNSS fix.
    """

    belief: Belief
    ahead: Belief
    gain: Annotated[Floats, 2]
    slopes: Annotated[Floats, 2]
    common: Annotated[Floats, 2]
    alone: Annotated[Floats, 2]


def scratch_for(first: Belief, common: int) -> Scratch:
    """Return scratch for beliefs like `first`, whose last `common` states are errors in common."""
    belief, ahead = [
        Belief(first.moment.copy(), first.state.copy(), first.covariance.copy()) for _ in range(2)
    ]
    gain, alone = np.zeros((2, len(first.state))), np.zeros((2, 4 * common + 2))
    return Scratch(belief, ahead, gain, np.eye(*gain.shape), np.zeros((2, common)), alone)


class Known(NamedTuple):
    """What the navigators of n AUVs work with: the rule by which fixes change beliefs, the growth
    of covariances, dead reckoning, the memory, the history of beliefs, scratch, the receptions of
    fixes, and GNSS fixes.  For autopilots, the corrections of dead reckoning, `corrections` (n, 2),
    m, and the bias and current that go on since then, `learnt` (n,), :data:`LEARNT`.
    """

    rule: Rule
    growths: Growths
    reckoning: Reckoned
    memory: Memory
    held: FilterHistory
    scratch: Scratch
    receptions: Annotated[Rows, RECEPTION]
    gnss: Annotated[Rows, FIX]
    corrections: Annotated[Floats, 2]
    learnt: Annotated[Rows, LEARNT]


@compiled
def apply_fixes(
    packed: int, count: int, fixes: Rows, due: Ints, common: Floats | None, left: Floats | None,
    rates: Rates | None,
) -> None:  # fmt: skip
    """Apply the fixes `due`, by their numbers (:func:`fix_numbered`); store the new beliefs in the
    rows from `count` on of the history, and for autopilots.  `packed` is the address of a
    :class:`.correcting.Known`.

    The last m states are errors that fixes have in common.  `common` (n or more, 2, 4 m + 2) are
    the Jacobians of fixes by them, as of :class:`..records.rows.Jacobians`; `left` (n or more, 3),
    m2, is xx, yy, xy of the remaining covariance.  None: there are none.  Range rates with the
    errors `rates` are applied as well, if not None.
    """
    by = unpacked(packed, Known)
    for number in range(due.size):
        fix = fix_numbered(fixes, by.gnss, due[number])
        auv, now = fix.auv, fix.delivered_at_s
        latest, dr = one(by.memory.latest, auv), reckoned(auv, now, by.reckoning)
        was_x, was_y = error_at(dr, auv, latest, packed)
        taken = _insert_fix(fixes, common, left, due[number], packed, rates)
        now_x, now_y = error_at(dr, auv, latest, packed)
        moved = hypot(now_x - was_x, now_y - was_y)
        fix.correction_m = moved if taken else nan
        hold(packed, count + number, auv, now, latest)


@compiled
def hold(packed: int, row: int, auv: int, now: float, belief: Belief) -> None:
    """Store an AUV's belief from `now` (s) on in a row of the history, and for its autopilot."""
    by = unpacked(packed, Known)
    whose, since, beliefs = by.held
    by.corrections[auv, 0], by.corrections[auv, 1] = -belief.state[0], -belief.state[1]
    learn(by.learnt[auv], expected(belief, growth_of(by.growths, auv)))
    whose[row], since[row] = auv, now
    write(belief, one(beliefs, row))


@compiled
def error_at(dr: DeadReckoned, auv: int, belief: Belief, packed: int) -> tuple[float, float]:
    """Return the error (m) that a belief expects of an AUV's dead reckoning `dr`."""
    by = unpacked(packed, Known)
    growth = growth_of(by.growths, auv)
    if next_stop(belief, growth) < dr.time:
        write(belief, by.scratch.belief)
        belief = by.scratch.belief
        step_on(belief, auv, dr.time, growth, by.reckoning)
    drift = expected(belief, growth)
    return expected_error(drift, way_since(drift, dr, growth.in_body))


@compiled
def _insert_fix(
    fixes: Rows, common: Floats | None, left: Floats | None, row: int, packed: int,
    rates: Rates | None,
) -> bool:  # fmt: skip
    """Insert a fix, by its number `row`, among those of its AUV, and apply it and those after it.

    Write its innovation and NIS; return whether the gate let it pass.  Other arguments as of
    :func:`apply_fixes`.
    """
    by = unpacked(packed, Known)
    own, memory = fix_numbered(fixes, by.gnss, row), by.memory
    auv = own.auv
    growth = growth_of(by.growths, auv)
    latest, past = one(memory.latest, auv), memory.past[auv]
    begin, end = _stored(fixes, by.gnss, row, past, memory.known[auv], by.rule.gain == WEIGHED)
    if begin < end - 1:
        write(one(memory.before, past[begin].before), latest)
    memory.known[auv] = end
    own.innovation_m = own.nis = nan
    _note(own, _by_itself(own, left, row), False)
    taken = False
    for k in range(begin, end):
        write(latest, one(memory.before, past[k].before))
        number = past[k].fix
        fix = fix_numbered(fixes, by.gnss, number)
        said, jacobians = _by_itself(fix, left, number), by.scratch.alone
        if common is not None and number >= 0:
            jacobians = common[number]
        time = fix.valid_at_s if by.rule.at_ping else own.delivered_at_s
        step_on(latest, auv, time, growth, by.reckoning)
        dr = reckoned(auv, time, by.reckoning)
        carry(latest, dr, growth)
        if rates is not None and fix.first != NONE:
            since = 0.0
            if k > 0:
                since = fix_numbered(fixes, by.gnss, past[k - 1].fix).valid_at_s
            receptions = by.receptions[fix.first : fix.end]
            take_rates(fix, receptions, since, latest, dr, growth, by.reckoning, rates)
        said = _expanded(fix, said, jacobians, latest, dr, packed)
        off, was = _off(said, dr, latest, by.scratch), (latest.state[0], latest.state[1])
        nis, is_taken = take(latest, off, by.scratch.slopes, said.noise, by.rule, by.scratch.gain)
        if by.rule.gain == WEIGHED:
            now = latest.state[0], latest.state[1]
            _turn(fix, latest.covariance, dr, was, now, packed)
        if number == row:
            fix.innovation_m, fix.nis, taken = hypot(off[0], off[1]), nis, is_taken
    return taken


@compiled
def _off(said: Said, dr: DeadReckoned, belief: Belief, room: Scratch) -> tuple[float, float]:
    """Return the innovation (m) of a fix, as an error of dead reckoning, with the effect of the
    last states; write its slopes H to the scratch.
    """
    state, common, slopes = belief.state, room.common, room.slopes
    begin = state.size - common.shape[1]
    x, y = said.x - (dr.x - state[0]), said.y - (dr.y - state[1])
    for k in range(common.shape[1]):
        x -= common[0, k] * state[begin + k]
        y -= common[1, k] * state[begin + k]
        slopes[0, begin + k], slopes[1, begin + k] = -common[0, k], -common[1, k]
    # a fix ahead of the estimate means a smaller error of dead reckoning along that axis
    return -x, -y


class TeamBelief(NamedTuple):
    """A belief about n AUVs, its `members` (n,), with k states each and m further constant ones: n
    equal instants, n k + m states and their covariance; and the part of the covariance that other
    AUVs may have as well, 0 x 0 where that is not tracked.
    """

    members: Ints
    belief: Belief
    shared: Floats


@compiled
def carry_team(packed: int, team: TeamBelief, time: float, alike: Growth) -> None:
    """Carry a belief about several AUVs, in place, to a later instant (s); `alike` is the growth by
    noise that all have in common.
    """
    by, belief, shared = unpacked(packed, Known), team.belief, team.shared
    spread, size = belief.covariance, by.scratch.belief.state.size
    while belief.moment[0].at_s < time:
        stop = min(next_stop(belief, alike), time)
        noise = np.zeros((size, size))
        for a in range(team.members.size):
            at, dr = a * size, reckoned(team.members[a], stop, by.reckoning)
            growth = growth_of(by.growths, team.members[a])
            own = Belief(belief.moment[a : a + 1], belief.state[at : at + size], spread)
            way = carry(own, dr, growth, at)
            if a == 0:
                grow(noise, way, alike)
            if shared.size > 0:
                move(shared, way, growth, at)
                grow(shared, way, alike, at)
        for a in range(team.members.size):
            for b in range(team.members.size):
                if a != b:
                    at, beside = a * size, b * size
                    spread[at : at + size, beside : beside + size] += noise


@compiled
def apply_team_fix(
    packed: int, fixes: Rows, noise: Floats, jacobians: Floats, team: TeamBelief, a: int
) -> tuple[float, float, bool]:
    """Correct a belief about several AUVs at the instant of a fix (1,) of the a-th of them, in
    place; the fix has a noise xx, yy, xy (3,), m2, and `jacobians` (2, 4 m + 2).

    Return as of :func:`.fix_update.take`, the length of the innovation (m) first.
    """
    by, fix, belief = unpacked(packed, Known), fixes[0], team.belief
    own, size = by.scratch.belief, by.scratch.belief.state.size
    dr = reckoned(fix.auv, fix.valid_at_s, by.reckoning)
    at, end = a * size, (a + 1) * size
    _believe(own, dr, belief.state[at:end], belief.covariance[at:end, at:end])
    alone = Said(fix.x_m, fix.y_m, (noise[0], noise[1], noise[2]))
    said = _expanded(fix, alone, jacobians, own, dr, packed)
    off, was = _off(said, dr, own, by.scratch), (own.state[0], own.state[1])
    slopes = np.zeros((2, belief.state.size))
    slopes[:, at:end] = by.scratch.slopes
    gain = np.empty(slopes.shape)
    nis, taken = take(belief, off, slopes, said.noise, by.rule, gain, a, team.shared)
    now = belief.state[at], belief.state[at + 1]
    _turn(fix, belief.covariance, dr, was, now, packed, at)
    if team.shared.size > 0:
        _turn(fix, team.shared, dr, was, now, packed, at)
    return hypot(off[0], off[1]), nis, taken


@compiled
def turn_at(packed: int, fixes: Rows, belief: Belief, was: Floats, now: Floats) -> None:
    """Rotate a belief at a fix (1,) that has corrected its error (2,), m, from `was` to `now`."""
    by, fix = unpacked(packed, Known), fixes[0]
    dr = reckoned(fix.auv, fix.valid_at_s, by.reckoning)
    _turn(fix, belief.covariance, dr, (was[0], was[1]), (now[0], now[1]), packed)


@compiled
def _turn(
    fix: Row, spread: Floats, dr: DeadReckoned, was: tuple[float, float],
    now: tuple[float, float], packed: int, at: int = 0,
) -> None:  # fmt: skip
    """Rotate the covariance `spread` of all states at the instant of a fix with the position: its
    error (m), states `at` and after, was corrected from `was` to `now`.
    """
    by = unpacked(packed, Known)
    angle, whose = 0.0, by.growths.aligned
    x, y = was[0] - now[0], was[1] - now[1]
    only = _only_hearer(fix, by.receptions)
    if only != NONE:
        reception = by.receptions[only]
        ahead, aside = dr.x - was[0] - reception.from_x_m, dr.y - was[1] - reception.from_y_m
        below = where(by.reckoning.motion, fix.auv, dr.time)[2] - reception.from_z_m
        angle = (ahead * y - aside * x) / (ahead * ahead + aside * aside + below * below + EXACT)
        x, y = x + angle * aside, y - angle * ahead
        if whose == 0 and by.growths.misaligned > 0:
            whose = by.growths.misaligned + reception.asv
    turn_about(spread, angle, at)
    if whose > 0:
        turn_with(spread, at + whose, x, y, at)


@compiled
def _only_hearer(fix: Row, receptions: Rows) -> int:
    """Return the only reception of a fix that was heard; NONE if there are several or none, or its
    measurement is not known.
    """
    only = NONE
    if fix.first != NONE:
        for row in range(fix.first, fix.end):
            if receptions[row].outcome == HEARD:
                if only != NONE:
                    return NONE
                only = row
    return NONE if only != NONE and isnan(receptions[only].from_x_m) else only


@compiled
def _expanded(
    fix: Row, said: Said, jacobians: Floats, belief: Belief, dr: DeadReckoned, packed: int
) -> Said:
    """Return a fix expanded about an AUV's belief of its instant, by its `jacobians`; write it to
    the fix's row, and its Jacobian by the last states to the scratch.
    """
    by, at, polar, unsure = unpacked(packed, Known), (fix.x_m, fix.y_m), False, 0.0
    common, has_common = by.scratch.common, by.scratch.common.shape[1] > 0
    if by.rule.gain == WEIGHED and fix.first != NONE:
        if has_common:
            x, y = dr.x - belief.state[0], dr.y - belief.state[1]
            unsure = at_place(at, jacobians, x, y, belief.covariance, common)
        receptions = by.receptions[fix.first : fix.end]
        believed = _believed(receptions, fix.auv, dr, belief, unsure, packed)
        said, polar = turned(receptions, said, believed)
        if has_common and not polar:
            said = _moved(said, jacobians, believed)
        _note(fix, said, polar)
    if has_common and not polar:
        said = _without(said, at, jacobians, belief, dr, common)
    return said


@compiled
def expand(
    packed: int, fixes: Rows, noise: Floats, jacobians: Floats, states: Floats, spreads: Floats,
    said: Floats, common: Floats,
) -> None:  # fmt: skip
    """Write fixes (n,) expanded about beliefs of their instants, with states (n, k) and covariances
    (n, k, k): `said` (n, 5), position and xx, yy, xy of the noise, and their Jacobians by the m
    last states, `common` (n, 2, m).

    `packed` is the address of a :class:`Known`; unexpanded, fixes have a `noise` xx, yy, xy (n, 3),
    m2, and `jacobians` (n, 2, 4 m + 2) as of :class:`..records.rows.Jacobians`.
    """
    by = unpacked(packed, Known)
    belief = by.scratch.belief
    for k in range(fixes.size):
        fix = fixes[k]
        dr = reckoned(fix.auv, fix.valid_at_s, by.reckoning)
        _believe(belief, dr, states[k], spreads[k])
        alone = Said(fix.x_m, fix.y_m, (noise[k, 0], noise[k, 1], noise[k, 2]))
        expanded = _expanded(fix, alone, jacobians[k], belief, dr, packed)
        said[k, 0], said[k, 1] = expanded.x, expanded.y
        said[k, 2], said[k, 3], said[k, 4] = expanded.noise
        common[k] = by.scratch.common


@compiled
def _believe(belief: Belief, dr: DeadReckoned, state: Floats, spread: Floats) -> None:
    """Write states (k,) and a covariance (k, k) at the instant of `dr` to a belief."""
    moment = belief.moment[0]
    moment.at_s, moment.cosine_s, moment.sine_s = dr.time, dr.cosine, dr.sine
    moment.x_m, moment.y_m = dr.x, dr.y
    belief.state[:], belief.covariance[:] = state, spread


@compiled
def expand_rates(
    packed: int, fixes: Rows, since: Floats, owners: Ints, lines: Ints, states: Floats,
    spreads: Floats, rates: Rates, rows: Floats, values: Floats, variances: Floats,
) -> None:  # fmt: skip
    """Write range rates as sights, each of the fix `owners` (m,) and of the reception `lines` (m,),
    fix by fix, about beliefs of the instants of fixes (n,), with states (n, k) and covariances (n,
    k, k); the fix before each holds at `since` (n,), s: as of :func:`.range_rates.rate_sights`.
    `packed` is the address of a :class:`Known`.
    """
    by, begin = unpacked(packed, Known), 0
    belief = by.scratch.belief
    while begin < owners.size:
        k, end = owners[begin], begin
        while end < owners.size and owners[end] == k:
            end += 1
        fix = fixes[k]
        dr = reckoned(fix.auv, fix.valid_at_s, by.reckoning)
        _believe(belief, dr, states[k], spreads[k])
        rate_sights(
            fix, by.receptions, lines[begin:end], since[k], belief, dr,
            growth_of(by.growths, fix.auv), by.reckoning,
            rates, rows[begin:end], values[begin:end], variances[begin:end],
        )  # fmt: skip
        begin = end


@compiled
def _believed(
    receptions: Rows, auv: int, dr: DeadReckoned, belief: Belief, unsure: float, packed: int
) -> PingBelief:
    """Return the estimated positions of an AUV as it pinged and as it heard the call that it
    answers; `unsure` (m2) as of :func:`.fix_update.at_place`.
    """
    by, spread = unpacked(packed, Known), belief.covariance
    depth = where(by.reckoning.motion, auv, dr.time)[2]  # as its pressure sensor has it
    place = dr.x - belief.state[0], dr.y - belief.state[1], depth
    called, moved = place, 0.0
    for reception in receptions:
        if reception.outcome == HEARD and not isnan(reception.called_before_s):
            before = reckoned(auv, dr.time - reception.called_before_s, by.reckoning)
            growth = growth_of(by.growths, auv)
            drift = expected(belief, growth)
            x, y = expected_error(drift, way_since(drift, before, growth.in_body))
            called = before.x - x, before.y - y, depth
            moved = between(belief, dr, before, growth)
            break
    return PingBelief(place, spread, called, moved, unsure)


@compiled
def _moved(fix: Said, jacobians: Floats, own: PingBelief) -> Said:
    """Return a fix whose noise for the AUV's motion between call and answer is replaced by the
    AUV's own estimate of that motion.  `jacobians` as of :class:`..records.rows.Jacobians`.
    """
    count = jacobians.shape[1] - 2
    x, y = own.called[0] - own.place[0], own.called[1] - own.place[1]
    (a, b), (c, d) = jacobians[0, count:], jacobians[1, count:]
    xx, yy, xy = fix.noise
    xx, yy = xx + own.moved * (a * a + b * b), yy + own.moved * (c * c + d * d)
    xy += own.moved * (a * c + b * d)
    return Said(fix.x - a * x - b * y, fix.y - c * x - d * y, (xx, yy, xy))


@compiled
def _by_itself(fix: Row, left: Floats | None, row: int) -> Said:
    """Return a fix (number `row`) as it is in its table, not expanded about a belief; `left` as of
    :func:`apply_fixes`.
    """
    if left is not None and row >= 0:
        return Said(fix.x_m, fix.y_m, (left[row, 0], left[row, 1], left[row, 2]))
    return Said(fix.x_m, fix.y_m, (fix.sd_x_m**2, fix.sd_y_m**2, fix.cov_xy_m2))


@compiled
def _note(fix: Row, said: Said, polar: bool) -> None:
    """Write a fix as it was expanded to its row; `polar`: as a range and a direction."""
    fix.said_polar = int(polar)
    fix.said_x_m, fix.said_y_m = said.x, said.y
    fix.said_xx_m2, fix.said_yy_m2, fix.said_xy_m2 = said.noise


@compiled
def _without(
    fix: Said,
    at: tuple[float, float],
    jacobians: Floats,
    belief: Belief,
    dr: DeadReckoned,
    common: Floats,
) -> Said:
    """Return a fix `at` a position (m) relative to a belief, without the errors that fixes have in
    common; write its Jacobian by these to `common` (2, m).
    """
    state, spread, count = belief.state, belief.covariance, common.shape[1]
    begin = state.size - count
    variances, together = np.empty(count), np.empty((2, count))
    for k in range(count):
        variances[k] = spread[begin + k, begin + k]
        for axis in range(2):  # of the place, which is less what dead reckoning errs by
            together[axis, k] = -spread[axis, begin + k]
    own = Expected(dr.x - state[0], dr.y - state[1], state[begin:], variances, together)
    return said_of(fix, at, jacobians, own, common)


@compiled
def _stored(
    fixes: Rows, gnss: Rows, row: int, past: Rows, known: int, by_ping: bool
) -> tuple[int, int]:
    """Insert a fix, by its number `row`, among the `known` that an AUV stores, `past`
    (REMEMBERED,), PAST; return its index, and how many there are then.

    That is the last one, or `by_ping` where its ping belongs; a fix older than all stored is too
    late, and left out.
    """
    was_full = known == REMEMBERED
    if was_full:
        known -= 1
        free = past[0].before
        for k in range(known):
            past[k].fix, past[k].before = past[k + 1].fix, past[k + 1].before
        past[known].before = free
    begin, valid_at_s = known, fix_numbered(fixes, gnss, row).valid_at_s
    while by_ping and begin > 0:
        if fix_numbered(fixes, gnss, past[begin - 1].fix).valid_at_s <= valid_at_s:
            break
        begin -= 1
    if was_full and begin == 0:
        return known, known
    for k in range(known, begin, -1):
        past[k].fix = past[k - 1].fix
    past[begin].fix = row
    return begin, known + 1
