"""What an AUV believes between fixes: how wrong its dead reckoning is, why, and how sure it is.

The error e of dead reckoning grows with the velocity bias b and the current c that it does not see:

    de/dt = R(yaw) b - c + noise          (b in the body; R is 1 for a bias in the survey frame)

so that a belief about (e, b, c) at one instant is one about any later instant: what b has done is
the integral of R, which the AUV's own heading gives exactly, so that no filter has to be stepped
between fixes.  The position believed is dead reckoning less the error believed.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiled import compiled, entry, inlined
from ..records.rows import Row, Rows
from ..vehicles.motion import Floats

# A belief: the instant (s) that it is about, the integrals of cosine and sine of the heading up to
# there (s); its state, the error (m), velocity bias (m/s) and current (m/s) with two components
# each, and the covariance of the six; fixes that the gate has refused in a row.
STATES = 6
BELIEF = np.dtype(
    [
        ("at_s", "f8"),
        ("cosine_s", "f8"),
        ("sine_s", "f8"),
        ("state", "f8", (STATES,)),
        ("covariance", "f8", (STATES, STATES)),
        ("refused", "i8"),
    ]
)


class Growth(NamedTuple):
    """How beliefs become less sure: variances per second of the error (m2/s) and of the current
    (m2/s3), and whether the bias turns with the body.
    """

    walk: float
    wander: float
    in_body: bool


def first_belief(start_sd: float, bias_sd: tuple[float, float], current_sd: float) -> Rows:
    """Return what is believed at the start (1,), BELIEF: no error, as sure as the sensors are.

    `start_sd` m of position, `bias_sd` m/s along both axes, `current_sd` m/s.
    """
    belief = np.zeros(1, dtype=BELIEF)
    sd = np.array([start_sd, start_sd, *bias_sd, current_sd, current_sd])
    belief["covariance"] = np.diag(sd**2)
    return belief


@inlined
def _turned(
    belief: Row, time: float, cosine: float, sine: float, in_body: bool
) -> tuple[float, float, float]:
    """Return the time (s) passed since the belief, and what R has summed up to meanwhile (s)."""
    passed = time - belief.at_s
    ahead = cosine - belief.cosine_s if in_body else passed
    aside = sine - belief.sine_s if in_body else 0.0
    return passed, ahead, aside


@inlined
def _error(belief: Row, passed: float, ahead: float, aside: float) -> tuple[float, float]:
    """Return the error (m) that a belief expects after some time (s)."""
    state = belief.state
    x = ahead * state[2] - aside * state[3] - passed * state[4]
    y = aside * state[2] + ahead * state[3] - passed * state[5]
    return state[0] + x, state[1] + y


@compiled
def carry(belief: Row, time: float, cosine: float, sine: float, growth: Growth) -> None:
    """Carry a belief, in its place, to another instant (s); to an earlier one it gets no surer.

    `cosine` and `sine` are the integrals of the heading up to there (s).
    """
    passed, ahead, aside = _turned(belief, time, cosine, sine, growth.in_body)
    state, spread = belief.state, belief.covariance
    state[0], state[1] = _error(belief, passed, ahead, aside)
    belief.at_s, belief.cosine_s, belief.sine_s = time, cosine, sine
    for k in range(STATES):  # F P ...
        spread[0, k] += ahead * spread[2, k] - aside * spread[3, k] - passed * spread[4, k]
        spread[1, k] += aside * spread[2, k] + ahead * spread[3, k] - passed * spread[5, k]
    for k in range(STATES):  # ... F^T
        spread[k, 0] += ahead * spread[k, 2] - aside * spread[k, 3] - passed * spread[k, 4]
        spread[k, 1] += aside * spread[k, 2] + ahead * spread[k, 3] - passed * spread[k, 5]
    grown = max(passed, 0.0)
    for axis in range(2):
        spread[axis, axis] += growth.walk * grown + growth.wander * grown**3 / 3.0
        spread[axis, 4 + axis] -= growth.wander * grown**2 / 2.0
        spread[4 + axis, axis] -= growth.wander * grown**2 / 2.0
        spread[4 + axis, 4 + axis] += growth.wander * grown


@compiled
def weigh(belief: Row, gain: Floats, x: float, y: float, noise: tuple[float, float, float]) -> None:
    """Take a measured error of dead reckoning in, in the place of `belief`, by a gain (6, 2).

    It is off (`x`, `y`), m, from the one believed; its covariance is `noise` (xx, yy, xy), m2.
    Joseph's form, P = (1 - K H) P (1 - K H)^T + K R K^T, is right for any gain.  Source: Y.
    Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation,
    2001, eq. 5.2.3-18.
    """
    state, spread = belief.state, belief.covariance
    xx, yy, xy = noise
    for k in range(STATES):
        state[k] += gain[k, 0] * x + gain[k, 1] * y
    for k in range(STATES):
        first, second = spread[0, k], spread[1, k]
        for i in range(STATES):
            spread[i, k] -= gain[i, 0] * first + gain[i, 1] * second
    for k in range(STATES):
        first, second = spread[k, 0], spread[k, 1]
        for i in range(STATES):
            spread[k, i] -= gain[i, 0] * first + gain[i, 1] * second
    for i in range(STATES):
        over, beside = gain[i, 0] * xx + gain[i, 1] * xy, gain[i, 0] * xy + gain[i, 1] * yy
        for k in range(STATES):
            spread[i, k] += over * gain[k, 0] + beside * gain[k, 1]


@entry
def positions(
    since: Floats, beliefs: Rows, times: Floats, reckoned: Floats, headings: Floats, in_body: bool
) -> Floats:
    """Return the positions (n, 2), m, believed at instants (n,), s, that rise.

    `beliefs` (k,), BELIEF, are held from the instants `since` (k,), s, on, the first from before
    all `times`; `reckoned` and `headings` as in :class:`.dead_reckoning.Odometry`.
    """
    out = np.empty((times.size, 2))
    last = 0
    for n in range(times.size):
        while last + 1 < since.size and since[last + 1] <= times[n]:
            last += 1
        own = beliefs[last]
        passed, ahead, aside = _turned(own, times[n], headings[n, 0], headings[n, 1], in_body)
        x, y = _error(own, passed, ahead, aside)
        out[n, 0], out[n, 1] = reckoned[n, 0] - x, reckoned[n, 1] - y
    return out


@entry
def covariances(
    times: Floats, headings: Floats, walk: float, wander: float, in_body: bool, since: Floats,
    beliefs: Rows,
) -> Floats:  # fmt: skip
    """Return the covariances xx, yy, xy (n, 3), m2, of what :func:`positions` returns."""
    growth, own = Growth(walk, wander, in_body), np.empty(1, BELIEF)
    out = np.empty((times.size, 3))
    last = 0
    for n in range(times.size):
        while last + 1 < since.size and since[last + 1] <= times[n]:
            last += 1
        own[0] = beliefs[last]
        carry(own[0], times[n], headings[n, 0], headings[n, 1], growth)
        spread = own[0].covariance
        out[n, 0], out[n, 1], out[n, 2] = spread[0, 0], spread[1, 1], spread[0, 1]
    return out
