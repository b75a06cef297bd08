"""Beliefs between fixes: the estimated error of dead reckoning, its causes, and their covariance.

The error e of dead reckoning grows with the velocity bias b and the current c that it does not see:

    de/dt = R(yaw) b - c + noise          (b in the body; R is 1 for a bias in the survey frame)

so that a belief about (e, b, c) at one instant is one about any later instant: the effect of b is
the integral of R, which the AUV's heading gives exactly, so no filter has to be stepped between
fixes.  The estimated position is dead reckoning minus the estimated error.

Further states exist where a scenario asks for them; their number is known at run time only:

* a scale k and a rotation l of the path.  With a scale factor s and a heading error psi dead
  reckoning measures a displacement p as d = (1 + s) R(psi) p, so that its error is k d + l J d,
  where J is a quarter turn, k = 1 - cos(psi) / (1 + s) and l = sin(psi) / (1 + s).  In these it is
  linear;
* a velocity bias that wanders, a first-order Gauss-Markov process beside the constant b;
* last, errors that several fixes have in common; they affect fixes, and nothing else.

In the functions below, `spread` is a covariance of all states (k, k); where it is of several AUVs,
the states of one begin `at` an index.

Source of the equations of a Gauss-Markov process: R. G. Brown, P. Y. C. Hwang, Introduction to
Random Signals and Applied Kalman Filtering, 4th ed., 2012, sec. 4.2.
"""

from collections.abc import Sequence
from math import cos, exp, expm1, floor, inf, sin
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined, written_out
from ..records.rows import Rows
from ..vehicles.reckoning import (
    DeadReckoned,
    ExpectedDrift,
    ReckonedPath,
    expected_error,
    way_since,
)
from .dead_reckoning import Reckoned, reckoned

# States that every belief has: the error (m), velocity bias (m/s) and current (m/s), two each.
STATES = 6

# The instant (s) of a belief, the integrals of cosine and sine of the heading (s) and dead
# reckoning (m) up to it; the number of fixes that the gate has refused in a row.
MOMENT = np.dtype(
    [(name, "f8") for name in ("at_s", "cosine_s", "sine_s", "x_m", "y_m")] + [("refused", "i8")]
)

NO_NUMBERS = np.zeros(0)


class Belief(NamedTuple):
    """A belief: its instant (1,), MOMENT, its k states (k,) and their covariance (k, k)."""

    moment: Annotated[Rows, MOMENT]
    state: Floats
    covariance: Annotated[Floats, 2]


class Beliefs(NamedTuple):
    """Many beliefs: their instants (n,), MOMENT, states (n, k) and covariances (n, k, k)."""

    moments: Annotated[Rows, MOMENT]
    states: Annotated[Floats, 2]
    covariances: Annotated[Floats, 3]


class Growth(NamedTuple):
    """How the covariance of beliefs grows: variances per second of the error (m2/s) and of the
    current (m2/s3), and whether biases rotate with the body.

    Indices, 0 if there are no such states: `stretched` of the scale and rotation of the path,
    `wandering` of the two states of a wandering bias, `aligned` of the misalignment (rad) of the
    AUV's own array, which rotates all its fixes, `misaligned` of the first ASV's array, each of
    which rotates its own measurements.  Each state after the first six has a standard deviation and
    a time constant (s); it is a stationary Gauss-Markov process, constant if that is infinite.  A
    belief is carried by at most a `step` (s) at a time.
    """

    walk: float
    wander: float
    in_body: bool
    stretched: int = 0
    wandering: int = 0
    sds: Floats = NO_NUMBERS
    time_constants: Floats = NO_NUMBERS
    step: float = inf
    aligned: int = 0
    misaligned: int = 0


class Growths(NamedTuple):
    """How the covariances of n AUVs' beliefs grow, as of :class:`Growth`: what differs between
    them, (n,) or (n, k) of k states after the first six, and what does not.
    """

    walks: Floats
    wander: float
    in_body: bool
    stretched: int
    wandering: int
    sds: Annotated[Floats, 2]
    time_constants: Annotated[Floats, 2]
    steps: Floats
    aligned: int
    misaligned: int


@inlined
def growth_of(all_of: Growths, auv: int) -> Growth:
    """Return the growth of one AUV's belief."""
    return Growth(
        all_of.walks[auv], all_of.wander, all_of.in_body, all_of.stretched, all_of.wandering,
        all_of.sds[auv], all_of.time_constants[auv], all_of.steps[auv],
        all_of.aligned, all_of.misaligned,
    )  # fmt: skip


