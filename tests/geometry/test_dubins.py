"""Shortest ways with a turning radius against outside cases and the geometry of the plane."""

import csv
import math
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad  # type: ignore[import-untyped,unused-ignore]

from bindusbl_des.core.geometry import paths
from bindusbl_des.core.geometry.paths import Segment, dubins_segments
from bindusbl_des.core.vehicles.vehicle import kinematic

REFERENCE = Path(__file__).parents[1] / "reference" / "dubins_cases.csv"
# The cases are written with 12 digits of lengths up to 1000 m, their pieces with 9.
LENGTH_TOLERANCE, PIECE_TOLERANCE = 1e-8, 1e-6

coordinates = st.floats(-100.0, 100.0)
headings = st.floats(-10.0, 10.0)
poses = st.tuples(coordinates, coordinates, headings)
radii = st.floats(0.5, 40.0)
# Poses on a lattice make pieces vanish, circles touch and coincide.
lattice_poses = st.tuples(
    st.integers(-4, 4).map(lambda n: 5.0 * n),
    st.integers(-4, 4).map(lambda n: 5.0 * n),
    st.integers(-4, 4).map(lambda n: n * math.pi / 2.0),
)
any_pose = st.one_of(poses, lattice_poses)
any_radius = st.one_of(radii, st.sampled_from([2.5, 5.0, 10.0]))
Pose = tuple[float, float, float]
Case = tuple[Pose, Pose, float, float, str, tuple[float, float, float]]


class Way(NamedTuple):
    """The shortest way from a pose, by its three segments."""

    start: Pose
    segments: tuple[Segment, ...]

    @property
    def word(self) -> str:
        return "".join("S" if not it.curvature else "RL"[it.curvature > 0] for it in self.segments)

    @property
    def lengths(self) -> list[float]:
        return [it.length for it in self.segments]

    @property
    def length(self) -> float:
        return sum(self.lengths)

    def at(self, distance: float) -> Pose:
        return paths.Path(paths.Pose(*self.start), self.segments).at(distance)


def shortest(start: Pose, end: Pose, radius: float) -> Way:
    return Way(start, dubins_segments(paths.Pose(*start), paths.Pose(*end), radius))


def cases() -> list[Case]:
    lines = [line for line in REFERENCE.read_text().splitlines() if not line.startswith("#")]
    found: list[Case] = []
    for row in csv.DictReader(lines):
        x0, y0, th0, x1, y1, th1, rho, length, s1, s2, s3 = (
            float(row[name])
            for name in ("x0", "y0", "th0", "x1", "y1", "th1", "rho", "length", "s1", "s2", "s3")
        )
        found.append(((x0, y0, th0), (x1, y1, th1), rho, length, row["word"], (s1, s2, s3)))
    return found


def apart(one: Pose, other: Pose) -> float:
    """Return how much two poses differ: metres or radians, whichever is more."""
    turn = math.remainder(one[2] - other[2], 2.0 * math.pi)
    return max(math.hypot(one[0] - other[0], one[1] - other[1]), abs(turn))


def integrated(path: Way) -> Pose:
    """Return the end of a path by numerical integration of its heading."""
    x, y, yaw = path.start
    for rate, length, _ in path.segments:
        x += quad(lambda s, a=yaw, k=rate: math.cos(a + k * s), 0.0, length, epsabs=1e-10)[0]
        y += quad(lambda s, a=yaw, k=rate: math.sin(a + k * s), 0.0, length, epsabs=1e-10)[0]
        yaw += rate * length
    return x, y, yaw


def test_there_are_205_cases() -> None:
    """The outside cases are all there and use all six words."""
    assert len(cases()) == 205
    assert {case[4] for case in cases()} == {"LSL", "RSR", "LSR", "RSL", "LRL", "RLR"}


@pytest.mark.parametrize("case", cases())
def test_outside_cases(case: Case) -> None:
    """A vehicle's shortest way has the length of the outside case and leads to its end."""
    start, end, radius, length, word, pieces = case
    path = shortest(start, end, radius)
    assert path.length == pytest.approx(length, abs=LENGTH_TOLERANCE)
    assert apart(integrated(path), end) < 1e-8
    assert apart(path.at(path.length), end) < 1e-11
    assert path.word == word
    assert path.lengths == pytest.approx(pieces, abs=PIECE_TOLERANCE)


