"""Paths that follow the bottom: at wanted depths, as far as an AUV climbs and dives."""

from collections.abc import Callable
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from .paths import SHORTEST_SEGMENT, Path, Segment

# A path has at most so many pieces of constant slope, and neighbours whose slopes differ by no more
# than this are one.
MOST_PIECES, SAME_SLOPE = 20_000, 1e-9

# A tour that ends where it repeats is eased so often: more changes nothing.
ROUNDS = 3

# Arcs are followed in pieces of at most this angle (rad).
PIECE = 0.25


class Slopes(NamedTuple):
    """What a path follows: wanted depths (n,), m, as a function of positions (n, 2), m; the depth
    (m) from which its heights count; the steepest slope (m/m), and the distance (m) at which wanted
    depths are taken.
    """

    wanted: Callable[[Floats], Floats]
    depth: float
    steepest: float
    step: float


def following(path: Path, asked: Slopes) -> Path:
    """Return a path with slopes, so that it is at the wanted depths and nowhere below them.

    Between points it is straight.  Where the wanted depths are steeper than it may be, it begins to
    climb early enough, and dives late.
    """
    breaks = [0.0]
    for segment in path.segments:
        breaks.append(breaks[-1] + segment.length)
    if path.repeats_from is not None:
        breaks = sorted({*breaks, path.repeats_from})
    ends = np.cumsum([segment.length for segment in path.segments])
    along = [np.zeros(1)]
    for begin, end in pairwise(breaks):
        if end - begin > SHORTEST_SEGMENT:
            number = min(int(np.searchsorted(ends, (begin + end) / 2.0)), len(ends) - 1)
            turn = path.segments[number].curvature
            step = min(asked.step, PIECE / abs(turn)) if turn else asked.step
            pieces = ceil((end - begin) / max(step, path.length / MOST_PIECES))
            along.append(np.linspace(begin, end, pieces + 1)[1:])
    s = np.concatenate(along)
    if len(s) == 1:  # a point to hover at
        wanted = asked.wanted(path.sample(s)[:, :2])
        return Path(path.start, path.segments, path.repeats_from, asked.depth - float(wanted[0]))
    again = None if path.repeats_from is None else int(np.abs(s - path.repeats_from).argmin())
    depths = _eased(s, asked.wanted(path.sample(s)[:, :2]), asked.steepest, again)
    middles = (s[1:] + s[:-1]) / 2.0
    whose = np.minimum(np.searchsorted(ends, middles), len(path.segments) - 1).tolist()
    slopes, lengths = (np.diff(depths) / np.diff(s)).tolist(), np.diff(s).tolist()
    found: list[Segment] = []
    last = -1
    for number, slope, length in zip(whose, slopes, lengths, strict=True):
        curvature = path.segments[number].curvature
        if number == last and abs(slope - found[-1].slope) <= SAME_SLOPE:
            found[-1] = found[-1]._replace(length=found[-1].length + length)
        else:
            found.append(Segment(curvature, length, slope))
        last = number
    return Path(path.start, tuple(found), path.repeats_from, asked.depth - float(depths[0]))


def _eased(s: Floats, depths: Floats, steepest: float, again: int | None) -> Floats:
    """Return the deepest course (n,), m, that is nowhere below `depths` (n,) at distances (n,), m,
    nor steeper than allowed (m/m); a tour is at its end as deep as where it repeats (its index).

    >>> s, wanted = np.arange(5.0), np.array([9.0, 9.0, 9.0, 5.0, 9.0])
    >>> _eased(s, wanted, 1.0, None).tolist()
    [8.0, 7.0, 6.0, 5.0, 6.0]
    """
    found = depths
    for _ in range(ROUNDS if again is not None else 1):
        found = np.minimum.accumulate(found - steepest * s) + steepest * s
        found = np.minimum.accumulate((found + steepest * s)[::-1])[::-1] - steepest * s
        if again is None:
            return found
        found[[again, -1]] = found[[again, -1]].min()
    return found
