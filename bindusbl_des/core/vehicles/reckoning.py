"""What makes dead reckoning wrong: noise, a velocity bias, a scale factor and a wrong heading; and
what is expected of it by who has learnt how wrong it is, and why.

A compass that is off by psi and a log that tells (1 + s) times a velocity make of a way p from the
start the way (1 + s) R(psi) p, whatever the path; so what they add to the error is a function of
the place alone.  Through the water it is the way through the water.

A velocity bias that wanders is held for equal steps.  What it has done by an instant is
o + H b, with H the integral of the frame's rotation up to then, b the bias that is held, and o what
makes that continuous: at each step's end o grows by H (b - b'), b' being the bias that follows.
"""

from math import expm1, inf
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined
from ..records.rows import Row, Rows


class DeadReckoned(NamedTuple):
    """What a vehicle's own sensors have told it by an instant (s): its dead reckoning (m), and the
    integrals of the cosine and sine of its heading from the start of the mission (s).
    """

    time: float
    x: float
    y: float
    cosine: float
    sine: float


class ExpectedDrift(NamedTuple):
    """What is expected: the instant (s), the integrals of the heading (s) and dead reckoning (m)
    that it is about; error (m), velocity bias and current (m/s), stretch and turn, and the bias
    that wanders (m/s) with its time constant (s), as in :mod:`..navigation.belief`.
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
    """What has summed up since then: time (s), the integrals of R (s), the share of a wandering
    bias left meanwhile, and the way that dead reckoning tells of, less its biases (m).
    """

    passed: float
    ahead: float
    aside: float
    left: float
    x: float
    y: float


@inlined
def way_since(drift: ExpectedDrift, dr: DeadReckoned, in_body: bool) -> ReckonedPath:
    """Return what has summed up since then; `in_body` if biases turn with the body."""
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
    """Return the error (m) of dead reckoning that is expected after some way."""
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
    """Return what is expected to be added to the error, by a row of
    :data:`..records.rows.LEARNT`.
    """
    return ExpectedDrift(
        learnt.at_s, learnt.cosine_s, learnt.sine_s, learnt.x_m, learnt.y_m, 0.0, 0.0,
        learnt.bias[0], learnt.bias[1], learnt.current[0], learnt.current[1],
        learnt.stretch, learnt.turn, learnt.roaming[0], learnt.roaming[1], learnt.time_constant_s,
    )  # fmt: skip


@inlined
def learn(learnt: Row, drift: ExpectedDrift) -> None:
    """Write what is expected to a row of :data:`..records.rows.LEARNT`."""
    learnt.at_s, learnt.cosine_s, learnt.sine_s = drift.at, drift.cosine, drift.sine
    learnt.x_m, learnt.y_m, learnt.time_constant_s = drift.x, drift.y, drift.time_constant
    learnt.bias[0], learnt.bias[1] = drift.bias_ahead, drift.bias_aside
    learnt.current[0], learnt.current[1] = drift.current_x, drift.current_y
    learnt.stretch, learnt.turn = drift.stretch, drift.turn
    learnt.roaming[0], learnt.roaming[1] = drift.roaming_ahead, drift.roaming_aside


# What a vehicle's log and compass make of a way: they add `along` of it, and `across` of it turned
# by a quarter to starboard; they stretch it by a factor and turn it (rad, and its cosine and sine).
# It begins at a place (m) that is known when the vehicles are.
SKEW = np.dtype(
    [
        (name, "f8")
        for name in ("along", "across", "factor", "turned", "cosine", "sine", "begin_x", "begin_y")
    ]
)


class Wrong(NamedTuple):
    """How wrong the dead reckoning of n vehicles is.

    `walks` (n, samples, 2) m along x and y at the instants k / `rate` (Hz), straight in between.
    `biases` (n, k, 2) m/s of velocity, ahead and to starboard if `in_body`, else along x and y,
    each held for `held_s` (s); `offsets` (n, k, 2), m, as above, as far as the way is known.
    `skews` (n,), SKEW.
    """

    walks: Annotated[Floats, 3]
    rate: float
    biases: Annotated[Floats, 3]
    offsets: Annotated[Floats, 3]
    held_s: float
    in_body: bool
    skews: Annotated[Rows, SKEW]

    def of(self, whose: slice) -> "Wrong":
        """Return that of some vehicles, in the same arrays."""
        arrays = {
            name: getattr(self, name)[whose] for name in ("walks", "biases", "offsets", "skews")
        }
        return self._replace(**arrays)


def steady(walks: Floats, rate: float, bias: ArrayLike, in_body: bool) -> Wrong:
    """Return how wrong dead reckoning is whose bias, (2,) or (n, 2), m/s, never changes."""
    skews = skews_of(np.zeros(len(walks)), np.zeros(len(walks)))
    biases = np.empty((len(walks), 1, 2))
    biases[:, 0] = bias
    return Wrong(walks, rate, biases, np.zeros(biases.shape), inf, in_body, skews)


def skews_of(scales: Floats, turned: Floats) -> Rows:
    """Return the skews of scale factors less one (n,) and headings' errors (n,), rad."""
    skews = np.zeros(len(scales), dtype=SKEW)
    skews["factor"], skews["turned"] = 1.0 + scales, turned
    skews["cosine"], skews["sine"] = np.cos(turned), np.sin(turned)
    skews["along"] = skews["factor"] * skews["cosine"] - 1.0
    skews["across"] = skews["factor"] * skews["sine"]
    return skews


@inlined
def skewed(x: float, y: float, wrong: Wrong, vehicle: int) -> tuple[float, float]:
    """Return what a vehicle's log and compass add to a way (m) or velocity (m/s)."""
    skew = wrong.skews[vehicle]
    return skew.along * x - skew.across * y, skew.across * x + skew.along * y


@inlined
def by_compass(ahead: float, aside: float, wrong: Wrong, vehicle: int) -> tuple[float, float]:
    """Return integrals of the cosine and sine of the heading (s) by the compass."""
    skew = wrong.skews[vehicle]
    return skew.cosine * ahead - skew.sine * aside, skew.sine * ahead + skew.cosine * aside


@inlined
def error(
    time: float, heading: tuple[float, float], way: tuple[float, float], wrong: Wrong, vehicle: int
) -> tuple[float, float]:
    """Return how far (m) along x and y a vehicle believes to be from where it is, without fixes.

    `heading` are the integrals of its cosine and sine (s) by its compass, `way` is the true one
    from the start (m).
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
    added_x, added_y = skewed(way[0], way[1], wrong, vehicle)
    return x + added_x, y + added_y


@compiled
def follow(wrong: Wrong, vehicle: int, step: int, ahead: float, aside: float) -> None:
    """Note the offset of the bias that is held from the beginning of a step (1 or later) on.

    `ahead` and `aside` are the integrals of the heading by then (s), by compass.
    """
    if not wrong.in_body:
        ahead, aside = step * wrong.held_s, 0.0
    was, now = wrong.biases[vehicle, step - 1], wrong.biases[vehicle, step]
    forward, starboard = was[0] - now[0], was[1] - now[1]
    before, then = wrong.offsets[vehicle, step - 1], wrong.offsets[vehicle, step]
    then[0] = before[0] + ahead * forward - aside * starboard
    then[1] = before[1] + aside * forward + ahead * starboard
