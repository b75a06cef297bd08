"""Which vessel goes to which station, a minimiser without derivatives, and Fisher information.

A vessel at distance r measures a position with errors along the line of sight and across it, of
standard deviations sd_r and r sd_theta.  The information of several vessels adds up (physics of the
USBL fix, 3.1): J = sum of (e e^T / sd_r^2 + t t^T / (r sd_theta)^2), with unit vectors e along the
line of sight and t across it.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...support.arrays import Floats
from .formation import stations

Numbers = NDArray[np.intp]

# The index of a vessel without a station.
NOWHERE = -1


def assignment(vessels: ArrayLike, places: ArrayLike) -> Numbers:
    """Return for each vessel (n, 2), m, the index of its station (m, 2), m, at least squared moves.

    Shape (n,).  A station has at most one vessel; with fewer stations than vessels, those left over
    get `NOWHERE`.  Raises ValueError as :func:`.formation.stations` does.

    >>> assignment([(0.0, 0.0), (9.0, 0.0)], [(10.0, 0.0), (1.0, 0.0)]).tolist()
    [1, 0]
    """
    here, there = stations(vessels), stations(places)
    apart = here[:, None, :] - there[None, :, :]
    cost = (apart**2).sum(axis=-1)
    if len(here) <= len(there):
        return least_sum(cost)
    chosen = np.full(len(here), NOWHERE, dtype=np.intp)
    chosen[least_sum(cost.T)] = np.arange(len(there))
    return chosen


def least_sum(cost: Floats) -> Numbers:
    """Return for each row a column of its own, so that the sum of costs is least.

    `cost` has shape (n, m), n <= m; the result (n,).  The Hungarian method by shortest augmenting
    paths, n^2 m steps: Kuhn 1955; Jonker and Volgenant 1987. Raises ValueError for more rows than
    columns.
    """
    rows, columns = cost.shape
    if rows > columns:
        raise ValueError(f"{rows} rows need as many columns; met {columns}; transpose the costs")
    # Row 0 and column 0 mean "none"; prices are the dual variables: row + column <= cost.
    row_price, column_price = np.zeros(rows + 1), np.zeros(columns + 1)
    row_of = np.zeros(columns + 1, dtype=np.intp)
    for row in range(1, rows + 1):
        row_of[0], column = row, 0
        least = np.full(columns + 1, np.inf)
        before = np.zeros(columns + 1, dtype=np.intp)
        seen = np.zeros(columns + 1, dtype=bool)
        while row_of[column] != 0:  # until a column is free
            seen[column] = True
            here = row_of[column]
            reduced = cost[here - 1] - row_price[here] - column_price[1:]
            nearer = ~seen[1:] & (reduced < least[1:])
            least[1:][nearer], before[1:][nearer] = reduced[nearer], column
            following = int(np.where(seen[1:], np.inf, least[1:]).argmin()) + 1
            step = least[following]
            row_price[row_of[seen]] += step
            column_price[seen] -= step
            least[~seen] -= step
            column = following
        while column != 0:  # along the augmenting path, each row takes the next column
            row_of[column] = row_of[before[column]]
            column = int(before[column])
    chosen = np.empty(rows, dtype=np.intp)
    taken = row_of[1:] > 0
    chosen[row_of[1:][taken] - 1] = np.flatnonzero(taken)
    return chosen


# The search restarts from its minimum until a restart gains less than this share.
WORTH_ANOTHER = 1e-3


def descended(
    value: Callable[[Floats], float], start: Floats, step: float, least_step: float, most: int
) -> tuple[Floats, float]:
    """Return the point (n,) near `start` at which a function is least, and its value there.

    The simplex of Nelder and Mead 1965, with the coefficients of Gao and Han 2012 that depend on n.
    It begins with edges of length `step` along the axes, and ends when all corners are within
    `least_step` or the function was evaluated `most` times.  It restarts from its minimum, since a
    simplex may collapse too early.
    """
    asked = 0

    def ask(place: Floats) -> float:
        nonlocal asked
        asked += 1
        return value(place)

    best, least = np.array(start, dtype=np.float64), ask(np.array(start, dtype=np.float64))
    while True:
        place, lower = _collapsed(ask, best, least, step, lambda size: (
            size > least_step and asked < most
        ))  # fmt: skip
        gained = least - lower
        best, least = place, lower
        if asked >= most or not gained > WORTH_ANOTHER * abs(lower):
            return best, least


def _collapsed(
    ask: Callable[[Floats], float],
    start: Floats,
    least: float,
    step: float,
    goes_on: Callable[[float], bool],
) -> tuple[Floats, float]:
    """Shrink a simplex about a minimum while `goes_on(size)`; return its best corner and value.

    It begins at `start` (n,), where `ask` is `least`, with edges of `step`.
    """
    size = len(start)
    expand, contract, shrink = 1 + 2 / size, 0.75 - 0.5 / size, 1 - 1 / size
    if size == 1:
        expand, contract, shrink = 2.0, 0.5, 0.5
    corners = np.vstack((start, start + step * np.eye(size)))
    values = np.array([least, *(ask(corner) for corner in corners[1:])])
    while True:
        order = np.argsort(values, kind="stable")
        corners, values = corners[order], values[order]
        if not goes_on(float(np.abs(corners - corners[0]).max())):
            return corners[0], float(values[0])
        middle = corners[:-1].mean(axis=0)
        away = middle - corners[-1]
        tried = middle + away
        reached = ask(tried)
        if reached < values[0]:
            farther = middle + expand * away
            beyond = ask(farther)
            tried, reached = (farther, beyond) if beyond < reached else (tried, reached)
        elif reached >= values[-2]:
            outside = reached < values[-1]
            nearer = middle + (contract if outside else -contract) * away
            between = ask(nearer)
            if between >= min(reached, values[-1]):
                corners[1:] = corners[0] + shrink * (corners[1:] - corners[0])
                values[1:] = [ask(corner) for corner in corners[1:]]
                continue
            tried, reached = nearer, between
        corners[-1], values[-1] = tried, reached


def information(
    places: ArrayLike, vessels: ArrayLike, along_m2: ArrayLike, across_m2: ArrayLike
) -> Floats:
    """Return the Fisher information (..., 2, 2), m^-2, that vessels (m, 2) give of places (..., 2).

    `along_m2` and `across_m2` (..., m) are the variances (m2) of a vessel's measurement along the
    line of sight and across it; infinite where it measures nothing.  At zero distance the line of
    sight is x.
    """
    apart = np.asarray(places, dtype=np.float64)[..., None, :] - np.asarray(vessels)
    bearing = np.arctan2(apart[..., 1], apart[..., 0])
    cosine, sine = np.cos(bearing), np.sin(bearing)
    along, across = 1.0 / np.asarray(along_m2), 1.0 / np.asarray(across_m2)
    xx = (along * cosine**2 + across * sine**2).sum(axis=-1)
    yy = (along * sine**2 + across * cosine**2).sum(axis=-1)
    xy = ((along - across) * cosine * sine).sum(axis=-1)
    rows = np.stack((xx, xy), axis=-1), np.stack((xy, yy), axis=-1)
    return np.stack(rows, axis=-2)


def trace_of_inverse(information: Floats) -> Floats:
    """Return tr J^-1 (...), m2, the squared error of the best estimate (A-optimality).

    Infinite where J is singular: no vessel measures one of the axes.
    """
    determinant = det(information)
    with np.errstate(divide="ignore", invalid="ignore"):
        trace = (information[..., 0, 0] + information[..., 1, 1]) / determinant
    return np.where(determinant > 0.0, trace, np.inf)


def det(information: Floats) -> Floats:
    """Return det J (...), m^-4: the larger, the smaller the error ellipse (D-optimality)."""
    xx, yy, xy = information[..., 0, 0], information[..., 1, 1], information[..., 0, 1]
    return np.asarray(xx * yy - xy * xy)
