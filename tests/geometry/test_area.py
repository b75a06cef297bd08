"""Areas to be surveyed, the lanes that sweep them, and how much of them is heard."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bindusbl_des import covered_area, covering_radius, formation
from bindusbl_des.core.geometry.area import polygon, rectangle
from bindusbl_des.core.geometry.coverage import coverage_map, is_covered, loneliest_point
from bindusbl_des.core.geometry.lanes import Ruling, equal_lengths, lane_count, strips
from bindusbl_des.core.geometry.routes import Turning, lawnmower

L_SHAPE = [(0.0, 0.0), (300.0, 0.0), (300.0, 100.0), (100.0, 100.0), (100.0, 250.0), (0.0, 250.0)]


@st.composite
def stars(draw: st.DrawFn) -> Any:
    """Draw a simple polygon, convex or not, somewhere: corners in order of bearing from a point."""
    count = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(30.0, 200.0), min_size=count, max_size=count))
    x, y = draw(st.floats(-300.0, 300.0)), draw(st.floats(-300.0, 300.0))
    bearings = 2.0 * math.pi * (np.arange(count) + draw(st.floats(0.0, 1.0))) / count
    return polygon(
        [(x + r * math.cos(b), y + r * math.sin(b)) for r, b in zip(radii, bearings, strict=True)]
    )


def grid(area: Any, count: int = 60) -> np.ndarray:
    """Return points within an area, shape (n, 2)."""
    box = area.box
    x, y = np.linspace(box.x_min, box.x_max, count), np.linspace(box.y_min, box.y_max, count)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return points[area.contains(points)]


def lengths(shares: list[Any]) -> list[float]:
    return [math.fsum(lane.x_max - lane.x_min for lane in share.lanes) for share in shares]


# ---------------------------------------------------------------- areas


def test_what_an_area_is() -> None:
    """An L of 45,000 m2: worked out by hand from its two rectangles."""
    area = polygon(L_SHAPE)
    assert area.square_m == pytest.approx(300 * 100 + 100 * 150)
    x, y = (300 * 100 * 150 + 100 * 150 * 50) / 45_000, (300 * 100 * 50 + 100 * 150 * 175) / 45_000
    assert area.centroid == pytest.approx((x, y))
    assert tuple(area.box) == (0.0, 0.0, 300.0, 250.0)
    assert area.across == pytest.approx(300.0)
    assert area.farthest == pytest.approx(math.hypot(300.0, 100.0))
    assert area.side is None
    assert area.words == "45,000 m2, a polygon of 6 corners"
    assert area.contains([(50.0, 200.0), (200.0, 200.0), (300.0, 50.0)]).tolist() == [
        True, False, True,
    ]  # fmt: skip
    assert area.beyond(200.0, 130.0) == pytest.approx(30.0)
    assert area.beyond(50.0, 50.0) == 0.0


def test_a_square_is_told_from_other_areas() -> None:
    """Only a square along the axes about the origin is the paper's; a turned one is another."""
    assert rectangle(140.0, 140.0).side == 140.0
    assert rectangle(140.0, 140.0).words == "140 m"
    for area in (rectangle(140.0, 100.0), rectangle(140.0, 140.0, 0.1), polygon(L_SHAPE[:4])):
        assert area.side is None
    assert rectangle(500.0, 300.0, math.radians(30)).words == "500 m by 300 m, turned by 30 deg"


@given(st.floats(1.0, 900.0), st.floats(1.0, 900.0), st.floats(-3.0, 3.0))
@settings(max_examples=50, deadline=None)
def test_a_rectangle_is_that_polygon(x: float, y: float, turn: float) -> None:
    """Closed forms of rectangles say what the polygon of the same corners says."""
    area = rectangle(x, y, turn)
    same = polygon(area.outline)
    assert area.square_m == pytest.approx(same.square_m, rel=1e-9)
    assert same.centroid == pytest.approx((0.0, 0.0), abs=1e-9 * (x + y))
    assert area.across == pytest.approx(max(x, y)) == pytest.approx(same.across, rel=1e-6)
    assert area.farthest == pytest.approx(same.farthest)


