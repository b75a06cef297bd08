"""How an error of position grows and shrinks: its mean, its covariance, and what a filter thinks.

States are the error (m) along x and y, and two numbers of each source of drift, as in
:mod:`....core.navigation.belief`.  Three things are carried on side by side: the covariance that
the filter believes in, by which it weighs fixes, and the true mean and covariance of its errors,
which follow from the same gains.  They differ where the filter is told something else than the
truth, or weighs by no covariance at all.
"""

from math import exp, expm1
from typing import NamedTuple

from ....core.navigation.belief import fade, roam, spread_by, wander
from ....support.arrays import Floats, Ints
from ....support.compiled import compiled

BODY, WORLD, WAY, NOT_AT_ALL = 0, 1, 2, 3
FRAMES = {"body": BODY, "world": WORLD, "way": WAY}


class Drifts(NamedTuple):
    """The sources of drift: which frame each turns with (s,), or none (the last, if `has_common`,
    is an error of fixes); its time constant (s,), s, infinite if it has none; the variances per
    second with which they wander by random walk (s,); the standing variances (2 s,), true and
    believed; and the random walk of the position (m2/s), true and believed.
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
    """An instant (s), the integrals of the heading (s) and the place (m) of an AUV then."""

    time: float
    cosine: float
    sine: float
    x: float
    y: float


class DriftState(NamedTuple):
    """What is known of errors at one instant: their true mean and covariance (k, k), and the
    covariance (k, k) that the filter believes in.

    The first of the `rows` (m, k) is the mean.  Two each of the others are the covariances of the
    error at an earlier instant, along x and y, with the states now: they change as a mean does.
    """

    rows: Floats
    true: Floats
    believed: Floats


@compiled
def moment_at(time: float, step: float, places: Floats, headings: Floats) -> Moment:
    """Return an AUV's moment at an instant (s), straight between those of its way (k, 2)."""
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
    """Carry errors, in their place, from one moment to a later one."""
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
