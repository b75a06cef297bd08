"""Paths of straight lines and arcs by the distance travelled, and shortest (Dubins) paths."""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Floats
from ...support.facts import cached_property
from .area import Box, bounds, turned

# A path leaves out segments shorter than this (m): rounding.
SHORTEST_SEGMENT = 1e-9

QUARTER_TURN, FULL_TURN = math.pi / 2.0, 2.0 * math.pi

# A polyline cuts an arc into chords of at most this angle (rad), which leave the arc by at most a
# 3,000th of its radius.
PIECE = 0.05

# In Dubins paths, angles (rad) and lengths (radii) below this are rounding: an arc that lacks less
# than this of a full turn is no arc, and circles with closer centres are one circle.  A path ends
# within a few times this many radii of its goal.
ROUNDING = 1e-9

Turns = tuple[float, float, float]

# A segment as a row: its first point (m) and heading (rad), curvature (1/m), the distance along the
# path where it begins (m), its length (m); its height above the path's depth there (m), and slope.
_NUMBERS = ("x", "y", "yaw", "curvature", "begin", "length", "above", "slope")
PATH_ROW = np.dtype([(name, "f8") for name in _NUMBERS])


class Pose(NamedTuple):
    """A position (m) and a heading (rad, from +x towards +y)."""

    x: float
    y: float
    yaw: float

    def reversed(self) -> "Pose":
        """Return the pose at the same position with the opposite heading."""
        return Pose(self.x, self.y, self.yaw + math.pi)


class Segment(NamedTuple):
    """A piece of constant curvature (1/m, positive towards +yaw), of a horizontal length (m), with
    a slope (m down for each m along).
    """

    curvature: float
    length: float
    slope: float = 0.0


def _moved(pose: Pose, curvature: float, distance: float) -> Pose:
    """Return the pose a distance (m) along an arc, by its chord: curvature may be 0."""
    half = curvature * distance / 2.0
    chord = distance * (math.sin(half) / half) if half else distance
    heading = pose.yaw + half
    return Pose(
        pose.x + chord * math.cos(heading),
        pose.y + chord * math.sin(heading),
        pose.yaw + curvature * distance,
    )


