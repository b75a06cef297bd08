"""Errors of dead reckoning (noise, velocity bias, scale factor, heading), and how they are
expected.

A compass that is off by psi and a log that measures (1 + s) times the velocity turn a displacement
p from the start into (1 + s) R(psi) p, whatever the path, so that their error is a function of
position alone.  With a log through the water, p is the displacement through the water.

A velocity bias that wanders is constant within equal steps.  Its error at an instant is o + H b: H
is the integral of the frame's rotation up to then, b the present bias, and o makes the error
continuous.  At the end of each step o grows by H (b - b'), where b' is the next bias.
"""

from math import expm1, inf
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined
from ..records.rows import Row, Rows
from .bottom import UNKNOWN, Bottom, below
from .currents import CONTROL_S, STILL, Field, beyond


class DeadReckoned(NamedTuple):
    """Dead reckoning at an instant (s): position (m), integrals of cosine and sine of yaw (s)."""

    time: float
    x: float
    y: float
    cosine: float
    sine: float


class ExpectedDrift(NamedTuple):
    """The drift that a navigator expects from an instant on, as in :mod:`..navigation.belief`.

    The instant `at` (s), with the integrals of heading (s) and dead reckoning (m) then; error (m),
    velocity bias and current (m/s), scale (`stretch`, 1) and heading error (`turn`, rad), and the
    wandering part of the bias (m/s) with its time constant (s).
    """

    at: float
    cosine: float
    sine: float
    x: float
    y: float
    error_x: float
    error_y: float
    bias_ahead: float
    bias_aside: float
    current_x: float
    current_y: float
    stretch: float
    turn: float
    roaming_ahead: float
    roaming_aside: float
    time_constant: float


class ReckonedPath(NamedTuple):
    """Changes since the instant of an expected drift.

    Time (s), integrals of the frame's rotation R (s), mean share left of a wandering bias, and the
    displacement (m) by dead reckoning less its biases.
    """

    passed: float
    ahead: float
    aside: float
    left: float
    x: float
    y: float


@inlined
def way_since(drift: ExpectedDrift, dr: DeadReckoned, in_body: bool) -> ReckonedPath:
    """Return the changes since the instant of a drift; `in_body` if biases rotate with the body."""
    passed = dr.time - drift.at
    ahead = dr.cosine - drift.cosine if in_body else passed
    aside = dr.sine - drift.sine if in_body else 0.0
    share, left = passed / drift.time_constant, 1.0
    if share > 0.0:
        left = -expm1(-share) / share
    forward = drift.bias_ahead + left * drift.roaming_ahead
    starboard = drift.bias_aside + left * drift.roaming_aside
    x = dr.x - drift.x - (ahead * forward - aside * starboard)
    y = dr.y - drift.y - (aside * forward + ahead * starboard)
    return ReckonedPath(passed, ahead, aside, left, x, y)


@inlined
def expected_error(drift: ExpectedDrift, way: ReckonedPath) -> tuple[float, float]:
    """Return the expected error (m), along x and y, of dead reckoning after these changes."""
    ahead, aside = way.ahead, way.aside
    forward = drift.bias_ahead + way.left * drift.roaming_ahead
    starboard = drift.bias_aside + way.left * drift.roaming_aside
    x = ahead * forward - aside * starboard - way.passed * drift.current_x
    y = aside * forward + ahead * starboard - way.passed * drift.current_y
    x += way.x * drift.stretch - way.y * drift.turn
    y += way.y * drift.stretch + way.x * drift.turn
    return drift.error_x + x, drift.error_y + y


@inlined
def learnt_drift(learnt: Row) -> ExpectedDrift:
    """Return the drift in a row of :data:`..records.rows.LEARNT`, with no error at its instant."""
    return ExpectedDrift(
        learnt.at_s, learnt.cosine_s, learnt.sine_s, learnt.x_m, learnt.y_m, 0.0, 0.0,
        learnt.bias[0], learnt.bias[1], learnt.current[0], learnt.current[1],
        learnt.stretch, learnt.turn, learnt.roaming[0], learnt.roaming[1], learnt.time_constant_s,
    )  # fmt: skip


