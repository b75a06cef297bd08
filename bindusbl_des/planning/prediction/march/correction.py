"""What a fix makes of errors that may come or not: those of both cases, each as likely as it is."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....core.compiled import compiled
from .drift import State

Floats = NDArray[np.float64]
Spread = tuple[float, float, float]

# A gain that is worked out from what the filter believes
WEIGHED = -1.0


class Fix(NamedTuple):
    """What a fix says: the error, with noise xx, yy, xy (m2), as it is and as the filter thinks;
    and what it has in common with other fixes, (`xx`; `yx`, `yy`) m times the two states from
    `common` on (0: it has nothing).
    """

    noise: Spread
    thought: Spread
    common: int
    xx: float
    yx: float
    yy: float


@compiled
def correct(state: State, fix: Fix, fixes: float, gain: float, behind: tuple[float, float]) -> None:
    """Take in, in the place of `state`, so many `fixes` at once.

    Fewer than one is the chance of one; the errors are then those of a mixture, which is exact for
    the mean and covariance of a fixed gain and an upper bound for a weighed one (Sinopoli et al.,
    IEEE Trans. Automatic Control 49(9), 2004).  The fix is compared with an estimate that is
    `behind` (x, y), m, of where the fix holds.
    """
    rows, true, believed = state
    size, chance = len(true), min(fixes, 1.0)
    share = 1.0 / max(fixes, 1.0)
    xx, yy, xy = fix.noise[0] * share, fix.noise[1] * share, fix.noise[2] * share
    thought = fix.thought[0] * share, fix.thought[1] * share, fix.thought[2] * share
    gains = _gains(believed, fix, thought, gain)
    moved = np.empty(size)
    for row in range(len(rows) - 1, -1, -1):
        x, y = rows[row, 0], rows[row, 1]
        if fix.common > 0:
            x += fix.xx * rows[row, fix.common]
            y += fix.yx * rows[row, fix.common] + fix.yy * rows[row, fix.common + 1]
        if row == 0:
            x, y = x + behind[0], y + behind[1]
        for i in range(size):
            moved[i] = gains[i, 0] * x + gains[i, 1] * y
            rows[row, i] -= chance * moved[i]
    _mix(true, _joseph(true, gains, fix, (xx, yy, xy)), chance)
    _mix(believed, _joseph(believed, gains, fix, thought), chance)
    for i in range(size):
        for j in range(size):
            true[i, j] += chance * (1.0 - chance) * moved[i] * moved[j]


@compiled
def _mix(spread: Floats, other: Floats, chance: float) -> None:
    for i in range(len(spread)):
        for j in range(len(spread)):
            spread[i, j] += chance * (other[i, j] - spread[i, j])


@compiled
def _said(spread: Floats, fix: Fix) -> Floats:
    """Return the covariances (k, 2) of all states with what a fix says, P H^T."""
    out = spread[:, :2].copy()
    if fix.common > 0:
        for i in range(len(spread)):
            first, second = spread[i, fix.common], spread[i, fix.common + 1]
            out[i, 0] += fix.xx * first
            out[i, 1] += fix.yx * first + fix.yy * second
    return out


@compiled
def _gains(believed: Floats, fix: Fix, noise: Spread, gain: float) -> Floats:
    """Return the gains (k, 2) of a fix: Kalman's, or a fixed one of the position."""
    out = np.zeros((len(believed), 2))
    if gain != WEIGHED:
        out[0, 0] = out[1, 1] = gain
        return out
    said = _said(believed, fix)
    xx, yy, xy = said[0, 0], said[1, 1], said[0, 1]
    if fix.common > 0:
        first, second = said[fix.common], said[fix.common + 1]
        xx += fix.xx * first[0]
        xy += fix.xx * first[1]
        yy += fix.yx * first[1] + fix.yy * second[1]
    xx, yy, xy = xx + noise[0], yy + noise[1], xy + noise[2]
    determinant = xx * yy - xy * xy
    if determinant > 1e-12 * (xx + yy) * (xx + yy):
        for i in range(len(believed)):
            out[i, 0] = (said[i, 0] * yy - said[i, 1] * xy) / determinant
            out[i, 1] = (said[i, 1] * xx - said[i, 0] * xy) / determinant
    return out


@compiled
def _joseph(spread: Floats, gains: Floats, fix: Fix, noise: Spread) -> Floats:
    """Return (1 - K H) P (1 - K H)^T + K R K^T."""
    size = len(spread)
    half, out = np.empty((size, size)), np.empty((size, size))
    said = _said(spread, fix)
    for i in range(size):
        for j in range(size):
            half[i, j] = spread[i, j] - gains[i, 0] * said[j, 0] - gains[i, 1] * said[j, 1]
    said = _said(half, fix)
    xx, yy, xy = noise
    for i in range(size):
        over = gains[i, 0] * xx + gains[i, 1] * xy
        beside = gains[i, 0] * xy + gains[i, 1] * yy
        for j in range(size):
            out[i, j] = half[i, j] - said[i, 0] * gains[j, 0] - said[i, 1] * gains[j, 1]
            out[i, j] += over * gains[j, 0] + beside * gains[j, 1]
    return out
