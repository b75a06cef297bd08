"""Which vessel goes to which place, so that all together move as little as possible."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..formation import stations

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

# The place of a vessel that none was found for.
NOWHERE = -1


def assignment(vessels: ArrayLike, places: ArrayLike) -> Numbers:
    """Return for each vessel (n, 2) the number of its place (m, 2), at the least squared move.

    Positions in m; shape (n,).  Each place has one vessel at most; of fewer places than vessels,
    the vessels left over have `NOWHERE`.  Raises ValueError as :func:`.formation.stations` does.

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
    """Return for each row the column that is its own at the least sum of costs.

    `cost` of shape (n, m), n <= m; the answer of shape (n,).  The Hungarian method by shortest
    augmenting paths, of n^2 m steps: Kuhn 1955; Jonker and Volgenant 1987.
    Raises ValueError for more rows than columns.
    """
    rows, columns = cost.shape
    if rows > columns:
        raise ValueError(f"{rows} rows need as many columns; met {columns}; transpose the costs")
    # Row 0 and column 0 stand for none; prices are dual to costs: row + column <= cost.
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
        while column != 0:  # along the path, each row takes the column after its own
            row_of[column] = row_of[before[column]]
            column = int(before[column])
    chosen = np.empty(rows, dtype=np.intp)
    taken = row_of[1:] > 0
    chosen[row_of[1:][taken] - 1] = np.flatnonzero(taken)
    return chosen