@pytest.mark.parametrize(("spacing", "length"), [(10.0, 134.5), (30.0, 103.3), (40.0, 62.8)])
def test_turns_between_lanes(spacing: float, length: float) -> None:
    """Turning onto a lane closer than twice the radius takes a bulb, longer than a half circle."""
    path = shortest((0.0, 0.0, 0.0), (0.0, spacing, math.pi), 20.0)
    assert path.length == pytest.approx(length, abs=0.05)
    assert path.word == ("LSL" if spacing == 40.0 else "RLR")


def test_left_turns_towards_increasing_yaw() -> None:
    """A quarter circle from +x to +y is a left turn and ends one radius ahead and aside."""
    path = shortest((0.0, 0.0, 0.0), (10.0, 10.0, math.pi / 2.0), 10.0)
    assert path.length == pytest.approx(5.0 * math.pi)
    assert [kind for kind, length in zip(path.word, path.lengths, strict=True) if length] == ["L"]
    assert path.at(2.5 * math.pi) == pytest.approx(
        (10.0 * math.sin(math.pi / 4), 10.0 * (1 - math.cos(math.pi / 4)), math.pi / 4)
    )


@given(any_pose, any_radius, st.integers(-3, 3))
def test_equal_poses_need_no_way(pose: Pose, radius: float, turns: int) -> None:
    """A vehicle that is where it should be, full turns of heading aside, stays."""
    same = (pose[0], pose[1], pose[2] + 2.0 * math.pi * turns)
    assert shortest(pose, same, radius).length < 1e-8 * radius


@settings(max_examples=300)
@given(any_pose, any_pose, any_radius)
def test_way_leads_to_its_end(start: Pose, end: Pose, radius: float) -> None:
    """A shortest way ends where it should and is never shorter than the straight line."""
    path = shortest(start, end, radius)
    assert apart(path.at(path.length), end) < 1e-8 * max(radius, 1.0)
    assert path.length >= math.dist(start[:2], end[:2]) - 1e-7
    assert min(path.lengths) >= 0.0


@settings(max_examples=300)
@given(any_pose, any_pose, any_radius, st.floats(0.0, 1.0))
def test_parts_of_a_shortest_way_are_shortest(
    start: Pose, end: Pose, radius: float, share: float
) -> None:
    """From any place on a shortest way, no shorter way leads back to its start or on to its end."""
    path = shortest(start, end, radius)
    # a hair behind is a whole circle away, and a rounding decides which of the two it is
    assume(apart(start, end) > 1e-3 * radius or path.length < 1e-3 * radius)
    for done in (share * path.length, path.lengths[0], path.lengths[0] + path.lengths[1]):
        middle = path.at(done)
        rest = path.length - done
        assert shortest(start, middle, radius).length == pytest.approx(done, abs=1e-6)
        assert shortest(middle, end, radius).length == pytest.approx(rest, abs=1e-6)


@given(any_pose, any_pose, any_pose, any_radius)
def test_detours_are_never_shorter(start: Pose, via: Pose, end: Pose, radius: float) -> None:
    """Passing through a third pose never shortens the way."""
    detour = shortest(start, via, radius).length + shortest(via, end, radius).length
    assert shortest(start, end, radius).length <= detour + 1e-6


@given(poses, poses, radii, headings, st.floats(0.1, 10.0))
def test_ways_keep_their_shape(
    start: Pose, end: Pose, radius: float, turn: float, scale: float
) -> None:
    """Mirroring, travelling backwards, turning or enlarging the sea changes ways accordingly."""

    def turned(pose: Pose) -> Pose:
        x, y, yaw = pose
        c, s = math.cos(turn), math.sin(turn)
        return scale * (c * x - s * y), scale * (s * x + c * y), yaw + turn

    def mirrored(pose: Pose) -> Pose:
        return pose[0], -pose[1], -pose[2]

    def backwards(pose: Pose) -> Pose:
        return pose[0], pose[1], pose[2] + math.pi

    length = shortest(start, end, radius).length
    # A way is not a continuous function of its ends: there rounding may cost a full circle.
    if shortest(start, (end[0] + 1e-9, end[1], end[2] + 1e-9), radius).length > length + 1e-3:
        return
    moved = shortest(turned(start), turned(end), scale * radius).length
    assert moved == pytest.approx(scale * length, abs=1e-5)
    flipped = shortest(mirrored(start), mirrored(end), radius).length
    assert flipped == pytest.approx(length, abs=1e-9)
    reverse = shortest(backwards(end), backwards(start), radius).length
    assert reverse == pytest.approx(length, abs=1e-5)


