"""The shortest way from one pose to another for a vehicle that cannot turn on the spot.

Poses are (x, y, yaw) in m and rad, yaw from +x towards +y.  'L' turns towards increasing yaw (to
the left on a plane with y to the left of x; to starboard in NED, where y is East), 'R' towards
decreasing yaw, 'S' goes straight.
Source: L. E. Dubins, Am. J. Math. 79, 497 (1957): one of six words is always shortest.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

Pose = tuple[float, float, float]
Turns = tuple[float, float, float]

FULL_TURN = 2.0 * math.pi

# Angles (rad) and lengths (radii) below this are rounding: an arc that misses a full turn by less
# is no arc, and circles whose middles are closer are one circle.  Ends are met within a few times
# this many radii.
ROUNDING = 1e-9


@dataclass(frozen=True)
class DubinsPath:
    """A way of three pieces: `word` names them, `lengths` (m) says how long each is.

    >>> DubinsPath("LSR", (5.0, 10.0, 5.0), 8.0, (0.0, 0.0, 0.0)).length
    20.0
    """

    word: str
    lengths: tuple[float, float, float]
    radius: float
    start: Pose

    @property
    def length(self) -> float:
        """Length of the whole way (m)."""
        return sum(self.lengths)

    def segments(self) -> tuple[tuple[str, float], ...]:
        """Return the three pieces in order, each ('L', 'S' or 'R', length in m, 0 if not needed).

        >>> DubinsPath("LSR", (5.0, 10.0, 5.0), 8.0, (0.0, 0.0, 0.0)).segments()
        (('L', 5.0), ('S', 10.0), ('R', 5.0))
        """
        return tuple(zip(self.word, self.lengths, strict=True))

    def at(self, distance: float) -> Pose:
        """Return the pose (m, rad) after `distance` (m) along the way; past its end, the end.

        Yaw is continuous along the way and not wrapped.  Raises ValueError for a distance that is
        negative or not finite.

        >>> DubinsPath("LSR", (0.0, 10.0, 0.0), 8.0, (1.0, 2.0, 0.0)).at(4.0)
        (5.0, 2.0, 0.0)
        """
        if not 0.0 <= distance < math.inf:
            raise ValueError(
                f"distance must be a finite number not below 0; met {distance}; the way begins at "
                "0 m"
            )
        pose = self.start
        for kind, length in self.segments():
            pose = _moved(pose, kind, min(distance, length), self.radius)
            distance = max(distance - length, 0.0)
        return pose


def shortest(start: Sequence[float], end: Sequence[float], radius: float) -> DubinsPath:
    """Return the shortest way between two poses whose turns are never tighter than `radius` (m).

    Poses begin with x, y (m) and yaw (rad).  Of words of equal length the first in the order LSL,
    RSR, LSR, RSL, LRL, RLR is taken.  Equal poses give a way of length 0.  Raises ValueError for a
    radius that is not positive and for poses that are not finite.

    >>> way = shortest((0.0, 0.0, 0.0), (0.0, 10.0, math.pi), 10.0)
    >>> way.word, round(way.length, 3)
    ('RLR', 60.325)
    """
    x, y, yaw = _pose("start", start)
    to_x, to_y, to_yaw = _pose("end", end)
    if not 0.0 < radius < math.inf:
        raise ValueError(f"turning radius must be positive and finite; met {radius}; give metres")
    ahead, aside = (to_x - x) / radius, (to_y - y) / radius
    ways: dict[str, Turns] = {}
    for word, (solve, side) in _WORDS.items():
        turns = solve(ahead, side * aside, side * yaw, side * to_yaw)
        if turns is not None:
            ways[word] = turns
    least = min(sum(turns) for turns in ways.values())
    word = next(word for word, turns in ways.items() if sum(turns) <= least + ROUNDING)
    first, second, third = ways[word]
    return DubinsPath(word, (first * radius, second * radius, third * radius), radius, (x, y, yaw))


# The three words that begin with a left turn, in radii: start at the origin with heading `a`, end
# at (x, y) with heading `b`.  The middle of a left turn lies at (-sin, cos) from the vehicle.


def _left_straight_left(x: float, y: float, a: float, b: float) -> Turns | None:
    between_x, between_y = x - math.sin(b) + math.sin(a), y + math.cos(b) - math.cos(a)
    straight = math.hypot(between_x, between_y)
    if straight < ROUNDING:  # both turns on one circle
        return _wrapped(b - a), 0.0, 0.0
    heading = math.atan2(between_y, between_x)
    return _wrapped(heading - a), straight, _wrapped(b - heading)


def _left_straight_right(x: float, y: float, a: float, b: float) -> Turns | None:
    between_x, between_y = x + math.sin(b) + math.sin(a), y - math.cos(b) - math.cos(a)
    apart = math.hypot(between_x, between_y)
    if apart < 2.0 - ROUNDING:  # circles overlap: no inner tangent
        return None
    straight = math.sqrt(max((apart - 2.0) * (apart + 2.0), 0.0))
    heading = math.atan2(between_y, between_x) + math.atan2(2.0, straight)
    return _wrapped(heading - a), straight, _wrapped(heading - b)


def _left_right_left(x: float, y: float, a: float, b: float) -> Turns | None:
    between_x, between_y = x - math.sin(b) + math.sin(a), y + math.cos(b) - math.cos(a)
    apart = math.hypot(between_x, between_y)
    if apart > 4.0 + ROUNDING:  # no third circle touches both
        return None
    middle = FULL_TURN - 2.0 * math.asin(min(apart / 4.0, 1.0))  # more than half a turn
    heading = math.atan2(between_y, between_x)  # halfway through the middle turn
    return _wrapped(heading + middle / 2.0 - a), middle, _wrapped(b - heading + middle / 2.0)


# Each word with its solver; a word that begins with a right turn is its mirror image's (-1).
_WORDS: dict[str, tuple[Callable[[float, float, float, float], Turns | None], float]] = {
    "LSL": (_left_straight_left, 1.0),
    "RSR": (_left_straight_left, -1.0),
    "LSR": (_left_straight_right, 1.0),
    "RSL": (_left_straight_right, -1.0),
    "LRL": (_left_right_left, 1.0),
    "RLR": (_left_right_left, -1.0),
}


def _wrapped(angle: float) -> float:
    """Return an angle in [0, 2 pi), a full turn up to rounding being none."""
    turned = angle % FULL_TURN
    return 0.0 if FULL_TURN - turned < ROUNDING else turned


def _moved(pose: Pose, kind: str, distance: float, radius: float) -> Pose:
    x, y, yaw = pose
    if kind == "S":
        return x + distance * math.cos(yaw), y + distance * math.sin(yaw), yaw
    side = radius if kind == "L" else -radius
    turned = yaw + distance / side
    return (
        x + side * (math.sin(turned) - math.sin(yaw)),
        y - side * (math.cos(turned) - math.cos(yaw)),
        turned,
    )


def _pose(name: str, pose: Sequence[float]) -> Pose:
    x, y, yaw = float(pose[0]), float(pose[1]), float(pose[2])
    if not math.isfinite(x + y + yaw):
        raise ValueError(f"{name} must be finite; met {(x, y, yaw)}; give x, y in m and yaw in rad")
    return x, y, yaw
