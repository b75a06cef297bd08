"""A fixed-interval smoother for any states: estimates from measurements before and after.

A filter goes forwards through the instants; a second pass goes back, with what later measurements
say about earlier states, so that no covariance is ever inverted: exact or constant states need no
special care.  In every linear case the result is the least-squares solution of all measurements at
once.  Source: G. J. Bierman, Fixed interval smoothing with discrete measurements, International
Journal of Control 18(1), 1973 ("modified Bryson-Frazier").
"""

from math import exp
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled, inlined
from ..vehicles.reckoning import DeadReckoned, way_since
from .belief import STATES, Belief, Growth, carry, expected
from .dead_reckoning import Odometry, dr_at
from .fix_update import joseph, write_seen


class Sights(NamedTuple):
    """m scalar measurements ("sights") of k states, in the order in which they hold.

    Sight i holds at the instant with index `nodes[i]`; `values[i]` is `rows[i]` (k,) times the
    states plus noise with `variances[i]`.
    """

    nodes: Ints
    rows: Floats
    values: Floats
    variances: Floats


class Smoothed(NamedTuple):
    """Estimates at n instants from all sights: states (n, k) and their covariances (n, k, k)."""

    states: Floats
    covariances: Floats


def smooth(first: Belief, odometry: Odometry, sights: Sights, growth: Growth) -> Smoothed:
    """Return the estimates from all sights at the rising instants of an odometry.

    `first` is a belief at or before the first of them.
    """
    return Smoothed(*_smooth(first, odometry, sights, growth))


def filtered(first: Belief, odometry: Odometry, sights: Sights, growth: Growth) -> Belief:
    """Return the belief at the last instant of an odometry, from the sights up to there."""
    last = Belief(first.moment.copy(), first.state.copy(), first.covariance.copy())
    _filter(last, odometry, sights, growth)
    return last


@compiled
def transition(belief: Belief, dr: DeadReckoned, growth: Growth, move: Floats) -> None:
    """Write the Jacobian F (k, k) of :func:`.belief.carry` by the states to `move`."""
    way = way_since(expected(belief, growth), dr, growth.in_body)
    move[:] = 0.0
    for k in range(belief.state.size):
        move[k, k] = 1.0
    _drive(move, 2, way.ahead, way.aside)
    _drive(move, 4, -way.passed, 0.0)
    if growth.wandering > 0:
        _drive(move, growth.wandering, way.left * way.ahead, way.left * way.aside)
    if growth.stretched > 0:
        _drive(move, growth.stretched, way.x, way.y)
    for j in range(growth.time_constants.size):
        move[STATES + j, STATES + j] = exp(-max(way.passed, 0.0) / growth.time_constants[j])


@inlined
def _drive(move: Floats, k: int, ahead: float, aside: float) -> None:
    """Let the states k and k + 1, rotated by (`ahead`, `aside`), add to the error in F (k, k)."""
    move[0, k], move[0, k + 1] = ahead, -aside
    move[1, k], move[1, k + 1] = aside, ahead


@compiled
def absorb(belief: Belief, row: Floats, off: float, variance: float, gain: Floats) -> float:
    """Correct a belief, in place, by a sight with a row (1, k) and the innovation `off`.

    Write its gain (1, k); return the innovation's variance, 0 for a sight of an exact state without
    noise, which is ignored.
    """
    state, spread, total = belief.state, belief.covariance, variance
    write_seen(gain, row, spread.T)
    for i in range(state.size):
        total += row[0, i] * gain[0, i]
    if not total > 0.0:
        gain[:] = 0.0
        return 0.0
    for i in range(state.size):
        gain[0, i] /= total
        state[i] += gain[0, i] * off
    joseph(spread, gain, row, (variance, 0.0, 0.0))
    return total


@compiled
def _seen(belief: Belief, row: Floats, value: float) -> float:
    """Return the innovation of a sight with a row (1, k)."""
    for i in range(row.size):
        value -= row[0, i] * belief.state[i]
    return value