@inlined
def learn(learnt: Row, drift: ExpectedDrift) -> None:
    """Write an expected drift to a row of :data:`..records.rows.LEARNT`."""
    learnt.at_s, learnt.cosine_s, learnt.sine_s = drift.at, drift.cosine, drift.sine
    learnt.x_m, learnt.y_m, learnt.time_constant_s = drift.x, drift.y, drift.time_constant
    learnt.bias[0], learnt.bias[1] = drift.bias_ahead, drift.bias_aside
    learnt.current[0], learnt.current[1] = drift.current_x, drift.current_y
    learnt.stretch, learnt.turn = drift.stretch, drift.turn
    learnt.roaming[0], learnt.roaming[1] = drift.roaming_ahead, drift.roaming_aside


# The error of a vehicle's log and compass over a displacement: it adds the share `along` of it, and
# `across` of it rotated a quarter turn to starboard; as a scale factor and a rotation (rad, with
# cosine and sine).  Displacements begin at a position (m) that is set when the vehicles exist.
SKEW = np.dtype(
    [
        (name, "f8")
        for name in ("along", "across", "factor", "turned", "cosine", "sine", "begin_x", "begin_y")
    ]
)


class Wrong(NamedTuple):
    """The errors of dead reckoning of n vehicles.

    `walks` (n, samples, 2): random walk (m) along x and y at instants k / `rate` (Hz), linear
    between. `biases` (n, k, 2): velocity bias (m/s), ahead and to starboard if `in_body`, else
    along x and y, each constant for `held_s` (s).  `offsets` (n, k, 2), m: the o above, as far as
    the path is known. `skews` (n,): SKEW. `swept` (n, k, 2), m: how far the current that is no part
    of the walks has carried the water where the vehicle was, while its log missed it, at control
    intervals, as far as the path is known; k is 1 where there is none (:class:`Missed`).
    """

    walks: Annotated[Floats, 3]
    rate: float
    biases: Annotated[Floats, 3]
    offsets: Annotated[Floats, 3]
    held_s: float
    in_body: bool
    skews: Annotated[Rows, SKEW]
    swept: Annotated[Floats, 3]

    def of(self, whose: slice) -> "Wrong":
        """Return the errors of some vehicles, as views of the same arrays."""
        arrays = {
            name: getattr(self, name)[whose]
            for name in ("walks", "biases", "offsets", "skews", "swept")
        }
        return self._replace(**arrays)


def steady(walks: Floats, rate: float, bias: ArrayLike, in_body: bool) -> Wrong:
    """Return errors with a constant velocity bias, (2,) or (n, 2), m/s."""
    skews = skews_of(np.zeros(len(walks)), np.zeros(len(walks)))
    biases = np.empty((len(walks), 1, 2))
    biases[:, 0], swept = bias, np.zeros((len(walks), 1, 2))
    return Wrong(walks, rate, biases, np.zeros(biases.shape), inf, in_body, skews, swept)


def skews_of(scales: Floats, turned: Floats) -> Rows:
    """Return SKEW rows (n,) of scale factors less one (n,) and heading errors (n,), rad."""
    skews = np.zeros(len(scales), dtype=SKEW)
    skews["factor"], skews["turned"] = 1.0 + scales, turned
    skews["cosine"], skews["sine"] = np.cos(turned), np.sin(turned)
    skews["along"] = skews["factor"] * skews["cosine"] - 1.0
    skews["across"] = skews["factor"] * skews["sine"]
    return skews


@inlined
def skewed(x: float, y: float, wrong: Wrong, vehicle: int) -> tuple[float, float]:
    """Return the error that a log and compass add to a displacement (m) or velocity (m/s)."""
    skew = wrong.skews[vehicle]
    return skew.along * x - skew.across * y, skew.across * x + skew.along * y


@inlined
def by_compass(ahead: float, aside: float, wrong: Wrong, vehicle: int) -> tuple[float, float]:
    """Return the integrals of cosine and sine of the heading (s) as the compass measures them."""
    skew = wrong.skews[vehicle]
    return skew.cosine * ahead - skew.sine * aside, skew.sine * ahead + skew.cosine * aside


