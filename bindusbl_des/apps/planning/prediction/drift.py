"""How the error of a position grows and shrinks: true mean, true covariance, and the filter's.

The state holds the error (m) along x and y, and two numbers for each source of drift, as in
:mod:`....core.navigation.belief`.  The filter weighs fixes by its own covariance; the true mean and
covariance follow from the same gains.  They differ if the filter assumes other values than the true
ones, or if it has a fixed gain.
"""

from math import exp, expm1
from typing import NamedTuple

from ....core.navigation.belief import fade, roam, spread_by, wander
from ....support.arrays import Floats, Ints
from ....support.compiled import compiled

BODY, WORLD, WAY, NOT_AT_ALL = 0, 1, 2, 3
FRAMES = {"body": BODY, "world": WORLD, "way": WAY}


class Drifts(NamedTuple):
    """The s sources of drift, each with its frame (s,); one without a frame is the fixes' common
    error (the last, if `has_common`).

    `time_constants` (s,) are in s, infinite if constant; `wanders` (s,) are variances per second of
    random walks; `variances` and `assumed` (2 s,) are stationary variances, true and the filter's;
    `walk` and `assumed_walk` (m2/s) are the random walk of the position.
    """

    frames: Ints
    time_constants: Floats
    wanders: Floats
    variances: Floats
    assumed: Floats
    walk: float
    assumed_walk: float
    has_common: bool


class Moment(NamedTuple):
    """A time (s), the integrals of cosine and sine of the heading (s), and the position (m)."""

    time: float
    cosine: float
    sine: float
    x: float
    y: float


class DriftState(NamedTuple):
    """Errors at one instant: true mean, true covariance (k, k), the filter's covariance (k, k).

    The first of the `rows` (m, k) is the mean.  Two each of the others are covariances of the
    present states with the error along x and y at an earlier instant, which change as a mean does.
    """

    rows: Floats
    true: Floats
    believed: Floats


@compiled
def moment_at(time: float, step: float, places: Floats, headings: Floats) -> Moment:
    """Return an AUV's moment at time (s), interpolated between positions and headings (k, 2)."""
    place = min(max(time / step, 0.0), len(places) - 1.0)
    low = min(int(place), len(places) - 2)
    share = place - low
    return Moment(
        time,
        headings[low, 0] + share * (headings[low + 1, 0] - headings[low, 0]),
        headings[low, 1] + share * (headings[low + 1, 1] - headings[low, 1]),
        places[low, 0] + share * (places[low + 1, 0] - places[low, 0]),
        places[low, 1] + share * (places[low + 1, 1] - places[low, 1]),
    )


@compiled
def carry(state: DriftState, begin: Moment, end: Moment, drifts: Drifts) -> None:
    """Propagate errors in place from one moment to a later one."""
    passed = end.time - begin.time
    if passed <= 0.0:
        return
    both = (state.true, drifts.variances), (state.believed, drifts.assumed)
    for source in range(drifts.frames.size):
        frame, k = drifts.frames[source], 2 + 2 * source
        ahead, aside = passed, 0.0
        if frame == BODY:
            ahead, aside = end.cosine - begin.cosine, end.sine - begin.sine
        elif frame == WAY:
            ahead, aside = end.x - begin.x, end.y - begin.y
        elif frame == NOT_AT_ALL:
            ahead = 0.0
        lasts, rate = drifts.time_constants[source], drifts.wanders[source]
        share = passed / lasts
        kept, mean = exp(-share), -expm1(-share) / share if share > 0.0 else 1.0
        for row in state.rows:
            row[0] += mean * ahead * row[k] - mean * aside * row[k + 1]
            row[1] += mean * aside * row[k] + mean * ahead * row[k + 1]
            row[k] *= kept
            row[k + 1] *= kept
        for spread, variances in both:
            spread_by(spread, k, mean * ahead, mean * aside)
            if share > 0.0:
                fade(spread, k, kept, variances[k - 2])
                fade(spread, k + 1, kept, variances[k - 1])
                line = ahead / passed, aside / passed
                roam(spread, k, line, passed, lasts, variances[k - 2])
            if rate > 0.0:
                wander(spread, 0, k, passed, 0.0, rate, 1.0)
                wander(spread, 1, k + 1, passed, 0.0, rate, 1.0)
    for axis in range(2):
        state.true[axis, axis] += drifts.walk * passed
        state.believed[axis, axis] += drifts.assumed_walk * passed
