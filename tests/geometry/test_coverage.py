"""Formations and what they hear of the survey square, against closed forms and fine grids."""

import json
import math
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bindusbl_des import Scenario, Setup, covered_area, covering_radius, formation
from bindusbl_des.core.geometry.area import rectangle
from bindusbl_des.core.geometry.coverage import coverage_map, is_covered
from bindusbl_des.core.geometry.formation import corner_distance, formation_radius_bound

Floats = NDArray[np.float64]
CHECKS: dict[str, Any] = json.loads(
    (Path(__file__).parents[1] / "reference" / "physics_checks.json").read_text()
)

sides = st.floats(20.0, 200.0)
hf_ranges = st.floats(1.0, 150.0)
places = st.tuples(st.floats(-120.0, 120.0), st.floats(-120.0, 120.0))
# Places on a lattice make ASVs coincide, circles touch and bisectors run along edges.
lattice = st.tuples(
    st.integers(-4, 4).map(lambda n: 25.0 * n), st.integers(-4, 4).map(lambda n: 25.0 * n)
)
fleets = st.lists(st.one_of(places, lattice), min_size=1, max_size=8)


def polygon(count: int, radius: float, degrees: float) -> Floats:
    return formation(count, radius, math.radians(degrees))


def grid_distances(side: float, asvs: Any, cells: int) -> Floats:
    """Return the distance of each cell's middle to its nearest ASV, shape (cells, cells)."""
    axis = side * ((np.arange(cells) + 0.5) / cells - 0.5)
    x, y = np.meshgrid(axis, axis)
    nearest = np.full_like(x, np.inf)
    for px, py in np.asarray(asvs, dtype=float):
        nearest = np.minimum(nearest, np.hypot(x - px, y - py))
    return nearest


def swept_area(side: float, asvs: Any, hf_range: float, lines: int = 4000) -> float:
    """Return the covered fraction by exact lengths on many lines of constant y."""
    y = side * ((np.arange(lines) + 0.5) / lines - 0.5)
    px, py = np.asarray(asvs, dtype=float).T
    off = np.abs(y[:, None] - py)
    chord = np.sqrt(np.maximum(hf_range**2 - off**2, 0.0))
    lower = np.clip(px - chord, -side / 2, side / 2)
    upper = np.clip(px + chord, -side / 2, side / 2)
    total = 0.0
    for low, high in zip(lower, upper, strict=True):
        end = -math.inf
        for a, b in sorted(zip(low, high, strict=True)):
            total += max(b - max(a, end), 0.0)
            end = max(end, b)
    return float(total / lines / side)


def clipped_disc(side: float, radius: float) -> float:
    """Return the area (m2) of a disc in the middle of a square, for L/2 <= R <= L/sqrt(2)."""
    half = side / 2.0
    segment = radius**2 * math.acos(half / radius) - half * math.sqrt(radius**2 - half**2)
    return math.pi * radius**2 - 4.0 * segment


# ---- formation


def test_formation_is_a_regular_polygon() -> None:
    """ASV 0 lies at the formation angle, the others follow towards +y at equal distances."""
    three = polygon(3, 50.0, 90.0)
    assert three.shape == (3, 2)
    assert three == pytest.approx(
        np.array([(0.0, 50.0), (-43.30127018922193, -25.0), (43.30127018922193, -25.0)])
    )
    assert polygon(4, 10.0, 0.0)[1] == pytest.approx((0.0, 10.0))


@given(st.integers(2, 20), st.floats(0.0, 500.0), st.floats(-10.0, 10.0))
def test_formation_is_centred(count: int, radius: float, angle: float) -> None:
    """Every ASV is one formation radius from the middle, and the middle is the fleet's mean."""
    fleet = formation(count, radius, angle)
    assert np.hypot(*fleet.T) == pytest.approx(np.full(count, radius))
    assert fleet.mean(axis=0) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_single_asv_stays_in_the_middle() -> None:
    """One ASV lies at the origin whatever the formation radius."""
    assert formation(1, 50.0, 1.0).tolist() == [[0.0, 0.0]]