@dataclass(frozen=True)
class Path:
    """A smooth path from a start pose along segments.

    A path with `repeats_from` is an endless tour: after its last segment it continues at that
    distance (m) along itself.

    >>> path = Path(Pose(0, 0, 0), (Segment(0.0, 10.0),))
    >>> path.at(4.0)
    Pose(x=4.0, y=0.0, yaw=0.0)
    """

    start: Pose
    segments: tuple[Segment, ...]
    repeats_from: float | None = None
    #: How far (m) above its depth it begins.
    above: float = 0.0

    def __post_init__(self) -> None:
        kept = tuple(s for s in self.segments if s.length > SHORTEST_SEGMENT)
        object.__setattr__(self, "segments", kept)  # frozen

    @cached_property
    def _joints(self) -> list[Pose]:
        """The poses at which the segments begin, and the end of the last."""
        poses = [self.start]
        for curvature, length, _ in self.segments:
            poses.append(_moved(poses[-1], curvature, length))
        return poses

    @cached_property
    def _distances(self) -> list[float]:
        """The distances (m) at which the segments begin, and the length of the path."""
        return list(accumulate((segment.length for segment in self.segments), initial=0.0))

    @property
    def length(self) -> float:
        """The length (m) of the path; of a tour, that of one lap with its approach."""
        return self._distances[-1]

    @property
    def end(self) -> Pose:
        """The pose at the end of the last segment."""
        return self._joints[-1]

    @property
    def box(self) -> Box:
        """The bounding box of the path (m): joints, and arcs where they are parallel to an axis."""
        places = list(self._joints)
        for start, (curvature, length, _) in zip(self._joints, self.segments, strict=False):
            if curvature == 0.0:
                continue
            turns = sorted((start.yaw, start.yaw + curvature * length))
            first, last = (turn / QUARTER_TURN for turn in turns)
            for quarter in range(math.ceil(first), math.floor(last) + 1):
                into = (quarter * QUARTER_TURN - start.yaw) / curvature
                places.append(_moved(start, curvature, min(max(into, 0.0), length)))
        return bounds([(place.x, place.y) for place in places])

    def at(self, distance: float) -> Pose:
        """Return the pose after `distance` (m); beyond the end the end's, or the next lap's."""
        if not self.segments:
            return self.start
        if distance >= self.length:
            first = self.repeats_from
            distance = (
                self.length if first is None else first + (distance - first) % (self.length - first)
            )
        index = min(bisect_right(self._distances, distance), len(self.segments)) - 1
        return _moved(
            self._joints[index],
            self.segments[index].curvature,
            distance - self._distances[index],
        )

    def _wrapped(self, distances: Floats) -> Floats:
        first = self.repeats_from
        if first is None:
            return np.minimum(distances, self.length)
        beyond = first + (distances - first) % (self.length - first)
        return np.where(distances < self.length, distances, beyond)

    def sample(self, distances: Floats) -> Floats:
        """Return x, y (m) and yaw (rad), (n, 3), at distances (n,), m: :meth:`at` for many."""
        if not self.segments:
            return np.tile(np.array(self.start), (len(distances), 1))
        along = self._wrapped(distances)
        starts = np.array(self._distances[:-1])
        index = np.searchsorted(starts, along, side="right") - 1
        x, y, yaw = np.array(self._joints[:-1])[index].T
        curvature = np.array([segment.curvature for segment in self.segments])[index]
        step = along - starts[index]
        half = curvature * step / 2.0
        chord = step * np.sinc(half / math.pi)  # as `_moved`
        return np.column_stack(
            (
                x + chord * np.cos(yaw + half),
                y + chord * np.sin(yaw + half),
                yaw + curvature * step,
            )
        )

    def heights(self, distances: Floats) -> Floats:
        """Return how far (m) above its depth the path is at distances (n,), m."""
        along, downs = self._wrapped(distances), np.zeros(1)
        if self.segments:
            downs = np.cumsum([0.0, *(part.length * part.slope for part in self.segments)])
        return self.above - np.interp(along, self._distances, downs)

    def line(self) -> Floats:
        """Return the path once through as a polyline (n, 2), m, with n >= 2.

        Its points are the joints and some along each arc.  Of several turns on one circle only the
        last are drawn.
        """
        ways = [np.zeros(1)]
        for begin, (curvature, length, _) in zip(self._distances, self.segments, strict=False):
            turns = abs(curvature) * length / FULL_TURN
            again = max(math.ceil(turns) - 2, 0) / turns if turns else 0.0
            pieces = math.ceil((1.0 - again) * turns * FULL_TURN / PIECE) or 1
            ways.append(begin + length * np.linspace(again, 1.0, pieces + 1)[1:])
        return self.sample(np.concatenate(ways if self.segments else [*ways, *ways]))[:, :2]

    def turned(self, angle: float) -> "Path":
        """Return the path rotated about the origin by an angle (rad)."""
        if angle == 0.0:
            return self
        start = Pose(*turned((self.start.x, self.start.y), angle), self.start.yaw + angle)
        return Path(start, self.segments, self.repeats_from, self.above)

    def reversed(self) -> "Path":
        """Return the path travelled from its end to its start."""
        backwards = tuple(
            Segment(-s.curvature, s.length, -s.slope) for s in reversed(self.segments)
        )
        down = sum(part.length * part.slope for part in self.segments)
        return Path(self.end.reversed(), backwards, above=self.above - down)


def through(poses: Sequence[Pose], radius: float) -> tuple[Path, list[float]]:
    """Return the path along Dubins curves through poses, and the distance (m) along it of each.

    `radius` is the turning radius (m).
    """
    curves = [dubins_segments(start, end, radius) for start, end in pairwise(poses)]
    passed = accumulate((sum(segment.length for segment in curve) for curve in curves), initial=0.0)
    return Path(poses[0], tuple(segment for curve in curves for segment in curve)), list(passed)


def dubins_segments(start: Pose, end: Pose, radius: float) -> tuple[Segment, Segment, Segment]:
    """Return the three segments of the shortest path between two poses with a turning radius (m).

    Segments that are not needed have length 0.  One of six words is always shortest; of equal ones
    the first in the order LSL, RSR, LSR, RSL, LRL, RLR is taken: L turns towards increasing yaw (to
    starboard in NED), R towards decreasing yaw, S goes straight. Source: L. E. Dubins, Am. J. Math.
    79, 497 (1957).

    Raises:
        ValueError: for a radius that is not positive and finite.

    >>> way = dubins_segments(Pose(0.0, 0.0, 0.0), Pose(0.0, 10.0, math.pi), 10.0)
    >>> [round(segment.curvature * segment.length, 3) for segment in way]
    [-0.723, 4.587, -0.723]
    """
    solved = _solved(start, end, radius)
    least = min(sum(turns) for turns in solved.values())
    word = next(word for word, turns in solved.items() if sum(turns) <= least + ROUNDING)
    return _curve(word, solved[word], radius)