@given(stars())
@settings(max_examples=40, deadline=None)
def test_moments_are_those_of_shapely(area: Any) -> None:
    """Size and centroid by the shoelace formula, whichever way the corners go round."""
    for one in (area, polygon(area.corners[::-1])):
        assert one.square_m == pytest.approx(area.shape.area)
        assert one.centroid == pytest.approx((area.shape.centroid.x, area.shape.centroid.y))


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        ([(0, 0), (1, 1)], "at least three corners that differ; got 2"),
        ([(0, 0), (10, 0), (0, 0)], "at least three corners that differ; got 2"),
        ([(0, 0), (10, 10), (10, 0), (0, 10)], r"crosses or touches itself at \(5, 5\)"),
        ([(0, 0), (10, 0), (20, 0)], "crosses or touches itself"),
        ([(0, 0), (1e-4, 0), (0, 1e-4)], "are its corners in metres"),
        ([(0, 0), (100, 0), (100, 0.01), (0, 0.01)], "no area to be surveyed"),
    ],
)
def test_what_is_no_area_is_refused(corners: list[tuple[float, float]], message: str) -> None:
    """Crossing, flat and tiny polygons are mistakes, and say what is wrong with them."""
    with pytest.raises(ValueError, match=message):
        polygon(corners)


def test_a_closed_ring_is_taken() -> None:
    """As files have them: the last corner repeats the first."""
    assert polygon([*L_SHAPE, L_SHAPE[0]]) == polygon(L_SHAPE)


# ---------------------------------------------------------------- lanes


def test_strips_of_an_l() -> None:
    """By hand: strips 125 m high; lanes reach as far as the survey does in their band."""
    lower, upper = strips(polygon(L_SHAPE), Ruling(50.0, 25.0), 2)
    assert [tuple(lane) for lane in lower.lanes] == [(25.0, 25.0, 275.0), (75.0, 25.0, 275.0)]
    assert [tuple(lane) for lane in upper.lanes] == [(150.0, 25.0, 75.0), (200.0, 25.0, 75.0)]
    assert lower.centre == (150.0, 62.5)
    assert upper.centre == (50.0, 187.5)


def test_equal_lengths_of_an_l() -> None:
    """By hand: five lanes of 250, 250, 50, 50, 50 m; half of 650 m lies in the second lane, whose
    middle, at 375 m, is beyond it.
    """
    first, second = equal_lengths(polygon(L_SHAPE), Ruling(50.0, 25.0), 2)
    assert lengths([first, second]) == [250.0, 400.0]
    assert (first.centre, second.centre) == ((150.0, 25.0), (150.0, 150.0))
    with pytest.raises(ValueError, match="makes 5 lanes for 6 AUVs; narrow the spacing"):
        equal_lengths(polygon(L_SHAPE), Ruling(50.0, 25.0), 6)


def test_a_lane_is_flown_across_a_bay() -> None:
    """Where the survey leaves a lane and comes back, the lane goes straight on."""
    bay = polygon(
        [(0, 0), (300, 0), (300, 100), (200, 100), (200, 20), (100, 20), (100, 100), (0, 100)]
    )
    (share,) = equal_lengths(bay, Ruling(50.0, 0.0), 1)
    assert [tuple(lane) for lane in share.lanes] == [(25.0, 0.0, 300.0), (75.0, 0.0, 300.0)]


@given(stars(), st.floats(8.0, 60.0), st.integers(1, 3), st.floats(-3.1, 3.1))
@settings(max_examples=60, deadline=None)
def test_lanes_of_equal_length_leave_nothing_out(
    area: Any, spacing: float, total: int, heading: float
) -> None:
    """Every point is within half a spacing of a lane, up to the margin at its ends."""
    seen, margin = area.along(heading), spacing / 2
    if lane_count(seen.box.y_max - seen.box.y_min, spacing) < total:
        return
    shares = equal_lengths(seen, Ruling(spacing, margin), total)
    assert all(share.lanes for share in shares)
    lanes = np.array([lane for share in shares for lane in share.lanes])
    points = grid(seen)
    across = np.abs(points[:, 1, None] - lanes[:, 0]) <= spacing / 2 + 1e-6
    beyond = np.maximum(lanes[:, 1] - points[:, 0, None], points[:, 0, None] - lanes[:, 2])
    assert (across & (beyond <= margin + 1e-3)).any(axis=1).all()


