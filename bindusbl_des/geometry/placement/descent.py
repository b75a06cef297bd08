"""The least value of a function of a few numbers, nearby: no derivative, no random number."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# The simplex begins anew around what was found, until that gains less than this share.
WORTH_ANOTHER = 1e-3


def descended(
    value: Callable[[Floats], float], start: Floats, step: float, least_step: float, most: int
) -> tuple[Floats, float]:
    """Return where a function is least near a start (n,), and what it is there.

    Nelder and Mead 1965, with the coefficients of Gao and Han 2012 that depend on n, from a simplex
    whose edges along the axes are `step` long, until all its corners are within `least_step`, or
    the function was asked `most` times; begun anew where it stopped, since a simplex may collapse.
    """
    asked = 0

    def ask(place: Floats) -> float:
        nonlocal asked
        asked += 1
        return value(place)

    best, least = np.array(start, dtype=np.float64), ask(np.array(start, dtype=np.float64))
    while True:
        found, lower = _collapsed(ask, best, least, step, lambda size: (
            size > least_step and asked < most
        ))  # fmt: skip
        gained = least - lower
        best, least = found, lower
        if asked >= most or not gained > WORTH_ANOTHER * abs(lower):
            return best, least


def _collapsed(
    ask: Callable[[Floats], float],
    start: Floats,
    least: float,
    step: float,
    goes_on: Callable[[float], bool],
) -> tuple[Floats, float]:
    """Return the best corner of a simplex that has collapsed about a minimum, and its value."""
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
        found = ask(tried)
        if found < values[0]:
            farther = middle + expand * away
            beyond = ask(farther)
            tried, found = (farther, beyond) if beyond < found else (tried, found)
        elif found >= values[-2]:
            outside = found < values[-1]
            nearer = middle + (contract if outside else -contract) * away
            between = ask(nearer)
            if between >= min(found, values[-1]):
                corners[1:] = corners[0] + shrink * (corners[1:] - corners[0])
                values[1:] = [ask(corner) for corner in corners[1:]]
                continue
            tried, found = nearer, between
        corners[-1], values[-1] = tried, found
