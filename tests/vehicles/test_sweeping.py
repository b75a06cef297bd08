"""What of a survey is swept, and when: against areas worked out by hand and by shapely."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bindusbl_des.geometry.area import polygon, rectangle
from bindusbl_des.geometry.paths import Path, Pose, Segment
from bindusbl_des.vehicles.sweeping import sweep
from bindusbl_des.vehicles.vehicle import Place, kinematic, moored, recorded


def test_one_lane_sweeps_its_swath() -> None:
    """A lane across the whole of a survey sweeps a strip as wide as the swath, at its speed."""
    lane = kinematic(Path(Pose(-60.0, 0.0, 0.0), (Segment(0.0, 120.0),)), 2.0, 5.0)
    found = sweep(rectangle(100.0, 80.0), [lane], 16.0, 60.0)
    assert found is not None
    times = np.array([0.0, 30.0, 60.0])
    assert found.area(times) == pytest.approx([0.0, 16.0 * 50.0 + math.pi * 32.0, 1600.0], abs=30.0)
    assert found.area(times, 0).tolist() == found.area(times).tolist()


def test_whoever_comes_first_has_swept_it() -> None:
    """Two vehicles along one lane: the slower one sweeps what the faster one has not reached."""
    path = Path(Pose(-50.0, 0.0, 0.0), (Segment(0.0, 100.0),))
    fast, slow = kinematic(path, 2.0, 5.0), kinematic(path.reversed(), 1.0, 5.0)
    found = sweep(rectangle(100.0, 40.0), [slow, fast], 20.0, 100.0)
    assert found is not None
    end = np.array([100.0])
    both, shares = found.area(end), [found.area(end, auv)[0] for auv in (0, 1)]
    assert both == pytest.approx([2000.0], abs=40.0)
    assert sum(shares) == both[0]
    assert shares[1] / shares[0] == pytest.approx(2.0, rel=0.2)  # they met after 67 m


@settings(max_examples=30, deadline=None)
@given(
    st.lists(
        st.tuples(*[st.floats(-80.0, 80.0)] * 2, st.floats(-3.0, 3.0)), min_size=1, max_size=4
    ),
    st.floats(5.0, 40.0),
    st.floats(-0.1, 0.1),
)
@example([(0.0, 0.0, 1.0)], 5.0, 1.4e-17)  # of 55.5 m went the way that a figure drew
@example([(0.0, 0.0, 1.0)], 5.0, 1e-15)
def test_what_is_swept_is_the_way_with_its_surroundings(
    starts: list[tuple[float, float, float]], swath: float, curvature: float
) -> None:
    """Against shapely's buffers about the ways, up to half a cell along their edges."""
    area = polygon([(-60.0, -60.0), (60.0, -60.0), (60.0, 20.0), (0.0, 60.0), (-60.0, 20.0)])
    paths = [Path(Pose(*start), (Segment(curvature, 60.0),)) for start in starts]
    found = sweep(area, [kinematic(path, 1.0, 5.0) for path in paths], swath, 60.0)
    assert found is not None
    lines = [shapely.LineString(path.sample(np.linspace(0, 60, 200))[:, :2]) for path in paths]
    around = shapely.intersection(shapely.union_all(shapely.buffer(lines, swath / 2)), area.shape)
    edge = around.length * swath / 16
    assert found.area(np.array([60.0]))[0] == pytest.approx(around.area, abs=edge / 2 + 20.0)


def test_who_waits_has_swept_all_that_lies_behind() -> None:
    """A lane of 100 m in 50 s is swept as well if the vehicle then lies still for hours."""
    lane = kinematic(Path(Pose(-50.0, 0.0, 0.0), (Segment(0.0, 100.0),)), 2.0, 5.0)
    soon, late = (sweep(rectangle(100.0, 40.0), [lane], 10.0, until) for until in (50.0, 2e4))
    assert soon is not None
    assert late is not None
    assert late.area(np.array([60.0]))[0] == pytest.approx(soon.area(np.array([50.0]))[0], abs=2.0)


@pytest.mark.parametrize("leaves", [365.0, 400.0, 1000.0, 1300.0])
def test_who_goes_out_and_back_has_swept_what_lies_between(leaves: float) -> None:
    """25 m at 1 m/s and back in an hour of hovering, between two instants looked at first."""
    times = np.array([0.0, leaves, leaves + 25.0, leaves + 50.0, 3600.0])
    places = np.array([[0.0, 0, 5], [0, 0, 5], [25, 0, 5], [0, 0, 5], [0, 0, 5]])
    found = sweep(rectangle(60.0, 60.0), [recorded(times, places)], 5.0, 3600.0)
    assert found is not None
    truth = 25.0 * 5.0 + math.pi * 2.5**2
    assert found.area(np.array([3600.0])) == pytest.approx([truth], abs=4.0)