@given(stars(), st.floats(5.0, 20.0), st.integers(2, 4))
@settings(max_examples=60, deadline=None)
def test_shares_are_of_equal_length_within_a_lane(area: Any, spacing: float, total: int) -> None:
    """No AUV flies more than a lane more, or less, than its part of all lanes."""
    assume(lane_count(area.box.y_max - area.box.y_min, spacing) >= total)  # else it is refused
    shares = equal_lengths(area, Ruling(spacing, spacing / 2), total)
    found = lengths(shares)
    longest = max(lane.x_max - lane.x_min for share in shares for lane in share.lanes)
    assert max(found) - sum(found) / total <= longest + 1e-9
    if longest < sum(found) / total:  # or each AUV has to have one
        assert sum(found) / total - min(found) <= longest + 1e-9


@given(stars(), st.floats(10.0, 40.0), st.integers(1, 3), st.floats(-3.1, 3.1))
@settings(max_examples=40, deadline=None)
def test_a_turned_survey_has_the_turned_plan(
    area: Any, spacing: float, total: int, angle: float
) -> None:
    """Corners and lanes turned together: the same lanes in their frame, as long a path."""
    cosine, sine = math.cos(angle), math.sin(angle)
    turned = polygon([(x * cosine - y * sine, x * sine + y * cosine) for x, y in area.corners])
    lanes, ways = [], []
    for one, heading in ((area, 0.0), (turned, angle)):
        seen = one.along(heading)
        share = strips(seen, Ruling(spacing, spacing / 2), total)[-1]
        path, _ = lawnmower(share, spacing, Turning(4.0), begin=share.centre, box=seen.box)
        lanes.append(np.array(share.lanes))
        ways.append(path.length)
    assert lanes[1] == pytest.approx(lanes[0], abs=1e-3)
    assert ways[1] == pytest.approx(ways[0], abs=0.1)


def test_a_turned_rectangle_has_the_turned_path() -> None:
    """A rectangle is planned in its own frame: but for the turn, paths are the same to the bit."""
    straight, slanted = rectangle(300.0, 200.0), rectangle(300.0, 200.0, 0.7)
    paths = []
    for area in (straight, slanted):
        seen = area.along(area.turn)
        share = strips(seen, Ruling(20.0, 10.0), 3)[1]
        path, _ = lawnmower(share, 20.0, Turning(4.0), begin=share.centre, box=seen.box)
        paths.append(path.turned(area.turn))
    assert paths[1].segments == paths[0].segments
    x, y, yaw = paths[0].end
    cosine, sine = math.cos(0.7), math.sin(0.7)
    assert paths[1].end == pytest.approx((x * cosine - y * sine, x * sine + y * cosine, yaw + 0.7))


def test_lanes_are_where_a_plan_says() -> None:
    """Between the distances that a plan gives for a lane, its path is straight along that lane."""
    share = strips(polygon(L_SHAPE), Ruling(50.0, 25.0), 1)[0]
    box = polygon(L_SHAPE).box
    path, lanes = lawnmower(
        share, 50.0, Turning(10.0, "bulb"), begin=(-40.0, 60.0), recovery=(10.0, 300.0), box=box
    )
    assert len(lanes) == len(share.lanes)
    for (begin, end), lane in zip(lanes, share.lanes, strict=True):
        places = path.sample(np.linspace(begin, end, 50))
        assert places[:, 1] == pytest.approx(lane.y)
        assert np.abs(np.cos(places[:, 2])) == pytest.approx(1.0)
        assert places[:, 0].min() >= lane.x_min - 1e-6
        assert places[:, 0].max() <= lane.x_max + 1e-6
    whole = [end - begin for begin, end in lanes[1:]]  # the first is joined on the way
    assert whole == pytest.approx([lane.x_max - lane.x_min for lane in share.lanes[1:]])
    assert path.start[:2] == (-40.0, 60.0)
    assert path.end[:2] == pytest.approx((10.0, 300.0))


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 2])
@pytest.mark.parametrize("moved", [(0.0, 0.0), (1000.0, -300.0)])
def test_sides_of_a_triangle_do_not_depend_on_where_it_lies(
    turn: float, moved: tuple[float, float]
) -> None:
    """All three rectangles about one are equally large: the longest counts."""
    corners = [(0.0, 0.0), (100.0, 0.0), (0.0, 60.0)]
    ahead, aside = math.cos(turn), math.sin(turn)
    lies = [
        (x * ahead - y * aside + moved[0], x * aside + y * ahead + moved[1]) for x, y in corners
    ]
    assert polygon(lies).across == pytest.approx(math.hypot(100.0, 60.0))


