"""Which ASV broadcasts the fixes of a round; the paper does not say."""

from collections.abc import Callable

import numpy as np

from ..vehicles.fleet import Fleet
from ..vehicles.motion import places
from .fix_queue import FixBatch

# ASVs whose distances to all fixes are worked out at a time.
BLOCK = 64

Choice = Callable[[int, FixBatch, Fleet, float, np.random.Generator], int]


def rotate(
    number: int, frame: FixBatch, asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Let the ASVs broadcast in turn, counted by broadcasts."""
    return number % len(asvs)


def random(
    number: int, frame: FixBatch, asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Draw the ASV by lot."""
    return int(draw.integers(len(asvs)))


def most_fixes(
    number: int, frame: FixBatch, asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Take the ASV that measured most of the fixes; the first of equals."""
    return int(np.argmax(frame.hearers(len(asvs)).sum(axis=0)))


def nearest(
    number: int, frame: FixBatch, asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Take the ASV with the least mean horizontal distance to the fixes; the first of equals."""
    if not len(frame):
        return 0
    goals = frame.positions[:, :2]
    vessels = places(asvs.motion, time)[:, :2]
    apart = [
        np.linalg.norm(vessels[k : k + BLOCK, None] - goals, axis=2).mean(axis=1)
        for k in range(0, len(vessels), BLOCK)
    ]
    return int(np.argmin(np.concatenate(apart)))


def fixed(number: int, frame: FixBatch, asvs: Fleet, time: float, draw: np.random.Generator) -> int:
    """Always take ASV0."""
    return 0


BROADCASTERS: dict[str, Choice] = {
    function.__name__: function for function in (rotate, random, most_fixes, nearest, fixed)
}
