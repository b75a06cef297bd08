"""The shortest way between two poses for a vehicle that cannot turn tighter than a radius.

Source: Dubins, Am. J. Math. 79, 1957; closed forms of Shkel and Lumelsky, Robotics and Autonomous
Systems 34, 2001.  L turns towards increasing yaw (from +x towards +y), R towards decreasing yaw.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

FULL = 2.0 * math.pi

# Turns this close to a full circle (rad) are rounding of no turn at all.
NO_TURN = 1e-9

Lengths = tuple[float, float, float]


@dataclass(frozen=True)
class DubinsPath:
    """A path of three segments: its word, such as "LSR", and their lengths (m)."""

    word: str
    lengths: Lengths
    radius: float

    @property
    def length(self) -> float:
        """Length of the path (m)."""
        return sum(self.lengths)

    def segments(self) -> Iterator[tuple[str, float]]:
        """Yield kind ("L", "S" or "R") and length (m) of each segment."""
        return zip(self.word, self.lengths, strict=True)


def shortest(start: Sequence[float], end: Sequence[float], radius: float) -> DubinsPath:
    """Return the shortest Dubins path between two poses (x, y in m, yaw in rad).

    >>> path = shortest((0, 0, 0), (0, 10, math.pi), 5.0)
    >>> path.word[0], round(path.length, 6)
    ('L', 15.707963)

    Raises:
        ValueError: when the radius is not positive or a pose is not finite.
    """
    if not (radius > 0 and all(map(math.isfinite, (*start, *end, radius)))):
        raise ValueError(
            f"a Dubins path needs finite poses and a positive radius, got {start}, {end}, {radius}"
        )
    dx, dy = end[0] - start[0], end[1] - start[1]
    bearing = math.atan2(dy, dx)
    leave, arrive = start[2] - bearing, end[2] - bearing
    candidates = list(_candidates(math.hypot(dx, dy) / radius, leave, arrive))
    word, turns = min(candidates, key=lambda candidate: sum(candidate[1]))
    lengths = (turns[0] * radius, turns[1] * radius, turns[2] * radius)
    return DubinsPath(word, lengths, radius)


def _turn(angle: float) -> float:
    turn = angle % FULL
    return 0.0 if FULL - turn < NO_TURN else turn


def _candidates(distance: float, leave: float, arrive: float) -> Iterator[tuple[str, Lengths]]:
    """Yield the feasible words with their normalised lengths (turns in rad, straights / radius)."""
    sin_l, cos_l, sin_a, cos_a = math.sin(leave), math.cos(leave), math.sin(arrive), math.cos(arrive)
    together = math.cos(leave - arrive)
    square = 2 + distance**2 - 2 * together
    outer = max(0.0, square + 2 * distance * (sin_l - sin_a))
    heading = math.atan2(cos_a - cos_l, distance + sin_l - sin_a)
    yield "LSL", (_turn(heading - leave), math.sqrt(outer), _turn(arrive - heading))
    outer = max(0.0, square + 2 * distance * (sin_a - sin_l))
    heading = math.atan2(cos_l - cos_a, distance - sin_l + sin_a)
    yield "RSR", (_turn(leave - heading), math.sqrt(outer), _turn(heading - arrive))
    inner = distance**2 - 2 + 2 * together
    if (square := inner + 2 * distance * (sin_l + sin_a)) >= 0:
        straight = math.sqrt(square)
        heading = math.atan2(-cos_l - cos_a, distance + sin_l + sin_a) - math.atan2(-2.0, straight)
        yield "LSR", (_turn(heading - leave), straight, _turn(heading - arrive))
    if (square := inner - 2 * distance * (sin_l + sin_a)) >= 0:
        straight = math.sqrt(square)
        heading = math.atan2(cos_l + cos_a, distance - sin_l - sin_a) - math.atan2(2.0, straight)
        yield "RSL", (_turn(leave - heading), straight, _turn(arrive - heading))
    for word, sign in (("RLR", 1.0), ("LRL", -1.0)):
        # LRL is RLR seen in a mirror: all yaws change sign
        cosine = (6 - distance**2 + 2 * together + sign * 2 * distance * (sin_l - sin_a)) / 8
        if abs(cosine) <= 1:
            middle = FULL - math.acos(cosine)
            heading = math.atan2(cos_l - cos_a, distance - sign * (sin_l - sin_a))
            first = _turn(sign * leave - heading + middle / 2)
            yield word, (first, middle, _turn(sign * (leave - arrive) - first + middle))
