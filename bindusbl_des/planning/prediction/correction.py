"""What a fix makes of errors that may come or not: those of both cases, each as likely as it is."""

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled
from .drift import State

Floats = NDArray[np.float64]

# A gain that is worked out from what the filter believes
WEIGHED = -1.0


@compiled
def correct(
    state: State,
    noise: tuple[float, float, float],
    fixes: float,
    gain: float,
    behind: tuple[float, float],
) -> None:
    """Take in, in the place of `state`, so many `fixes` at once whose noise is xx, yy, xy (m2).

    Fewer than one is the chance of one; the errors are then those of a mixture, which is exact for
    the mean and covariance of a fixed gain and an upper bound for a weighed one (Sinopoli et al.,
    IEEE Trans. Automatic Control 49(9), 2004).  The fix is compared with an estimate that is
    `behind` (x, y), m, of where the fix holds.
    """
    mean, true, believed = state
    size, chance = mean.size, min(fixes, 1.0)
    share = 1.0 / max(fixes, 1.0)
    xx, yy, xy = noise[0] * share, noise[1] * share, noise[2] * share
    gains = _gains(believed, (xx, yy, xy), gain)
    x, y = mean[0] + behind[0], mean[1] + behind[1]
    moved = np.empty(size)
    for i in range(size):
        moved[i] = gains[i, 0] * x + gains[i, 1] * y
        mean[i] -= chance * moved[i]
    for spread in (true, believed):
        after = _joseph(spread, gains, (xx, yy, xy))
        for i in range(size):
            for j in range(size):
                spread[i, j] += chance * (after[i, j] - spread[i, j])
    for i in range(size):
        for j in range(size):
            true[i, j] += chance * (1.0 - chance) * moved[i] * moved[j]


@compiled
def _gains(believed: Floats, noise: tuple[float, float, float], gain: float) -> Floats:
    """Return the gains (k, 2) of a fix: Kalman's, or a fixed one of the position."""
    out = np.zeros((len(believed), 2))
    if gain != WEIGHED:
        out[0, 0] = out[1, 1] = gain
        return out
    xx, yy, xy = believed[0, 0] + noise[0], believed[1, 1] + noise[1], believed[0, 1] + noise[2]
    determinant = xx * yy - xy * xy
    if determinant > 1e-12 * (xx + yy) * (xx + yy):
        for i in range(len(believed)):
            first, second = believed[i, 0], believed[i, 1]
            out[i, 0] = (first * yy - second * xy) / determinant
            out[i, 1] = (second * xx - first * xy) / determinant
    return out


@compiled
def _joseph(spread: Floats, gains: Floats, noise: tuple[float, float, float]) -> Floats:
    """Return (1 - K H) P (1 - K H)^T + K R K^T."""
    size = len(spread)
    half, out = np.empty((size, size)), np.empty((size, size))
    for i in range(size):
        for j in range(size):
            half[i, j] = spread[i, j] - gains[i, 0] * spread[0, j] - gains[i, 1] * spread[1, j]
    xx, yy, xy = noise
    for i in range(size):
        over = gains[i, 0] * xx + gains[i, 1] * xy
        beside = gains[i, 0] * xy + gains[i, 1] * yy
        for j in range(size):
            out[i, j] = half[i, j] - half[i, 0] * gains[j, 0] - half[i, 1] * gains[j, 1]
            out[i, j] += over * gains[j, 0] + beside * gains[j, 1]
    return out