@pytest.mark.parametrize("wide", [0.2, 0.6, 3.0])
def test_a_strip_thinner_than_its_cells_is_swept(wide: float) -> None:
    lane = kinematic(Path(Pose(-150.0, 0.0, 0.0), (Segment(0.0, 300.0),)), 1.0, 5.0)
    found = sweep(rectangle(300.0, wide), [lane], 10.0, 150.0)
    assert found is not None
    assert found.area(np.array([150.0]))[0] == pytest.approx(155.0 * wide, rel=0.02)


@pytest.mark.parametrize("wide", [2.0, 5.0, 10.0])
@pytest.mark.parametrize("swath", [80.0, 150.0])
def test_of_a_corridor_thinner_than_its_cells_counts_what_is_in_them(
    wide: float, swath: float
) -> None:
    """A Z of three corridors, the middle one flown along: against a buffer of the way."""
    middle = wide / 2.0
    corridor = polygon([
        (0.0, 0.0), (500.0 + middle, 0.0), (500.0 + middle, 1000.0 - wide), (1000.0, 1000.0 - wide),
        (1000.0, 1000.0), (500.0 - middle, 1000.0), (500.0 - middle, wide), (0.0, wide),
    ])  # fmt: skip
    leg = Path(Pose(500.0, 0.0, math.pi / 2), (Segment(0.0, 1000.0),))
    found = sweep(corridor, [kinematic(leg, 10.0, 5.0, 100.0)], swath, 100.0)
    around = shapely.LineString([(500, 0), (500, 1000)]).buffer(swath / 2)
    truth = shapely.intersection(corridor.shape, around).area
    assert found is not None
    assert found.area(np.array([100.0]))[0] == pytest.approx(truth, rel=0.03)


def test_too_much_is_not_told() -> None:
    """A swath far narrower than what a grid can tell says nothing rather than something wrong."""
    lies = moored(Place(0.0, 0.0, 5.0, 0.0))
    assert sweep(rectangle(1e5, 1e5), [lies], 10.0, 60.0) is None
    found = sweep(rectangle(100.0, 100.0), [lies], 20.0, 60.0)
    assert found is not None
    assert found.area(np.array([0.0])) == pytest.approx([math.pi * 100.0], rel=0.05)


@pytest.mark.parametrize("degrees", [0, 30, 45])
def test_a_slanted_corridor_is_swept_as_a_straight_one(degrees: int) -> None:
    """Lanes whose swaths touch leave nothing of 3 km x 60 m between them, whatever its heading."""
    turn = math.radians(degrees)
    along, across = (
        np.array([math.cos(turn), math.sin(turn)]),
        np.array([-math.sin(turn), math.cos(turn)]),
    )
    corners = [u * along + v * across for u, v in ((0, -30), (3000, -30), (3000, 30), (0, 30))]
    lanes = [
        kinematic(Path(Pose(*(v * across).tolist(), turn), (Segment(0.0, 3000.0),)), 2.0, 5.0)
        for v in (-25.0, -15.0, -5.0, 5.0, 15.0, 25.0)
    ]
    area = polygon([(float(x), float(y)) for x, y in corners])
    found = sweep(area, lanes, 10.0, 1500.0)
    assert found is not None
    assert found.area(np.array([1500.0]))[0] / area.square_m > 0.999
    assert found.area(np.array([750.0]))[0] / area.square_m == pytest.approx(0.5, abs=0.005)


def test_who_comes_up_sweeps_nothing_on_the_way() -> None:
    """Of a straight way of 100 m the middle is above its depth: two strips, nothing in between."""
    path = Path(Pose(-50.0, 0.0, 0.0), (Segment(0.0, 100.0),))

    class Rising:
        def distance(self, until: float) -> float:
            return until

        def sample(self, times: np.ndarray) -> np.ndarray:
            way = kinematic(path, 1.0, 5.0).sample(times)
            way[:, 2] = np.where((times > 30.0) & (times < 70.0), 0.0, 5.0)
            return way

    found = sweep(rectangle(100.0, 40.0), [Rising()], 10.0, 100.0, [5.0])  # type: ignore[list-item]
    assert found is not None
    half = 10.0 * 30.0 + math.pi * 25.0 / 2.0
    assert found.area(np.array([100.0])) == pytest.approx([2.0 * half], abs=12.0)


def test_what_lies_where_two_swaths_touch_is_swept() -> None:
    """Middles of cells 8 m beside a lane, to the last bit, with a swath of 16 m."""
    lane = kinematic(Path(Pose(-60.0, 0.0, 0.0), (Segment(0.0, 120.0),)), 2.0, 5.0)
    found = sweep(rectangle(100.0, 18.0), [lane], 16.0, 60.0)
    assert found is not None
    assert np.isfinite(found.at_s).all()