def test_a_ring_is_one_range_and_a_clearance_from_the_middle() -> None:
    """The paper puts its ASVs there."""
    asked = {"name": "m", "acoustics": {"hf": {"range_m": 50.0}}}
    for clearance in (0.0, 2.5):
        keys = {**asked, "asvs": {"formation": {"clearance_m": clearance}}}
        stations = Setup(Scenario.model_validate(keys)).stations_m
        assert np.hypot(*np.transpose(stations)) == pytest.approx(50.0 + clearance, rel=1e-12)


def test_clearance_leaves_the_middle_unheard() -> None:
    """With any clearance two or more ASVs do not hear the middle of the survey."""
    for count in (2, 3, 4, 7):
        asvs = formation(count, 50.01, 0.3)
        assert not is_covered((0.0, 0.0), asvs, 50.0)
        assert covering_radius(10.0, asvs) > 50.0


@pytest.mark.parametrize(
    ("side", "hf_range", "bound"), [(60.0, 50.0, -10.0), (100.0, 50.0, 50.0), (80.0, 50.0, 10.0)]
)
def test_paper_bound(side: float, hf_range: float, bound: float) -> None:
    """The paper's bound on the formation radius has the paper's values."""
    assert formation_radius_bound(side, hf_range) == pytest.approx(bound)


@given(st.floats(20.0, 200.0), st.floats(1.0, 2.0))
def test_paper_bound_is_where_an_axis_asv_reaches_two_corners(side: float, ratio: float) -> None:
    """At the bound an ASV on the +x axis is one HF range from the two corners next to it."""
    hf_range = ratio * side / 2.0
    bound = formation_radius_bound(side, hf_range)
    for y in (-side / 2.0, side / 2.0):
        assert math.hypot(side / 2.0 - bound, y) == pytest.approx(hf_range)


def test_paper_bound_without_a_solution_says_why() -> None:
    """Where the HF range is less than half the side the paper's bound does not exist."""
    with pytest.raises(ValueError, match=r"half the side; met 50.0 m for a side of 140.0 m.*70.0"):
        formation_radius_bound(140.0, 50.0)


def test_corners_do_not_stand_for_the_square() -> None:
    """Two ASVs reach all corners of a 60 m square within 36.06 m and still miss a tenth of it."""
    asvs = polygon(2, 50.0, 0.0)
    assert corner_distance(60.0, asvs) == pytest.approx(math.hypot(20.0, 30.0))
    assert covering_radius(60.0, asvs) == pytest.approx(math.hypot(50.0, 30.0))
    assert covered_area(60.0, asvs, 50.0) == pytest.approx(0.8938, abs=5e-5)


def test_the_worst_corner_counts() -> None:
    """The corner distance is that of the corner farthest from its nearest ASV."""
    assert corner_distance(20.0, [(10.0, 10.0)]) == pytest.approx(math.hypot(20.0, 20.0))
    assert corner_distance(20.0, [(10.0, 10.0), (-10.0, -10.0)]) == pytest.approx(20.0)


@given(sides, fleets)
def test_covering_radius_is_at_least_the_corner_distance(side: float, asvs: Any) -> None:
    """The loneliest point of the square is at least as lonely as its loneliest corner."""
    assert covering_radius(side, asvs) >= corner_distance(side, asvs)


# ---- covering radius


@pytest.mark.parametrize("name", [name for name in CHECKS if name.startswith("covrad")])
def test_covering_radius_checks(name: str) -> None:
    """Covering radii of the paper's formations agree with independent values to nine digits."""
    count, radius, angle, side = (
        float(part.partition("=")[2].removesuffix("deg"))
        for part in name.removeprefix("covrad(").removesuffix(")").split(",")
    )
    found = covering_radius(side, polygon(int(count), radius, angle))
    assert found == pytest.approx(CHECKS[name]["value"], rel=1e-9)