@given(st.floats(-1e-10, 1e-10), st.floats(-1e-10, 1e-10), st.floats(-1e-10, 1e-10))
def test_rounding_costs_no_full_circle(ahead: float, aside: float, turn: float) -> None:
    """Ends that are off by rounding lengthen a straight way or an arc by no more than that."""
    straight = shortest((0.0, 0.0, 0.0), (50.0 + ahead, aside, turn), 10.0)
    assert straight.length == pytest.approx(50.0, abs=1e-8)
    arc = shortest((0.0, 0.0, 0.0), (10.0 + ahead, 10.0 + aside, math.pi / 2.0 + turn), 10.0)
    assert arc.length == pytest.approx(5.0 * math.pi, abs=1e-7)
    none = shortest((0.0, 0.0, 0.0), (ahead, aside, turn), 10.0)
    assert none.length < 1e-8


def test_place_along_a_way() -> None:
    """A vehicle begins at the start, stays at the end, and its heading never jumps."""
    path = shortest((1.0, 2.0, 3.0), (-20.0, 15.0, -1.0), 8.0)
    assert path.at(0.0) == path.start == (1.0, 2.0, 3.0)
    assert path.at(path.length + 100.0) == path.at(path.length)
    steps = [path.at(path.length * n / 1000.0) for n in range(1001)]
    step = path.length / 1000.0
    for one, other in pairwise(steps):
        assert abs(other[2] - one[2]) <= step / 8.0 + 1e-12
        assert math.dist(one[:2], other[:2]) == pytest.approx(step, rel=1e-3)


def test_a_path_is_a_line_of_few_places_however_long_it_is() -> None:
    """Straight parts by their ends, a circle once: each place of the path is near the line."""
    turns = (Segment(0.0, 3e7), Segment(0.2, 5.0 * 2.7), Segment(-0.1, 10.0 * 6000.3 * math.pi))
    path = paths.Path(paths.Pose(1.0, 2.0, 0.0), turns)
    line = path.line()
    assert len(line) < 400
    assert line[0].tolist() == [1.0, 2.0]
    assert line[-1] == pytest.approx(path.end[:2])
    along = np.concatenate([np.linspace(0.0, 3e7, 50), 3e7 + np.linspace(0.0, 200.0, 500)])
    places = shapely.points(path.sample(along)[:, :2])
    assert shapely.distance(shapely.LineString(line), places).max() < 10.0 / 3000.0
    assert paths.Path(path.start, ()).line().tolist() == [[1.0, 2.0]] * 2


def test_impossible_ways_are_refused() -> None:
    """No vehicle turns on the spot."""
    for radius in (0.0, -5.0, math.nan, math.inf):
        with pytest.raises(ValueError, match=f"turning radius must be positive .* met {radius}"):
            shortest((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), radius)


@pytest.mark.parametrize("yaw", [0.0, 1.0, math.pi / 2.0, -3.0])
@pytest.mark.parametrize(
    "curvature", [5e-324, 1e-300, 1.4e-17, -1e-15, 1e-12, -1e-9, 1e-6, 1e-3, -0.1, 2.0]
)
def test_an_arc_is_where_its_heading_leads_however_little_it_bends(
    curvature: float, yaw: float
) -> None:
    """Places of paths, one by one and many at once, their bounds, and of vehicles that follow them,
    with the integrals of their headings: against quadrature.
    """
    start, along = paths.Pose(3.0, -2.0, yaw), np.array([0.0, 1e-9, 1e-3, 0.7, 50.5, 60.0])
    path = paths.Path(start, (Segment(curvature, 60.0),))
    exact = np.array([
        [start.x + quad(lambda s: math.cos(yaw + curvature * s), 0.0, way, limit=200)[0],
         start.y + quad(lambda s: math.sin(yaw + curvature * s), 0.0, way, limit=200)[0],
         yaw + curvature * way]
        for way in along.tolist()
    ])  # fmt: skip
    assert path.sample(along) == pytest.approx(exact, abs=1e-9)
    assert np.array([path.at(way) for way in along.tolist()]) == pytest.approx(exact, abs=1e-9)
    speed = 2.0
    vehicle = kinematic(path, speed, 5.0)
    times = along / speed
    there = vehicle.sample(times)
    assert there[:, [0, 1, 3]] == pytest.approx(exact, abs=1e-9)
    heading = (exact[:, :2] - exact[0, :2]) / speed
    assert vehicle.heading_integral(times) == pytest.approx(heading, abs=1e-9)
    box, places = path.box, path.sample(np.linspace(0.0, 60.0, 601))
    low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    found = [(box.x_min, box.y_min), (box.x_max, box.y_max)]
    assert np.array(found) == pytest.approx(np.array([low, high]), abs=0.02)
