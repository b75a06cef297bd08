"""Coming up to the surface on the way: up in circles, round and round there, and down again.

An AUV breaks off its path, circles about a place beside it, and takes the path up again where it
left it, as by the manoeuvre PopUp of IMC (LSTS toolchain).  Whole circles bring it back to the same
place and heading, so that nothing of its survey is left out.
"""

import math
from collections import deque
from dataclasses import replace
from typing import NamedTuple

from .paths import Path, Segment

# Rounding, in circles, that makes no further circle.
ROUNDING = 1e-9

# How often an AUV may come up on a path, which is planned as a whole before the mission.
MOST = 20_000


class Surfacing(NamedTuple):
    """After how much of its path (m) an AUV comes up, with which radius (m), from which depth (m),
    at which angle (rad), and for how far at least at the surface (m).
    """

    every: float
    radius: float
    depth: float
    angle: float
    stay: float

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The way up, along the surface, and down: whole circles to starboard."""
        slope, circle = math.tan(self.angle), 2.0 * math.pi * self.radius
        climb = self.depth / slope
        count = max(math.ceil((2.0 * climb + self.stay) / circle - ROUNDING), 1)
        ways = (climb, -slope), (count * circle - 2.0 * climb, 0.0), (climb, slope)
        return tuple(Segment(1.0 / self.radius, way, dip) for way, dip in ways)

    @property
    def length(self) -> float:
        """How long that is (m)."""
        return sum(segment.length for segment in self.segments)


def surfaced(path: Path, asked: Surfacing) -> tuple[Path, list[float]]:
    """Return a path from which an AUV comes up, and where on the old one it does (m).

    A tour comes up at least as often in each of its laps.

    Raises:
        ValueError: when it comes up more often than a path may.
    """
    count = math.ceil(path.length / asked.every)
    if count > MOST:
        raise ValueError(
            f"an AUV would come up {count:,} times on its path of {path.length / 1e3:,.3g} km; "
            f"{MOST:,} times at most: raise surface_every_s or shorten the path"
        )
    breaks = [k * asked.every for k in range(1, count + 1) if k * asked.every < path.length]
    first = path.repeats_from
    if first is not None:
        again = next((it for it in breaks if it > first), path.length)
        if again - first + path.length - max([first, *breaks]) > asked.every:
            breaks.append(path.length)
    segments, begin, left = list[Segment](), 0.0, deque(breaks)
    for number, segment in enumerate(path.segments):
        done, is_last = 0.0, number == len(path.segments) - 1
        while left and (left[0] <= begin + segment.length or is_last):
            into = min(left.popleft() - begin, segment.length)
            segments += (segment._replace(length=into - done), *asked.segments)
            done = into
        segments.append(segment._replace(length=segment.length - done))
        begin += segment.length
    if first is not None:
        first = moved(first, breaks, asked)
    return replace(path, segments=tuple(segments), repeats_from=first), breaks


def moved(distance: float, breaks: list[float], asked: Surfacing) -> float:
    """Return where on the new path a distance along the old one (m) is."""
    return distance + asked.length * sum(it < distance for it in breaks)