def first_belief(
    start_sd: float, bias_sd: tuple[float, float], current_sd: float, further: Sequence[float] = ()
) -> Belief:
    """Return the belief at the start: no error, with the covariance of the sensors.

    `start_sd` m of position, `bias_sd` m/s along both axes, `current_sd` m/s; then the standard
    deviations of `further` states, independent of each other.
    """
    sd = np.array([start_sd, start_sd, *bias_sd, current_sd, current_sd, *further])
    return Belief(np.zeros(1, dtype=MOMENT), np.zeros(sd.size), np.diag(sd**2))


def begun_at(first: Belief, place: tuple[float, float]) -> Belief:
    """Return a first belief, moved to dead reckoning that begins at `place`, x and y (m)."""
    moment = first.moment.copy()
    moment["x_m"], moment["y_m"] = place
    return first._replace(moment=moment)


def copies(belief: Belief, count: int) -> Beliefs:
    """Return so many copies of a belief."""
    moment, state, covariance = belief
    return Beliefs(
        np.tile(moment, count), np.tile(state, (count, 1)), np.tile(covariance, (count, 1, 1))
    )


@written_out
def one(many: Beliefs, k: int) -> Belief:
    """Return one belief of many, a view."""
    return Belief(many.moments[k : k + 1], many.states[k], many.covariances[k])


@compiled
def write(belief: Belief, place: Belief) -> None:
    """Copy a belief into another, `place`, of as many states."""
    place.moment[0] = belief.moment[0]
    for i in range(belief.state.size):
        place.state[i] = belief.state[i]
        for j in range(belief.state.size):
            place.covariance[i, j] = belief.covariance[i, j]


@inlined
def expected(belief: Belief, growth: Growth) -> ExpectedDrift:
    """Return the drift of dead reckoning that a belief expects."""
    moment, state = belief.moment[0], belief.state
    stretch = turn = ahead = aside = 0.0
    lasts = inf
    if growth.stretched > 0:
        stretch, turn = state[growth.stretched], state[growth.stretched + 1]
    if growth.wandering > 0:
        ahead, aside = state[growth.wandering], state[growth.wandering + 1]
        lasts = growth.time_constants[growth.wandering - STATES]
    return ExpectedDrift(
        moment.at_s, moment.cosine_s, moment.sine_s, moment.x_m, moment.y_m, state[0], state[1],
        state[2], state[3], state[4], state[5], stretch, turn, ahead, aside, lasts,
    )  # fmt: skip


@compiled
def carry(belief: Belief, dr: DeadReckoned, growth: Growth, at: int = 0) -> ReckonedPath:
    """Carry a belief, in place, to another instant; carried back, its covariance does not shrink.

    Its states begin `at` an index of the covariance, which may be of several AUVs.  Return the path
    in between.
    """
    drift = expected(belief, growth)
    way = way_since(drift, dr, growth.in_body)
    moment, state = belief.moment[0], belief.state
    state[0], state[1] = expected_error(drift, way)
    moment.at_s, moment.cosine_s, moment.sine_s = dr.time, dr.cosine, dr.sine
    moment.x_m, moment.y_m = dr.x, dr.y
    for j in range(growth.time_constants.size):
        state[STATES + j] *= kept(way.passed, growth.time_constants[j])
    move(belief.covariance, way, growth, at)
    grow(belief.covariance, way, growth, at)
    return way


@inlined
def kept(passed: float, lasts: float) -> float:
    """Return the share left of a Gauss-Markov process of time constant `lasts` (s) after a time
    (s).
    """
    return 1.0 if lasts == inf else exp(-max(passed, 0.0) / lasts)


@compiled
def move(spread: Floats, way: ReckonedPath, growth: Growth, at: int = 0) -> None:
    """Replace a covariance P, of several AUVs maybe, by F P F^T, where F moves the AUV whose states
    begin `at` an index.
    """
    passed, ahead, aside = way.passed, way.ahead, way.aside
    for k in range(len(spread)):  # F P ...
        spread[at, k], spread[at + 1, k] = _carried(spread, k, way, at)
    for k in range(len(spread)):  # ... F^T
        forward, starboard = spread[k, at + 2], spread[k, at + 3]
        spread[k, at] += ahead * forward - aside * starboard - passed * spread[k, at + 4]
        spread[k, at + 1] += aside * forward + ahead * starboard - passed * spread[k, at + 5]
    if growth.wandering > 0:
        spread_by(spread, at + growth.wandering, way.left * ahead, way.left * aside, at)
    if growth.stretched > 0:
        spread_by(spread, at + growth.stretched, way.x, way.y, at)
    for j in range(growth.time_constants.size):
        fade(spread, at + STATES + j, kept(passed, growth.time_constants[j]), 0.0)


