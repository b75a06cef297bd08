"""Paths, lanes and turns: where vehicles go, and that they go there smoothly."""

import math
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from voyages import way
from worlds import lanes_over_square, scenario

from bindusbl_des import simulate
from bindusbl_des.core.geometry.area import rectangle
from bindusbl_des.core.geometry.lanes import Ruling, strips
from bindusbl_des.core.geometry.paths import through
from bindusbl_des.core.geometry.routes import lane_order, there_and_back, turn_about, waypoint_poses
from bindusbl_des.core.vehicles.tracks import read_track
from bindusbl_des.core.vehicles.vehicle import kinematic

JOIN = math.radians(20)


def smooth_and_round(path: Any, radius: float, length: float) -> None:
    """Check that a path never jumps, nor turns tighter than its radius."""
    step = 0.01
    poses = path.sample(np.arange(0.0, length, step))
    moved = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert moved.max() < step * (1 + 1e-6)
    turned = np.abs(np.angle(np.exp(1j * np.diff(poses[:, 2]))))
    assert turned.max() < step / radius * (1 + 1e-6)


@settings(max_examples=60, deadline=None)
@given(
    side=st.floats(30, 300),
    strips=st.integers(1, 6),
    spacing=st.floats(3, 40),
    radius=st.floats(0.5, 12),
    start=st.sampled_from(["strip_centre", "strip_corner"]),
    turns=st.sampled_from(["shortest", "bulb", "skip_lane"]),
)
def test_lawnmowers_are_smooth(
    side: float, strips: int, spacing: float, radius: float, start: str, turns: str
) -> None:
    """Whatever the survey, an AUV's tour is continuous and respects its turning radius."""
    if spacing >= side:
        return
    path = lanes_over_square(
        side, strips, strips - 1, spacing=spacing, margin=spacing / 2, radius=radius,
        start=start, turns=turns,
    )  # fmt: skip
    tour = there_and_back(path, rectangle(side, side).box, radius, JOIN)
    assert tour.repeats_from is not None
    smooth_and_round(tour, radius, min(1.5 * tour.length, 4000.0))


def test_lanes_cover_each_strip() -> None:
    """Lanes start half a spacing above the strip's edge; a narrow strip has one in its middle."""
    share = strips(rectangle(140, 140), Ruling(10.0, 5.0), 3)[1]
    assert [lane.y for lane in share.lanes] == pytest.approx(
        [-18.333333, -8.333333, 1.666667, 11.666667]
    )
    [whole] = strips(rectangle(140, 100), Ruling(10.0, 5.0), 1)
    assert len(whole.lanes) == 10
    [narrow] = strips(rectangle(140, 6), Ruling(10.0, 5.0), 1)
    assert [lane.y for lane in narrow.lanes] == [0.0]


@given(st.integers(1, 40), st.integers(1, 6))
def test_every_lane_is_flown_once(count: int, skip: int) -> None:
    """Whatever lanes are skipped on the way, none is left out."""
    assert sorted(lane_order(count, skip)) == list(range(count))


def test_skipping_lanes_saves_bulb_turns() -> None:
    """With lanes closer than two radii, skip-lane order is shorter than bulb turns."""
    lanes = {
        turns: lanes_over_square(100, 1, 0, spacing=5, margin=10, radius=8, turns=turns).length
        for turns in ("bulb", "skip_lane", "shortest")
    }
    assert lanes["shortest"] == lanes["skip_lane"] < lanes["bulb"] - 100


def test_an_auv_goes_straight_to_its_first_lane_and_sweeps_it() -> None:
    """From the strip's centre to the -x end of the lowest lane; then that lane, eastwards."""
    path = lanes_over_square(140, 3, 0, spacing=10, margin=5, radius=5)
    assert path.start[:2] == (0.0, pytest.approx(-46.666667))
    way = math.hypot(65, 65 - 46.666667)
    assert path.at(way)[:2] == pytest.approx((-65.0, -65.0))
    on_lane = path.sample(np.linspace(way + 46, way + 46 + 95, 50))
    assert on_lane[:, 1] == pytest.approx(-65.0)
    assert np.cos(on_lane[:, 2]) == pytest.approx(1.0)