@pytest.mark.parametrize(
    ("count", "ratio", "radius_ratio", "angle"),
    [
        (1, 0.5 * math.sqrt(2.0), 0.0, 0.0),
        (2, math.sqrt(5.0) / 4.0, 0.25, 0.0),
        (3, 0.511042610, (3.0 + math.sqrt(3.0)) / 12.0, 0.0),
        (4, 0.353553391, 0.353553391, 45.0),
    ],
)
def test_best_polygons(count: int, ratio: float, radius_ratio: float, angle: float) -> None:
    """The best polygons of one to four ASVs have their known covering radii, others none less."""
    side = 140.0
    best = covering_radius(side, polygon(count, radius_ratio * side, angle))
    assert best == pytest.approx(ratio * side, rel=1e-8)
    for radius in np.linspace(0.0, 100.0, 41):
        for degrees in (0.0, 10.0, 30.0, 45.0, 75.0):
            assert covering_radius(side, polygon(count, float(radius), degrees)) >= best - 1e-6


@given(sides, st.floats(0.0, 150.0))
def test_covering_radius_closed_forms(side: float, radius: float) -> None:
    """Two ASVs on the x axis and four on the diagonals leave the points of the closed forms."""
    half, diagonal = side / 2.0, radius / math.sqrt(2.0)
    two = max(math.hypot(half - radius, half), math.hypot(radius, half))
    # ASVs a micrometre from each other are one
    assert covering_radius(side, polygon(2, radius, 0.0)) == pytest.approx(two, abs=1e-6)
    four = max(radius, abs(half * math.sqrt(2.0) - radius), math.hypot(half - diagonal, diagonal))
    assert covering_radius(side, polygon(4, radius, 45.0)) == pytest.approx(four, abs=1e-6)


def test_covering_radius_of_collinear_and_equal_asvs() -> None:
    """ASVs in a row, or on one another, have no circle in common and still a covering radius."""
    row = [(-30.0, 0.0), (0.0, 0.0), (30.0, 0.0), (30.0, 0.0)]
    assert covering_radius(100.0, row) == pytest.approx(math.hypot(20.0, 50.0))
    assert covering_radius(100.0, [(0.0, 0.0)] * 4) == pytest.approx(50.0 * math.sqrt(2.0))


@settings(max_examples=60, deadline=None)
@given(sides, fleets)
@example(26.0, [(0.0, 0.0), (0.0, -1.192092896e-07), (0.0, 25.0)])
def test_covering_radius_against_a_grid(side: float, asvs: Any) -> None:
    """No cell of a grid is lonelier than the covering radius, and one is nearly as lonely.

    Of ASVs a micrometre from each other one counts.
    """
    cells = 200
    loneliest = grid_distances(side, asvs, cells).max()
    half_diagonal = side / cells / math.sqrt(2.0)
    assert loneliest - 1e-6 <= covering_radius(side, asvs) <= loneliest + half_diagonal + 1e-6


def test_covering_radius_of_fifty_asvs() -> None:
    """Fifty scattered ASVs leave the loneliest point that a fine grid finds."""
    asvs = np.random.default_rng(5).uniform(-50.0, 50.0, (50, 2))
    loneliest = grid_distances(100.0, asvs, 1000).max()
    assert loneliest <= covering_radius(100.0, asvs) <= loneliest + 0.05 * math.sqrt(2.0)


# ---- covered area