@inlined
def error(
    time: float, heading: tuple[float, float], way: tuple[float, float], wrong: Wrong, vehicle: int
) -> tuple[float, float]:
    """Return the error (m) of a vehicle's dead reckoning, along x and y, without fixes.

    `heading` holds the integrals of cosine and sine of the heading (s) by compass; `way` is the
    true displacement (m) from the start; `time` is the instant (s).
    """
    walks, biases, held = wrong.walks, wrong.biases, 0  # no views: they are counted, and cost time
    whole = min(int(time * wrong.rate), walks.shape[1] - 2)
    share = time * wrong.rate - whole
    x, y = walks[vehicle, whole, 0], walks[vehicle, whole, 1]
    x += share * (walks[vehicle, whole + 1, 0] - x)
    y += share * (walks[vehicle, whole + 1, 1] - y)
    if biases.shape[1] > 1:
        held = min(int(time / wrong.held_s), biases.shape[1] - 1)
        x += wrong.offsets[vehicle, held, 0]
        y += wrong.offsets[vehicle, held, 1]
    ahead, aside = heading if wrong.in_body else (time, 0.0)
    forward, starboard = biases[vehicle, held, 0], biases[vehicle, held, 1]
    x += ahead * forward - aside * starboard
    y += aside * forward + ahead * starboard
    if wrong.swept.shape[1] > 1:
        swept_x, swept_y = _swept(time, wrong.swept, vehicle)
        way = way[0] - swept_x, way[1] - swept_y
        x, y = x - swept_x, y - swept_y
    added_x, added_y = skewed(way[0], way[1], wrong, vehicle)
    return x + added_x, y + added_y


@inlined
def _swept(time: float, swept: Floats, vehicle: int) -> tuple[float, float]:
    """Return how far (m) the field has carried the water by an instant (s)."""
    held = min(int(time / CONTROL_S), swept.shape[1] - 2)
    share, x, y = time / CONTROL_S - held, swept[vehicle, held, 0], swept[vehicle, held, 1]
    x += share * (swept[vehicle, held + 1, 0] - x)
    y += share * (swept[vehicle, held + 1, 1] - y)
    return x, y


class Missed(NamedTuple):
    """What velocity logs miss: the current, unless they see the bottom.

    The `field` of the current; its uniform part (k, 2), m/s, in each control interval, without rows
    where the walks have it; the `bottom`, and up to which height (m) above it logs see it: none for
    those that always measure through the water.
    """

    field: Field
    uniform: Annotated[Floats, 2]
    bottom: Bottom
    sees_m: float


# Of logs that measure over ground, or without a current
NOTHING = Missed(STILL, np.zeros((0, 2)), UNKNOWN, inf)


@inlined
def sees(bottom: Bottom, range_m: float, x: float, y: float, z: float) -> bool:
    """Return whether a log at a position (m) sees the bottom, up to a height (m) above it."""
    return below(bottom, x, y) - z <= range_m


@compiled
def missed_at(missed: Missed, interval: int, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the velocity (m/s) that a log at a position (m) misses in a control interval."""
    if sees(missed.bottom, missed.sees_m, x, y, z):
        return 0.0, 0.0
    north, east = beyond(missed.field, interval * CONTROL_S, x, y, z)
    if missed.uniform.shape[0] > 0:
        last = min(interval, missed.uniform.shape[0] - 1)
        north += missed.uniform[last, 0]
        east += missed.uniform[last, 1]
    return north, east


@inlined
def sweep(swept: Floats, vehicle: int, interval: int, north: float, east: float) -> None:
    """Note the velocity (m/s) of the field in a control interval."""
    then = interval + 1
    swept[vehicle, then, 0] = swept[vehicle, interval, 0] + CONTROL_S * north
    swept[vehicle, then, 1] = swept[vehicle, interval, 1] + CONTROL_S * east


@compiled
def follow(wrong: Wrong, vehicle: int, step: int, ahead: float, aside: float) -> None:
    """Write the offset of the bias that begins with a step (1 or later).

    `ahead` and `aside` are the integrals of the heading (s) up to then, by compass.
    """
    if not wrong.in_body:
        ahead, aside = step * wrong.held_s, 0.0
    was, now = wrong.biases[vehicle, step - 1], wrong.biases[vehicle, step]
    forward, starboard = was[0] - now[0], was[1] - now[1]
    before, then = wrong.offsets[vehicle, step - 1], wrong.offsets[vehicle, step]
    then[0] = before[0] + ahead * forward - aside * starboard
    then[1] = before[1] + aside * forward + ahead * starboard