@given(st.floats(1.7, 4.5), st.floats(0.5, 20), st.floats(0.05, 0.7), st.sampled_from([1.0, -1.0]))
def test_turning_about_ends_on_the_line(
    yaw: float, radius: float, angle: float, hand: float
) -> None:
    """After the turn the vehicle is on the line, heads along it, as far along as promised."""
    turn, joined = turn_about(yaw, radius, angle, hand)
    end = way(*turn, begin=(0.0, 0.0, yaw)).end
    assert end.x == pytest.approx(joined, abs=1e-9 * radius + 1e-9)
    assert end.y == pytest.approx(0.0, abs=1e-9 * radius + 1e-9)
    assert math.remainder(end.yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert all(segment.length >= 0 for segment in turn)


def test_waypoints_are_passed() -> None:
    """A waypoint route passes through its points."""
    points = [(0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (-10.0, 30.0)]
    path, _ = through(waypoint_poses(points), 4.0)
    track = path.sample(np.linspace(0, path.length, 20_000))[:, :2]
    for point in points:
        assert np.hypot(*(track - point).T).min() < 0.01
    smooth_and_round(path, 4.0, path.length)


def test_at_and_sample_agree() -> None:
    """One instant or many: the same place."""
    parts = (0.0, 10.0), (0.2, 7.0), (-0.1, 9.0)
    for path in (way(*parts, begin=(1, 2, 0.3)), replace(way(*parts), repeats_from=3.0)):
        distances = np.linspace(0, 80, 333)
        many = path.sample(distances)
        for distance, row in zip(distances.tolist(), many, strict=True):
            assert row == pytest.approx(np.array(path.at(distance)), abs=1e-9)


GOOD = "time_s,x_m,y_m,depth_m\n0,0,0,1\n2,4,0,1\n"


def test_a_recorded_track_is_read(tmp_path: FilePath) -> None:
    """A CSV of a real vehicle gives its times and positions."""
    (tmp_path / "a.csv").write_text(GOOD)
    times, positions = read_track(tmp_path / "a.csv")
    assert times.tolist() == [0, 2]
    assert positions.tolist() == [[0, 0, 1], [4, 0, 1]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "column time_s, x_m, y_m, depth_m missing"),
        ("time_s,x_m,y_m\n0,0,0\n", "column depth_m missing"),
        (GOOD.replace("4,0", "a,0"), ":3: needs a number"),
        (GOOD.replace("4,0", "nan,0"), ":3: holds a value that is not finite"),
        (GOOD.replace("4,0,1", "4"), ":3: needs a number"),
        (GOOD.replace("2,4", "-2,4"), ":3: time_s must increase, but -2 s follows 0 s"),
        ("time_s,x_m,y_m,depth_m\n0,0,0,1\n", "needs at least two"),
    ],
)
def test_a_bad_track_is_refused(tmp_path: FilePath, text: str, message: str) -> None:
    """A track that cannot be read is refused with file, line and remedy."""
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        read_track(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("depths", "said"),
    [
        ((-5, -5), ":2: is 5 m above the sea, .* Turn their sign"),
        ((0.2, -3), ":3: is 3 m above the sea, and no sample is more than 0.5 m below it"),
        ((0, 0), ""),
        ((-0.9, 0.3), ""),  # at the surface, in waves
        ((10, -2), ""),
    ],
)
def test_a_track_in_the_air_is_refused(
    tmp_path: FilePath, depths: tuple[float, float], said: str
) -> None:
    """A log of heights, z up; what floats has no depth, and what dives may come up."""
    (tmp_path / "a.csv").write_text(
        "time_s,x_m,y_m,z_m\n" + "".join(f"{9 * n},{n},0,{z}\n" for n, z in enumerate(depths))
    )
    assert not read_track(tmp_path / "a.csv", afloat=True)[1][:, 2].any()
    with pytest.raises(ValueError, match=rf"a.csv{said}") if said else nullcontext():
        assert read_track(tmp_path / "a.csv")[1][:, 2].tolist() == list(depths)


def test_a_tour_goes_on_as_long_as_it_must() -> None:
    """A vehicle on its tenth lap is where its tour has it, and has come as far."""
    tour = replace(way((0.0, 10.0), (0.2, 7.0), (-0.1, 9.0)), repeats_from=3.0)
    vehicle = kinematic(tour, 2.0, 10.0, until=120.0)
    for time in np.linspace(0.0, 120.0, 77):
        x, y, yaw = tour.at(2.0 * time)
        assert vehicle.at(time) == pytest.approx((x, y, 10.0, yaw), abs=1e-9)
        assert vehicle.distance(time) == pytest.approx(2.0 * time)
    small = scenario(
        duration_s=900.0, survey={"side_m": 30.0}, auvs={"count": 1}, record={"tracks_hz": 1.0}
    )
    tracks = simulate(small).tables["tracks"]
    auv = tracks[tracks.vehicle == "AUV0"]
    steps = np.hypot(auv.x_m.diff(), auv.y_m.diff())[1:]
    assert steps.min() > 0.6  # m in a second at 0.627 m/s, in turns as well


@settings(deadline=None, max_examples=60)
@given(
    st.tuples(*[st.floats(-50.0, 50.0)] * 2, st.floats(-7.0, 7.0)),
    st.lists(st.tuples(st.sampled_from([-0.2, 0.0, 0.2]), st.floats(0.1, 40.0)), max_size=3),
)
def test_the_box_of_a_path_is_as_far_as_it_comes(
    start: tuple[float, float, float], pieces: list[tuple[float, float]]
) -> None:
    """Joints and the points where arcs turn back are enough: sampling finds nothing farther."""
    path = way(*pieces, begin=start)
    places = path.sample(np.linspace(0.0, path.length, 4001))[:, :2]
    found = [*places.min(axis=0), *places.max(axis=0)]
    assert tuple(path.box) == pytest.approx(found, abs=1e-4)