@compiled
def _filter(own: Belief, odometry: Odometry, sights: Sights, growth: Growth) -> None:
    """Correct a belief, in place, by sights, and carry it to the last instant."""
    gain, sight = np.empty((1, own.state.size)), 0
    for n in range(odometry.times.size):
        carry(own, dr_at(odometry, n), growth)
        while sight < sights.nodes.size and sights.nodes[sight] == n:
            row = sights.rows[sight : sight + 1]
            absorb(own, row, _seen(own, row, sights.values[sight]), sights.variances[sight], gain)
            sight += 1


@compiled
def _smooth(
    first: Belief, odometry: Odometry, sights: Sights, growth: Growth
) -> tuple[Floats, Floats]:
    """Return states (n, k) and covariances (n, k, k) at n instants from m sights."""
    count, known, rows = odometry.times.size, first.state.size, sights.rows
    states, spreads = np.empty((count, known)), np.empty((count, known, known))
    moves = np.empty((count, known, known))
    gains, offs, totals = np.empty_like(rows), np.empty(len(rows)), np.empty(len(rows))
    own, sight = Belief(first.moment.copy(), first.state.copy(), first.covariance.copy()), 0
    for n in range(count):
        dr = dr_at(odometry, n)
        transition(own, dr, growth, moves[n])
        carry(own, dr, growth)
        while sight < len(rows) and sights.nodes[sight] == n:
            row, gain = rows[sight : sight + 1], gains[sight : sight + 1]
            offs[sight] = _seen(own, row, sights.values[sight])
            totals[sight] = absorb(own, row, offs[sight], sights.variances[sight], gain)
            sight += 1
        states[n], spreads[n] = own.state, own.covariance
    later, sure = np.zeros(known), np.zeros((known, known))
    for n in range(count - 1, -1, -1):
        _smooth_one(states[n], spreads[n], later, sure)
        while sight > 0 and sights.nodes[sight - 1] == n:
            sight -= 1
            if totals[sight] > 0.0:
                row, gain = rows[sight : sight + 1], gains[sight : sight + 1]
                _before_sight(later, sure, row, gain, offs[sight], totals[sight])
        _go_back(later, sure, moves[n])
    return states, spreads


@compiled
def _smooth_one(state: Floats, spread: Floats, later: Floats, sure: Floats) -> None:
    """Replace a filter's state and covariance by the smoothed ones, by the adjoint state `later`
    (k,) and matrix `sure` (k, k).
    """
    count = state.size
    product = np.zeros((count, count))  # P L
    for i in range(count):
        for j in range(count):
            state[i] -= spread[i, j] * later[j]
            for k in range(count):
                product[i, j] += spread[i, k] * sure[k, j]
    before = spread.copy()
    for i in range(count):
        for j in range(count):
            for k in range(count):
                spread[i, j] -= product[i, k] * before[k, j]


@compiled
def _before_sight(
    later: Floats, sure: Floats, row: Floats, gain: Floats, off: float, total: float
) -> None:
    """Replace the adjoint state (k,) and matrix (k, k) after a sight by those before it.

    The sight has a row and gain (1, k), the innovation `off` and its variance `total`.
    """
    weighed = 0.0
    for i in range(row.size):
        weighed += gain[0, i] * later[i]
    joseph(sure, row, gain, (0.0, 0.0, 0.0))
    for i in range(row.size):
        later[i] -= row[0, i] * (weighed + off / total)
        for j in range(row.size):
            sure[i, j] += row[0, i] * row[0, j] / total


@compiled
def _go_back(later: Floats, sure: Floats, move: Floats) -> None:
    """Replace the adjoint state l (k,) and matrix L (k, k) after a move F by those before it: F' l,
    F' L F.
    """
    count = later.size
    back, product = np.zeros(count), np.zeros((count, count))
    for i in range(count):
        for j in range(count):
            back[i] += move[j, i] * later[j]
            for k in range(count):
                product[i, j] += move[k, i] * sure[k, j]
    later[:] = back
    sure[:] = 0.0
    for i in range(count):
        for j in range(count):
            for k in range(count):
                sure[i, j] += product[i, k] * move[k, j]
