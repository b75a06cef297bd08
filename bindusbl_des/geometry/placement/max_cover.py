"""Where k vessels that hear a given way hear most places, if they cannot hear them all.

Where the radius of the best k centres is beyond their reach, the k-centre objective puts vessels
between places that none of them then hears; this one leaves the farthest places out (objective O2).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..formation import stations
from .enclosing_circle import enclosing_circle
from .k_centre import distances

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Of so many places all pairs are tried, of more a grid of this many cells over a reach.
MOST_PAIRED, CELLS = 60, 3
# Circles to begin with
STARTS = 8
# A place beyond the reach by no more than this share of it is within it: rounding.
ROUNDING = 1e-9


class Cover(NamedTuple):
    """Places of k vessels (k, 2), m, and which of n places one of them reaches (n,)."""

    places: Floats
    reached: Flags


def max_cover(
    places: ArrayLike, count: int, reach: float, weights: ArrayLike | None = None
) -> Cover:
    """Return where `count` vessels of a reach (m) cover most of places (n, 2), m, weighted by (n,).

    Circles that cover most can be moved until two of the places they hold lie on their edge, or one
    at the middle, so of a few places all circles worth trying are tried.  One after the other the
    circle that adds most is taken (1 - 1/e of the best at least: Nemhauser, Wolsey and Fisher
    1978), then each is exchanged for a better one while there is any.  That is begun with each of
    the `STARTS` circles that cover most; of equal ends the first is taken.  In the end each vessel
    lies in the middle of what it covers, and one that nothing is left for at the place that is
    farthest from all others.
    Raises ValueError for less than one vessel, a reach that is not positive, and as
    :func:`.formation.stations` does.

    >>> found = max_cover([(0.0, 0.0), (8.0, 0.0), (100.0, 0.0)], 1, 5.0)
    >>> found.places.tolist(), found.reached.tolist()
    ([[4.0, 0.0]], [True, True, False])
    """
    points = stations(places)
    if count < 1:
        raise ValueError(f"at least one vessel is needed; met {count}; raise the count")
    if not 0.0 < reach < np.inf:
        raise ValueError(f"a reach must be positive and finite; met {reach}; give it in metres")
    value = np.ones(len(points)) if weights is None else np.asarray(weights, dtype=np.float64)
    middles = _middles(points, reach)
    within = distances(middles, points) <= reach * (1.0 + ROUNDING)  # (circles, n)
    firsts = np.argsort(-(within @ value), kind="stable")[:STARTS]
    tried = [_exchanged(_greedy(within, value, count, int(it)), within, value) for it in firsts]
    chosen = max(tried, key=lambda it: float(value[within[it].any(axis=0)].sum()))
    return _settled(points, within[chosen], reach)


def _middles(points: Floats, reach: float) -> Floats:
    """Return the middles (c, 2), m, of all circles worth trying."""
    if len(points) > MOST_PAIRED:
        step = reach / CELLS
        low, high = points.min(axis=0), points.max(axis=0)
        axes = [np.arange(low[k], high[k] + step, step) for k in (0, 1)]
        grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        return np.vstack((points, grid))
    first, second = np.triu_indices(len(points), k=1)
    apart, middle = points[second] - points[first], (points[second] + points[first]) / 2.0
    half = np.hypot(*apart.T) / 2.0
    near = (half > 0.0) & (half <= reach)
    apart, middle, half = apart[near], middle[near], half[near]
    aside = np.sqrt(reach**2 - half**2) / (2.0 * half)
    across = np.column_stack((-apart[:, 1], apart[:, 0])) * aside[:, None]
    return np.vstack((points, middle + across, middle - across))


def _greedy(within: Flags, value: Floats, count: int, first: int) -> list[int]:
    """Return circles, each but the first of which adds most to those before."""
    chosen, left = [first], value.copy()
    while len(chosen) < count:
        left[within[chosen[-1]]] = 0.0
        chosen.append(int((within @ left).argmax()))
    return chosen


def _exchanged(chosen: list[int], within: Flags, value: Floats) -> list[int]:
    """Return circles of which none can be exchanged for one that covers more."""
    better = True
    while better:
        better = False
        for number in range(len(chosen)):
            others = [it for k, it in enumerate(chosen) if k != number]
            left = np.where(within[others].any(axis=0), 0.0, value)
            gains = within @ left
            best = int(gains.argmax())
            if gains[best] > gains[chosen[number]] * (1.0 + ROUNDING):
                chosen[number], better = best, True
    return chosen


def _settled(points: Floats, within: Flags, reach: float) -> Cover:
    """Return vessels in the middle of what their circles (k, n) hold, each place of the first."""
    own = within & ~np.vstack((np.zeros_like(within[:1]), np.logical_or.accumulate(within)[:-1]))
    middles = np.array([enclosing_circle(points[it])[:2] for it in own if it.any()])
    while len(middles) < len(within):
        farthest = distances(points, middles).min(axis=1).argmax()
        middles = np.vstack((middles, points[farthest]))
    reached = distances(points, middles).min(axis=1) <= reach * (1.0 + ROUNDING)
    return Cover(middles[np.lexsort(middles.T[::-1])], reached)
