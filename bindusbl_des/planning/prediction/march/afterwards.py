"""The errors of a smoother, which knows the fixes of before and after: two marches, one from the
end, each with what it knows of the position.

What both tell of the sources of drift is left out, and the lag of a smoother that has one.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..inputs import Inputs
from ..rounds import Turns
from ..sights import Fixes
from .errors import Errors, errors_of

Floats = NDArray[np.float64]

# Before the first fix nothing is known: by so much (m) an AUV may be anywhere.
ANYWHERE_M = 1e4


def smoothed(inputs: Inputs, turns: Turns, fixes: Fixes) -> Errors:
    """Return the errors of all AUVs that know all fixes of the mission, whenever they were told."""
    forward = errors_of(inputs, turns._replace(told_s=turns.pinged_s), fixes)
    back = errors_of(*_backwards(inputs, turns, fixes))
    before, after = _second_moments(forward), _second_moments(back)[:, ::-1]
    covariance = _both(before, after)
    return forward._replace(mean=np.zeros(forward.mean.shape), covariance=covariance)


def _backwards(inputs: Inputs, turns: Turns, fixes: Fixes) -> tuple[Inputs, Turns, Fixes]:
    """Return a mission that begins with its end, of which nothing is known."""
    ways, navigator, end = inputs.ways, inputs.navigator, inputs.duration_s
    last = len(ways.times_s) - 1
    headings = ways.headings_s[:, -1:] - ways.headings_s[:, ::-1]
    way = replace(ways, places_m=ways.places_m[:, ::-1].copy(), headings_s=headings)
    unknown = replace(
        navigator,
        start_sd_m=ANYWHERE_M,
        told_start_sd_m=ANYWHERE_M,
        sources=tuple(
            replace(it, mean=(0.0, 0.0), drawn_sd=it.told_sd) for it in navigator.sources
        ),
    )
    pinged = end - turns.pinged_s[:, ::-1]
    turned = turns._replace(
        pinged_s=pinged,
        told_s=pinged,
        chance=turns.chance[:, ::-1].copy(),
        at=last - turns.at[:, ::-1],
        kind=np.ascontiguousarray(turns.kind[:, ::-1]),
    )
    own = Fixes(*(np.ascontiguousarray(part[:, ::-1]) for part in fixes))
    return replace(inputs, ways=way, navigator=unknown), turned, own


def _second_moments(errors: Errors) -> Floats:
    """Return xx, yy, xy (n, k, 3), m2, of errors about nothing."""
    x, y = errors.mean[..., 0], errors.mean[..., 1]
    return np.asarray(errors.covariance + np.stack((x * x, y * y, x * y), axis=-1))


def _both(one: Floats, other: Floats) -> Floats:
    """Return what is left of errors (n, k, 3) where another estimate is independent of them,
    A - A (A + B)^-1 A.
    """
    xx, yy, xy = (one[..., k] for k in range(3))
    a, b, c = (one[..., k] + other[..., k] for k in range(3))
    determinant = np.maximum(a * b - c * c, 1e-30)
    out = np.empty(one.shape)
    out[..., 0] = xx - (b * xx * xx - 2.0 * c * xx * xy + a * xy * xy) / determinant
    out[..., 1] = yy - (b * xy * xy - 2.0 * c * xy * yy + a * yy * yy) / determinant
    out[..., 2] = xy - (b * xx * xy - c * (xx * yy + xy * xy) + a * xy * yy) / determinant
    return np.asarray(np.maximum(out, np.array((0.0, 0.0, -np.inf))))