@compiled
def grow(spread: Floats, way: ReckonedPath, growth: Growth, at: int = 0) -> None:
    """Add the process noise of a path to the states that begin `at` an index."""
    grown = max(way.passed, 0.0)
    for axis in range(at, at + 2):
        wander(spread, axis, axis + 4, grown, growth.walk, growth.wander, -1.0)
    for j in range(growth.time_constants.size):
        left = kept(grown, growth.time_constants[j])
        if left != 1.0:
            spread[at + STATES + j, at + STATES + j] += growth.sds[j] ** 2 * (1.0 - left**2)
    if growth.wandering > 0 and grown > 0.0:
        k, line = growth.wandering, (way.ahead / grown, way.aside / grown)
        lasts, sd = growth.time_constants[k - STATES], growth.sds[k - STATES]
        roam(spread, at + k, line, grown, lasts, sd**2, at)


@inlined
def wander(
    spread: Floats, i: int, k: int, passed: float, walk: float, rate: float, sign: float
) -> None:
    """Add the noise of random walks over a time (s) to a covariance: of a position, state i, and of
    a velocity, state k, which moves it with a `sign`; `walk` and `rate` are variances per second.
    """
    spread[i, i] += walk * passed + rate * passed**3 / 3.0
    spread[i, k] += sign * rate * passed**2 / 2.0
    spread[k, i] += sign * rate * passed**2 / 2.0
    spread[k, k] += rate * passed


@inlined
def _carried(spread: Floats, k: int, way: ReckonedPath, at: int) -> tuple[float, float]:
    """Return the covariances of both errors, states `at` on, with a state k after a path, F P."""
    passed, ahead, aside = way.passed, way.ahead, way.aside
    forward, starboard = spread[at + 2, k], spread[at + 3, k]
    x = ahead * forward - aside * starboard - passed * spread[at + 4, k]
    y = aside * forward + ahead * starboard - passed * spread[at + 5, k]
    return spread[at, k] + x, spread[at + 1, k] + y


@inlined
def error_spread(p: Floats, way: ReckonedPath, growth: Growth) -> tuple[float, float, float]:
    """Return xx, yy, xy (m2) of the error's covariance after a path, as :func:`carry` does with a
    belief (k, k) without scale, rotation and wandering bias.
    """
    passed, ahead, aside = way.passed, way.ahead, way.aside
    x0, _ = _carried(p, 0, way, 0)
    x1, y1 = _carried(p, 1, way, 0)
    x2, y2 = _carried(p, 2, way, 0)
    x3, y3 = _carried(p, 3, way, 0)
    x4, _ = _carried(p, 4, way, 0)
    x5, y5 = _carried(p, 5, way, 0)
    grown = max(passed, 0.0)
    more = growth.walk * grown + growth.wander * grown**3 / 3.0
    xx = x0 + (ahead * x2 - aside * x3 - passed * x4) + more
    yy = y1 + (aside * y2 + ahead * y3 - passed * y5) + more
    return xx, yy, x1 + (aside * x2 + ahead * x3 - passed * x5)


@compiled
def between(belief: Belief, dr: DeadReckoned, before: DeadReckoned, growth: Growth) -> float:
    """Return the variance (m2), along any direction, of the estimated displacement between two
    instants near to each other: by the walk, velocities, scale and rotation.
    """
    passed, spread = dr.time - before.time, belief.covariance
    speed = spread[2, 2] + spread[3, 3] + spread[4, 4] + spread[5, 5]
    if growth.wandering > 0:
        speed += spread[growth.wandering, growth.wandering]
        speed += spread[growth.wandering + 1, growth.wandering + 1]
    out = growth.walk * passed + 0.5 * speed * passed**2
    if growth.stretched > 0:
        way = (dr.x - before.x) ** 2 + (dr.y - before.y) ** 2
        skew = spread[growth.stretched, growth.stretched]
        out += 0.5 * way * (skew + spread[growth.stretched + 1, growth.stretched + 1])
    return float(out)


@compiled
def turn_about(spread: Floats, angle: float, at: int = 0) -> None:
    """Rotate the covariance by the angle (rad) that the estimate moved around the array, since a
    fix's uncertainty ellipse is tied to the line of sight.

    A range is more precise than a direction, so a position is uncertain along a circle about the
    array.  Without the rotation later ranges would shrink the tangential uncertainty, which they do
    not measure: 6 m at 500 m would become 2 m after two pings.  In polar coordinates about the
    array, where the covariance stays constant, this is the same (the effect: see
    :func:`turn_with`).
    """
    c, s = cos(angle), sin(angle)
    for i in range(len(spread)):
        x, y = spread[at, i], spread[at + 1, i]
        spread[at, i], spread[at + 1, i] = c * x - s * y, s * x + c * y
    for i in range(len(spread)):
        x, y = spread[i, at], spread[i, at + 1]
        spread[i, at], spread[i, at + 1] = c * x - s * y, s * x + c * y