# ---------------------------------------------------------------- coverage

places = st.lists(st.tuples(*[st.floats(-300.0, 300.0)] * 2), min_size=1, max_size=7)


@given(stars(), places)
@settings(max_examples=60, deadline=None)
def test_the_loneliest_point_against_a_grid(area: Any, asvs: list[tuple[float, float]]) -> None:
    """No point of a grid is lonelier than the loneliest point, which is one of the survey's."""
    radius = covering_radius(area, asvs)
    apart = np.hypot(*(grid(area)[:, None] - np.array(asvs)).transpose(2, 0, 1)).min(axis=1)
    assert apart.max() <= radius + 1e-6
    assert area.beyond(*loneliest_point(area, asvs)) < 1e-6
    assert covered_area(area, asvs, radius + 1e-6) == pytest.approx(1.0, abs=1e-7)


@pytest.mark.parametrize("count", range(2, 13))
def test_asvs_on_a_ring_cover_an_area_as_any_others_do(count: int) -> None:
    """Where many are equally far from the middle: a rectangle, against a grid and round buffers."""
    area = rectangle(60.0, 61.0)
    for angle in np.linspace(0.05, 3.0, 7).tolist():
        asvs = formation(count, 50.0, angle)
        apart = np.hypot(*(grid(area)[:, None] - asvs).transpose(2, 0, 1)).min(axis=1)
        assert apart.max() <= covering_radius(area, asvs) <= apart.max() + 1.5
        discs = shapely.union_all(shapely.buffer(shapely.points(asvs), 45.0, quad_segs=256))
        expected = shapely.intersection(discs, area.shape).area / area.square_m
        assert covered_area(area, asvs, 45.0) == pytest.approx(expected, abs=1e-4)


@given(stars(), places, st.floats(1.0, 250.0))
@settings(max_examples=60, deadline=None)
def test_the_area_covered_is_that_of_round_buffers(
    area: Any, asvs: list[tuple[float, float]], reach: float
) -> None:
    """Against shapely's union of circles drawn with 4 x 256 corners."""
    discs = shapely.union_all(shapely.buffer(shapely.points(asvs), reach, quad_segs=256))
    expected = shapely.intersection(discs, area.shape).area / area.square_m
    assert covered_area(area, asvs, reach) == pytest.approx(expected, abs=2e-5 * len(asvs) + 1e-6)


@given(st.floats(20.0, 200.0), places, st.floats(1.0, 250.0))
@settings(max_examples=40, deadline=None)
def test_a_polygon_that_is_a_square_is_covered_as_one(
    side: float, asvs: list[tuple[float, float]], reach: float
) -> None:
    """Whoever draws it with its corners is told what its side tells."""
    square = polygon(rectangle(side, side).outline)
    assert covered_area(square, asvs, reach) == pytest.approx(
        covered_area(side, asvs, reach), abs=1e-6
    )
    assert covering_radius(square, asvs) == pytest.approx(covering_radius(side, asvs), abs=1e-6)
    assert covered_area(rectangle(side, side), asvs, reach) == covered_area(side, asvs, reach)


def test_the_map_leaves_out_what_is_no_survey() -> None:
    """The bay of an L is blank; the share of cells that are heard is about that of the area."""
    lines = coverage_map(polygon(L_SHAPE), [(50.0, 50.0)], 80.0, columns=60)
    assert len(lines) == 36
    assert lines[0] == "." * 24 + " " * 36
    cells = "".join(lines).replace(" ", "")
    heard = sum(cell in "o0" for cell in cells) / len(cells)
    expected = covered_area(polygon(L_SHAPE), [(50.0, 50.0)], 80.0)
    assert heard == pytest.approx(expected, abs=0.02)
    assert is_covered([(50.0, 50.0)], [(50.0, 50.0)], 80.0).all()