def dubins_curves(start: Pose, end: Pose, radius: float) -> list[tuple[Segment, ...]]:
    """Return the curves of all words that join two poses, shortest first.

    Raises ValueError as :func:`dubins_segments` does.
    """
    solved = _solved(start, end, radius)
    words = sorted(solved, key=lambda word: sum(solved[word]))
    return [_curve(word, solved[word], radius) for word in words]


def _solved(start: Pose, end: Pose, radius: float) -> dict[str, Turns]:
    """Return for each word that joins the poses its turns (rad) and its straight (radii)."""
    if not 0.0 < radius < math.inf:
        raise ValueError(f"turning radius must be positive and finite; met {radius}; give metres")
    ahead, aside = (end.x - start.x) / radius, (end.y - start.y) / radius
    solved: dict[str, Turns] = {}
    for word, (solve, side) in _WORDS.items():
        turns = solve(ahead, side * aside, side * start.yaw, side * end.yaw)
        if turns is not None:
            solved[word] = turns
    return solved


def _curve(word: str, turns: Turns, radius: float) -> tuple[Segment, Segment, Segment]:
    bend = {"L": 1.0 / radius, "R": -1.0 / radius, "S": 0.0}
    first, second, third = (
        Segment(bend[kind], turn * radius) for kind, turn in zip(word, turns, strict=True)
    )
    return first, second, third


# The three words that begin with a left turn, in radii: start at the origin with heading `a`, end
# at (x, y) with heading `b`.  The centre of a left turn lies at (-sin, cos) from the vehicle.


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
    return (
        _wrapped(heading + middle / 2.0 - a),
        middle,
        _wrapped(b - heading + middle / 2.0),
    )


# Each word with its solver; a word that begins with a right turn is solved in mirror image (-1).
_WORDS: dict[str, tuple[Callable[[float, float, float, float], Turns | None], float]] = {
    "LSL": (_left_straight_left, 1.0),
    "RSR": (_left_straight_left, -1.0),
    "LSR": (_left_straight_right, 1.0),
    "RSL": (_left_straight_right, -1.0),
    "LRL": (_left_right_left, 1.0),
    "RLR": (_left_right_left, -1.0),
}


def _wrapped(angle: float) -> float:
    """Return an angle (rad) in [0, 2 pi); a full turn, but for rounding, is 0."""
    turned = angle % FULL_TURN
    return 0.0 if FULL_TURN - turned < ROUNDING else turned


def path_rows(path: Path) -> tuple[NDArray[np.void], int]:
    """Return a path as rows of PATH_ROW, and the index of the row where its tour repeats, or -1."""
    segments, again = list(path.segments), -1
    if path.repeats_from is not None:
        segments, again = _jointed(segments, path.repeats_from)
    if not segments:  # a point to hover at
        segments = [Segment(0.0, 0.0)]
    rows = np.zeros(len(segments), dtype=PATH_ROW)
    rows["curvature"], rows["length"], rows["slope"] = np.array(segments).T
    rows["begin"][1:] = np.cumsum(rows["length"][:-1])
    rows["above"][1:] = -np.cumsum((rows["length"] * rows["slope"])[:-1])
    if path.above:
        rows["above"] += path.above
    joints = Path(path.start, tuple(segments))._joints[: len(rows)]
    rows["x"], rows["y"], rows["yaw"] = np.array(joints).T
    return rows, again


def _jointed(segments: list[Segment], distance: float) -> tuple[list[Segment], int]:
    """Return the segments with a joint at a distance (m), and the index of the segment behind it.

    Raises:
        ValueError: when the distance is not before the end.
    """
    begin = 0.0
    for number, segment in enumerate(segments):
        into = distance - begin
        if into <= SHORTEST_SEGMENT:
            return segments, number
        if into < segment.length - SHORTEST_SEGMENT:
            halves = [
                segment._replace(length=into),
                segment._replace(length=segment.length - into),
            ]
            return segments[:number] + halves + segments[number + 1 :], number + 1
        begin += segment.length
    raise ValueError(
        f"a tour cannot repeat from {distance} m: its path is only {begin} m long; repeats_from "
        "must lie before the end"
    )
