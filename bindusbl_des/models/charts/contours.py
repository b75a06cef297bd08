"""Lines of equal depth of the bottom, for maps."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...support.arrays import Floats

# The most lines between the least and the greatest depth, and steps (m) times powers of ten
MOST, STEPS = 12, (1.0, 2.0, 5.0)
# Lines shorter than this share of the map are left out, and points closer than this share of it
SHORT, CLOSE = 0.03, 0.004


def levels_of(low: float, high: float) -> list[float]:
    """Return the round depths (m) from one to another that a map shows.

    >>> levels_of(12.0, 31.0), levels_of(0.0, 45.0)[:3]
    ([14.0, 16.0, 18.0, 20.0, 22.0, 24.0, 26.0, 28.0, 30.0], [5.0, 10.0, 15.0])
    """
    if not high > low:
        return []
    scale = 10.0 ** np.floor(np.log10((high - low) / MOST))
    step = next(n * scale for n in (*STEPS, 10.0) if (high - low) / (n * scale) <= MOST)
    first = np.floor(low / step) + 1.0
    return [float(k * step) for k in np.arange(first, np.floor(high / step) + 1.0)]


def contours(xs: Floats, ys: Floats, depths: Floats) -> Iterator[tuple[float, list[Floats]]]:
    """Yield depths (m), each with its lines, (n, 2), x and y in m; `depths` (n, m), m, are those of
    a grid, whose nodes are at `xs` (n,) and `ys` (m,), m, and NaN where unknown.
    """
    if not depths.size:
        return
    from contourpy import contour_generator  # matplotlib's own

    low, high = float(np.nanmin(depths)), float(np.nanmax(depths))
    made: Any = contour_generator(ys, xs, np.ma.masked_invalid(depths))
    across = max(float(np.ptp(axis)) for axis in (xs, ys))
    for depth in levels_of(max(low, 0.0), high):
        lines = [_thin(line[:, ::-1], CLOSE * across) for line in made.lines(depth)]
        yield depth, [line for line in lines if np.ptp(line, axis=0).max() > SHORT * across]


def _thin(line: Floats, apart: float) -> Floats:
    """Return a line (n, 2) without points closer than a distance to the one before."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))))
    kept = np.unique(np.searchsorted(along, np.arange(0.0, along[-1], apart)))
    return np.asarray(line[np.append(kept, len(line) - 1)], dtype=np.float64)
