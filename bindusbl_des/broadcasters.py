"""Which ASV broadcasts the fixes of a round; the paper does not say."""

from collections.abc import Callable, Sequence

import numpy as np

from .events import Fix
from .fleet import Fleet
from .motion import places

Choice = Callable[[int, Sequence[Fix], Fleet, float, np.random.Generator], int]


def rotate(
    number: int, fixes: Sequence[Fix], asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Let the ASVs broadcast in turn, counted by broadcasts."""
    return number % len(asvs)


def random(
    number: int, fixes: Sequence[Fix], asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Draw the ASV by lot."""
    return int(draw.integers(len(asvs)))


def most_fixes(
    number: int, fixes: Sequence[Fix], asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Take the ASV that measured most of the fixes; the first of equals."""
    names = [name for fix in fixes for name in fix.asvs.split()]
    return max(range(len(asvs)), key=lambda index: (names.count(f"ASV{index}"), -index))


def nearest(
    number: int, fixes: Sequence[Fix], asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Take the ASV with the least mean horizontal distance to the fixes; the first of equals."""
    if not fixes:
        return 0
    goals = np.array([(fix.x_m, fix.y_m) for fix in fixes])
    vessels = places(asvs.motion, time)[:, :2]
    distances = np.linalg.norm(vessels[:, None] - goals[None], axis=2).mean(axis=1)
    return int(np.argmin(distances))


def fixed(
    number: int, fixes: Sequence[Fix], asvs: Fleet, time: float, draw: np.random.Generator
) -> int:
    """Always take ASV0."""
    return 0


BROADCASTERS: dict[str, Choice] = {
    function.__name__: function for function in (rotate, random, most_fixes, nearest, fixed)
}