# HF range, side, ASVs, angle (deg): covered share (%) and covering radius (m), physics 3.2
TABLE = [
    (50, 60, 1, 0, 100.0, 42.43),
    (50, 60, 2, 0, 89.4, 58.31),
    (50, 60, 2, 30, 82.8, 60.83),
    (50, 60, 2, 45, 81.0, 65.57),
    (50, 60, 2, 60, 82.8, 60.83),
    (50, 60, 3, 0, 100.0, 50.00),
    (50, 60, 3, 45, 100.0, 50.00),
    (50, 60, 4, 0, 100.0, 50.00),
    (50, 100, 1, 0, 78.6, 70.71),
    (50, 100, 2, 0, 78.6, 70.71),
    (50, 100, 2, 30, 73.2, 76.38),
    (50, 100, 2, 45, 72.4, 86.60),
    (50, 100, 2, 90, 78.6, 70.71),
    (50, 100, 3, 0, 98.9, 54.28),
    (50, 100, 3, 45, 98.2, 62.96),
    (50, 100, 4, 0, 100.0, 50.00),
    (50, 140, 1, 0, 40.1, 98.99),
    (50, 140, 2, 0, 59.9, 86.02),
    (50, 140, 2, 30, 64.5, 98.68),
    (50, 140, 2, 45, 64.6, 110.91),
    (50, 140, 3, 0, 87.5, 72.80),
    (50, 140, 3, 45, 86.8, 85.73),
    (50, 140, 3, 90, 87.5, 72.80),
    (50, 140, 4, 0, 90.7, 72.80),
    (50, 140, 4, 30, 99.8, 52.32),
    (50, 140, 4, 45, 100.0, 50.00),
    (100, 60, 2, 0, 94.9, 104.4),
    (100, 60, 2, 45, 88.9, None),
    (100, 100, 2, 0, 91.3, 111.8),
    (100, 100, 2, 30, 85.5, None),
    (100, 140, 2, 0, 87.3, 122.1),
    (100, 140, 2, 45, 78.7, None),
]


@pytest.mark.parametrize(("hf_range", "side", "count", "angle", "percent", "lonely"), TABLE)
def test_table_of_formations(
    hf_range: float, side: float, count: int, angle: float, percent: float, lonely: float | None
) -> None:
    """The paper's formations cover what a 600 x 600 grid found, to its tenth of a per cent."""
    asvs = polygon(count, hf_range, angle)
    # 0.05 for the table's last digit, as much again for its grid
    assert 100.0 * covered_area(side, asvs, hf_range) == pytest.approx(percent, abs=0.1)
    if lonely is not None:
        digit = 0.05 if hf_range == 100 else 0.006
        assert covering_radius(side, asvs) == pytest.approx(lonely, abs=digit)


@pytest.mark.parametrize(
    ("side", "one", "two", "two_at_30", "three"),
    [
        (60.0, 1.0, 0.8938, 0.8275, 1.0),
        (100.0, 0.7854, 0.7854, 0.7321, 0.9890),
        (140.0, 0.4007, 0.5992, 0.6446, 0.8749),
    ],
)
def test_areas_to_four_digits(
    side: float, one: float, two: float, two_at_30: float, three: float
) -> None:
    """Formations of one to three ASVs cover the known shares of the paper's squares."""
    asked = ((1, 0.0, one), (2, 0.0, two), (2, 30.0, two_at_30), (3, 0.0, three))
    for count, angle, share in asked:
        found = covered_area(side, polygon(count, 50.0, angle), 50.0)
        assert found == pytest.approx(share, abs=1e-4)


def test_area_closed_forms() -> None:
    """Discs inside, clipped by the edges, apart and overlapping have their textbook areas."""
    assert covered_area(140.0, [(0, 0)], 50.0) == pytest.approx(math.pi * 2500 / 19600, rel=1e-14)
    assert covered_area(100.0, [(0, 0)], 50.0) == pytest.approx(math.pi / 4.0, rel=1e-14)
    clipped = clipped_disc(100.0, 60.0) / 1e4
    assert covered_area(100.0, [(0, 0)], 60.0) == pytest.approx(clipped, rel=1e-14)
    quarter = math.pi * 30.0**2 / 4.0 / 1e4
    assert covered_area(100.0, [(50, 50)], 30.0) == pytest.approx(quarter, rel=1e-14)
    half = math.pi * 30.0**2 / 2.0 / 1e4
    assert covered_area(100.0, [(-50, 0)], 30.0) == pytest.approx(half, rel=1e-14)
    disc = math.pi * 100.0
    assert covered_area(100.0, [(-20, 0), (20, 0)], 10.0) == pytest.approx(2 * disc / 1e4)
    lens = 2 * 400 * math.acos(10 / 20) - 10 * math.sqrt(4 * 400 - 20**2)
    union = (2 * math.pi * 400 - lens) / 1e4
    assert covered_area(100.0, [(-10, 0), (10, 0)], 20.0) == pytest.approx(union, rel=1e-14)


