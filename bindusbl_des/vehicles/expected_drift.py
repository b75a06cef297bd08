"""What is expected of a dead reckoning, of which somebody has learnt how wrong it is, and why."""

from math import expm1
from typing import NamedTuple

from ..core.compiled import inlined
from ..records.rows import Row


class Told(NamedTuple):
    """What a vehicle's own sensors have told it by an instant (s): its dead reckoning (m), and the
    integrals of the cosine and sine of its heading from the start of the mission (s).
    """

    time: float
    x: float
    y: float
    cosine: float
    sine: float


class Drift(NamedTuple):
    """What is expected: the instant (s), the integrals of the heading (s) and dead reckoning (m)
    that it is about; error (m), velocity bias and current (m/s), stretch and turn, and the bias
    that wanders (m/s) with its time constant (s), as in :mod:`.navigation.belief`.
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


class Way(NamedTuple):
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
def way_since(drift: Drift, told: Told, in_body: bool) -> Way:
    """Return what has summed up since then; `in_body` if biases turn with the body."""
    passed = told.time - drift.at
    ahead = told.cosine - drift.cosine if in_body else passed
    aside = told.sine - drift.sine if in_body else 0.0
    share, left = passed / drift.time_constant, 1.0
    if share > 0.0:
        left = -expm1(-share) / share
    forward = drift.bias_ahead + left * drift.roaming_ahead
    starboard = drift.bias_aside + left * drift.roaming_aside
    x = told.x - drift.x - (ahead * forward - aside * starboard)
    y = told.y - drift.y - (aside * forward + ahead * starboard)
    return Way(passed, ahead, aside, left, x, y)


@inlined
def expected_error(drift: Drift, way: Way) -> tuple[float, float]:
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
def learnt_drift(learnt: Row) -> Drift:
    """Return what is expected to be added to the error, by a row of :data:`.rows.LEARNT`."""
    return Drift(
        learnt.at_s, learnt.cosine_s, learnt.sine_s, learnt.x_m, learnt.y_m, 0.0, 0.0,
        learnt.bias[0], learnt.bias[1], learnt.current[0], learnt.current[1],
        learnt.stretch, learnt.turn, learnt.roaming[0], learnt.roaming[1], learnt.time_constant_s,
    )  # fmt: skip


@inlined
def learn(learnt: Row, drift: Drift) -> None:
    """Write what is expected to a row of :data:`.rows.LEARNT`."""
    learnt.at_s, learnt.cosine_s, learnt.sine_s = drift.at, drift.cosine, drift.sine
    learnt.x_m, learnt.y_m, learnt.time_constant_s = drift.x, drift.y, drift.time_constant
    learnt.bias[0], learnt.bias[1] = drift.bias_ahead, drift.bias_aside
    learnt.current[0], learnt.current[1] = drift.current_x, drift.current_y
    learnt.stretch, learnt.turn = drift.stretch, drift.turn
    learnt.roaming[0], learnt.roaming[1] = drift.roaming_ahead, drift.roaming_aside