@compiled
def turn_with(spread: Floats, k: int, x: float, y: float, at: int = 0) -> None:
    """Update a covariance after its position was corrected by x, y (m): state k, a misalignment,
    has rotated the position by as much as the estimate moved.

    An AUV's own array with a misalignment c rotates all positions that the AUV estimates, about any
    ASV alike; the array of an ASV that alone makes a fix rotates the position about that ASV: no
    such fix measures c by itself.  But the covariance of position and c refers to the position
    before the correction.  Left so, each correction would seem to measure c, and the filter would
    become overconfident of c by its own noise.  Source: A. Barrau, S. Bonnabel, The Invariant
    Extended Kalman Filter as a Stable Observer, IEEE Trans.  Automatic Control 62(4), 2017; the
    effect: G. P. Huang, A. I. Mourikis, S. I. Roumeliotis, Observability-based Rules for Designing
    Consistent EKF SLAM Estimators, Int. J. Robotics Research 29(5), 2010.
    """
    for i in range(len(spread)):
        spread[at, i] -= y * spread[k, i]
        spread[at + 1, i] += x * spread[k, i]
    for i in range(len(spread)):
        spread[i, at] -= y * spread[i, k]
        spread[i, at + 1] += x * spread[i, k]


@inlined
def on_circle(spread: Floats, k: int) -> tuple[float, float, float]:
    """Return xx, yy, xy (m2) of the position's covariance from that of all states.

    The misalignment c of the AUV's own array, state k if not 0, moves the position along a circle,
    which leaves its tangent by r c^2 / 2, where r c is the distance moved.
    """
    xx, yy, xy = spread[0, 0], spread[1, 1], spread[0, 1]
    if k > 0:  # E c^4 / 4 = 3 var(c)^2 / 4
        x, y = spread[0, k], spread[1, k]
        xx, yy, xy = xx + 0.75 * y * y, yy + 0.75 * x * x, xy - 0.75 * x * y
    return xx, yy, xy


@compiled
def spread_by(spread: Floats, k: int, ahead: float, aside: float, at: int = 0) -> None:
    """Update a covariance for states k and k + 1 that, rotated by (`ahead`, `aside`), add to the
    error, which begins `at` an index; they stay the same.
    """
    for i in range(spread.shape[0]):
        spread[at, i] += ahead * spread[k, i] - aside * spread[k + 1, i]
        spread[at + 1, i] += aside * spread[k, i] + ahead * spread[k + 1, i]
    for i in range(spread.shape[0]):
        spread[i, at] += ahead * spread[i, k] - aside * spread[i, k + 1]
        spread[i, at + 1] += aside * spread[i, k] + ahead * spread[i, k + 1]


@compiled
def fade(spread: Floats, k: int, left: float, variance: float) -> None:
    """Shrink state k of a covariance by the factor `left`; add noise that keeps its `variance`."""
    if left == 1.0:
        return
    for i in range(len(spread)):
        spread[k, i] *= left
    for i in range(len(spread)):
        spread[i, k] *= left
    spread[k, k] += variance * (1.0 - left * left)


@compiled
def roam(
    spread: Floats, k: int, line: tuple[float, float], passed: float, lasts: float,
    variance: float, at: int = 0,
) -> None:  # fmt: skip
    """Add the noise of a wandering bias, states k and k + 1 of a stationary `variance` and time
    constant `lasts` (s), over a time (s) to a covariance whose error begins `at` an index.

    `line` are the means of cosine and sine of the heading, which is taken as constant.
    """
    (cosine, sine), share = line, passed / lasts
    gone = -expm1(-share)
    beside = variance * lasts * gone**2
    # the first term of the series where the difference would be lost in rounding
    own = 2.0 * (share - gone) - gone**2 if share > 1e-3 else 2.0 * share**3 / 3.0
    for axis in range(2):
        spread[at + axis, at + axis] += variance * lasts**2 * own * (cosine**2 + sine**2)
        spread[at + axis, k + axis] += beside * cosine
        spread[k + axis, at + axis] += beside * cosine
    spread[at, k + 1] -= beside * sine
    spread[k + 1, at] -= beside * sine
    spread[at + 1, k] += beside * sine
    spread[k, at + 1] += beside * sine


@inlined
def next_stop(belief: Belief, growth: Growth) -> float:
    """Return the first multiple of `growth.step` (s) after the instant of a belief.

    Stops depend on nothing else, so that a belief is the same whenever it is asked for.
    """
    at: float = belief.moment[0].at_s
    number = floor(at / growth.step) + 1.0
    return number * growth.step if number * growth.step > at else (number + 1.0) * growth.step


@compiled
def step_on(belief: Belief, auv: int, time: float, growth: Growth, reckoning: Reckoned) -> float:
    """Carry a belief, in place, to the last stop before a time (s); return the next stop."""
    stop = next_stop(belief, growth)
    while stop < time:
        carry(belief, reckoned(auv, stop, reckoning), growth)
        stop = next_stop(belief, growth)
    return stop