def test_area_of_equal_and_nearly_equal_asvs() -> None:
    """An ASV beside another, at no distance or a hair's breadth, hears no more."""
    alone = covered_area(140.0, [(10.0, 3.0)], 50.0)
    assert covered_area(140.0, [(10.0, 3.0)] * 3, 50.0) == alone
    for hair in (1e-15, 1e-13, 1e-9, 1e-6):
        pair = [(10.0, 3.0), (10.0 + 2 * hair, 3.0 - hair), (10.0, 3.0 + hair)]
        assert covered_area(140.0, pair, 50.0) == pytest.approx(alone, abs=1e-7)


def test_a_ring_leaves_a_hole() -> None:
    """Eight overlapping circles in a ring leave a hole in the middle that does not count."""
    asvs = polygon(8, 40.0, 11.0)
    assert not is_covered((0.0, 0.0), asvs, 20.0)
    found = covered_area(140.0, asvs, 20.0)
    assert found == pytest.approx(swept_area(140.0, asvs, 20.0), abs=2e-5)


@settings(max_examples=60, deadline=None)
@given(sides, fleets, hf_ranges)
def test_area_against_a_grid(side: float, asvs: Any, hf_range: float) -> None:
    """The covered area lies between the cells surely covered and those possibly covered."""
    cells = 300
    distances, half_diagonal = grid_distances(side, asvs, cells), side / cells / math.sqrt(2.0)
    found = covered_area(side, asvs, hf_range)
    assert np.mean(distances <= hf_range - half_diagonal) - 1e-9 <= found
    assert found <= np.mean(distances <= hf_range + half_diagonal) + 1e-9


@settings(max_examples=40, deadline=None)
@given(sides, fleets, hf_ranges)
def test_area_against_a_sweep(side: float, asvs: Any, hf_range: float) -> None:
    """The covered area is what exact lengths on 4000 lines add up to."""
    # Each circle's tops cost at most (step / side)^1.5 sqrt(8 R / side) of the square.
    step = 1.0 / 4000.0
    tolerance = 2.0 * len(asvs) * step**1.5 * math.sqrt(8.0 * hf_range / side) + 1e-6
    found = covered_area(side, asvs, hf_range)
    assert found == pytest.approx(swept_area(side, asvs, hf_range), abs=tolerance)


@settings(max_examples=60, deadline=None)
@given(sides, fleets, hf_ranges)
def test_symmetries_of_the_square(side: float, asvs: Any, hf_range: float) -> None:
    """Turning the fleet by quarter turns or mirroring it changes neither area nor radius."""
    fleet = np.asarray(asvs, dtype=float)
    apart = np.hypot(*(fleet[:, None] - fleet).transpose(2, 0, 1))
    assume(not ((apart > 0.0) & (apart < 1e-5)).any())  # within micrometres vessels are one
    area, radius = covered_area(side, fleet, hf_range), covering_radius(side, fleet)
    for moved in (
        fleet[:, ::-1],
        fleet * (1, -1),
        fleet * (-1, 1),
        -fleet,
        fleet[:, ::-1] * (-1, 1),
        fleet[::-1],
    ):
        assert covered_area(side, moved, hf_range) == pytest.approx(area, abs=1e-10)
        assert covering_radius(side, moved) == pytest.approx(radius, rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(sides, fleets, hf_ranges, hf_ranges, st.floats(0.2, 5.0))
def test_more_range_covers_more(
    side: float, asvs: Any, one: float, other: float, scale: float
) -> None:
    """More range, or one more ASV, never covers less; a sea drawn larger is covered alike."""
    near, far = sorted((one, other))
    area = covered_area(side, asvs, near)
    assert area <= covered_area(side, asvs, far) + 1e-10
    assert covered_area(side, asvs[1:] or asvs, near) <= area + 1e-10
    assert covering_radius(side, asvs) <= covering_radius(side, asvs[1:] or asvs) + 1e-9
    enlarged = covered_area(scale * side, scale * np.asarray(asvs), scale * near)
    assert enlarged == pytest.approx(area, abs=1e-8)


@settings(max_examples=60, deadline=None)
@given(sides, fleets)
def test_full_coverage_begins_at_the_covering_radius(side: float, asvs: Any) -> None:
    """Just above the covering radius the square is fully covered, clearly below it is not."""
    radius = covering_radius(side, asvs)
    assert covered_area(side, asvs, radius * (1 + 1e-9)) == pytest.approx(1.0, abs=1e-12)
    assert covered_area(side, asvs, radius * 0.98) < 1.0 - 1e-7


def test_three_asvs_are_the_same_at_four_angles() -> None:
    """Three ASVs at 0, 30, 60 and 90 degrees are one formation turned or mirrored; 45 is not."""
    for side in (100.0, 140.0):
        areas = [covered_area(side, polygon(3, 50.0, a), 50.0) for a in (0.0, 30.0, 60.0, 90.0)]
        assert areas == pytest.approx([areas[0]] * 4, abs=1e-12)
        assert abs(covered_area(side, polygon(3, 50.0, 45.0), 50.0) - areas[0]) > 5e-3


def test_three_discs_cannot_cover() -> None:
    """No polygon of three ASVs with 50 m range covers a 100 m square; four on diagonals do."""
    for radius in np.linspace(0.0, 70.0, 71):
        for degrees in range(0, 120, 5):
            asvs = polygon(3, float(radius), float(degrees))
            assert covering_radius(100.0, asvs) > 50.0
            assert covered_area(100.0, asvs, 50.0) < 1.0
    assert covered_area(100.0, polygon(4, 35.0, 45.0), 50.0) == 1.0


# ---- points and map


def test_points_are_covered_to_the_edge() -> None:
    """A point exactly one HF range away is heard, one a little farther is not, in any shape."""
    points = np.array([[(30.0, 40.0), (30.0, 40.001)], [(0.0, 0.0), (-50.0, 0.0)]])
    assert is_covered(points, [(0.0, 0.0)], 50.0).tolist() == [[True, False], [True, True]]
    assert is_covered((3.0, 4.0), [(0.0, 0.0), (90.0, 0.0)], 5.0).shape == ()


def test_covered_points_agree_with_the_area() -> None:
    """Of the middles of a million cells the covered share is the covered area."""
    axis = 140.0 * ((np.arange(1000) + 0.5) / 1000 - 0.5)
    points = np.stack(np.meshgrid(axis, axis), axis=-1)
    asvs = polygon(3, 50.0, 45.0)
    share = is_covered(points, asvs, 50.0).mean()
    assert share == pytest.approx(covered_area(140.0, asvs, 50.0), abs=2e-4)


def test_map_shows_what_is_heard() -> None:
    """A map has north up and east to the right, its ASVs in place and its shares right."""
    lines = coverage_map(140.0, [(60.0, 60.0), (0.0, -60.0)], 30.0)
    assert [len(line) for line in lines] == [48] * 24
    assert lines[1].index("0") == 44  # (60 + 70) / 140 of 48 columns, 10 m below the top
    assert lines[12].index("1") == 3
    assert lines[-1] == "." * 48  # nobody hears the lower edge
    text = "".join(coverage_map(140.0, polygon(3, 50.0, 0.0), 50.0, columns=200))
    heard = 1.0 - text.count(".") / len(text)
    assert heard == pytest.approx(covered_area(140.0, polygon(3, 50.0, 0.0), 50.0), abs=5e-3)
    assert text.count("#") > 0


@pytest.mark.parametrize(("high", "wide"), [(1e5, 0.1), (1e5, 1.0), (1e5, 3e4), (0.1, 1e5)])
def test_a_map_has_no_more_lines_than_columns(high: float, wide: float) -> None:
    """However long and narrow the survey is; its scale is that of both axes."""
    lines = coverage_map(rectangle(high, wide), [(0.0, 0.0)], 50.0)
    assert 1 <= len(lines) <= 48
    (columns,) = {len(line) for line in lines}
    assert 1 <= columns <= 48
    assert max(columns, len(lines)) == 48
    if min(columns, len(lines)) > 1:
        assert 2.0 * len(lines) / columns == pytest.approx(high / wide, rel=0.05)


def test_map_of_many_asvs() -> None:
    """Of twelve ASVs the last two are stars, two in a cell are one star, those outside are not."""
    ring = "".join(coverage_map(100.0, polygon(12, 40.0, 0.0), 1.0))
    assert [ring.count(mark) for mark in "0123456789*"] == [1] * 10 + [2]
    both = "".join(coverage_map(100.0, [(0.1, 0.1), (0.2, 0.2), (99.0, 0.0)], 1.0))
    assert [both.count(mark) for mark in "012*"] == [0, 0, 0, 1]
    corner = coverage_map(100.0, [(50.0, -50.0), (-50.0, 50.0)], 1.0, columns=10)
    assert corner[0][0] == "0"  # in the north-west
    assert corner[-1][-1] == "1"
    assert len(coverage_map(100.0, [(0.0, 0.0)], 1.0, columns=1)) == 1


def test_impossible_geometry_is_refused() -> None:
    """There is no square without extent, range below nothing, ASV nowhere or fleet of none."""
    asvs = [(0.0, 0.0)]
    for side in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match=f"side must be positive and finite; met {side}"):
            covering_radius(side, asvs)
        with pytest.raises(ValueError, match=r"side must be positive"):
            covered_area(side, asvs, 50.0)
    with pytest.raises(ValueError, match=r"HF range must .* met -1.0; give it in metres"):
        covered_area(10.0, asvs, -1.0)
    with pytest.raises(ValueError, match=r"HF range must .* met nan"):
        is_covered((0.0, 0.0), asvs, math.nan)
    with pytest.raises(ValueError, match=r"n >= 1; met \(0, 2\)"):
        covering_radius(10.0, np.zeros((0, 2)))
    with pytest.raises(ValueError, match=r"met \(1, 3\)"):
        corner_distance(10.0, [(1.0, 2.0, 3.0)])
    with pytest.raises(ValueError, match=r"must be finite; met .*nan"):
        covered_area(10.0, [(math.nan, 0.0)], 1.0)
    with pytest.raises(ValueError, match=r"points must have the shape .* met \(3,\)"):
        is_covered((1.0, 2.0, 3.0), asvs, 1.0)
    with pytest.raises(ValueError, match=r"at least one column; met 0"):
        coverage_map(10.0, asvs, 1.0, columns=0)


def test_impossible_formations_are_refused() -> None:
    """No formation has no ASV, a radius below nothing or an angle that is no number."""
    with pytest.raises(ValueError, match=r"at least one ASV; met 0"):
        formation(0, 50.0)
    with pytest.raises(ValueError, match=r"formation radius must .* met -50.0; give it in metres"):
        formation(3, -50.0)
    with pytest.raises(ValueError, match=r"angle must be finite; met nan; give radians"):
        formation(3, 50.0, math.nan)
    with pytest.raises(ValueError, match=r"side must .* met -1.0"):
        formation_radius_bound(-1.0, 50.0)


def test_the_area_of_many_asvs_needs_little_memory() -> None:
    """A thousand ASVs: no array of ASVs by ASVs, in which arcs were looked up one by one."""
    ring = formation(1000, 50.0)
    tracemalloc.start()
    assert covered_area(140.0, ring, 50.0) == pytest.approx(1.0)
    assert len(coverage_map(140.0, ring, 50.0)) == 24
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6
