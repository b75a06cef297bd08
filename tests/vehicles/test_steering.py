"""Steering by what a vehicle can know: its log, its fixes, and nothing of the sea beside them."""

import math
import pickle
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from voyages import drift, voyage, way
from worlds import QUIET_NAVIGATION, merged, scenario

from bindusbl_des import Scenario, load_scenario, simulate
from bindusbl_des.core.vehicles.guidance import sensing

Floats = NDArray[np.float64]
SCENARIOS = FilePath(__file__).parents[2] / "scenarios"
LINE = way((0.0, 300.0))


def blind_mission(
    model: str, speed: float, current: float, towards_deg: float, **navigation: object
) -> Scenario:
    """Return one AUV that steers by its estimate along x, with a log that misses the current.

    Its only ASV is far away, so that it never gets a fix.
    """
    return scenario(
        duration_s=200.0,
        survey={"side_m": 400.0, "depth_m": 5.0},
        auvs={
            "count": 1, "vehicle": model, "speed_m_per_s": speed, "feedback": "estimate",
            "route": {"kind": "waypoints", "points_m": [[[-150, 0], [60, 20], [150, 60]]]},
        },
        asvs={"count": 1, "formation": {"positions_m": [[0.0, 190.0]]}},
        acoustics={"hf": {"range_m": 1.0}},
        environment={"current_m_per_s": current, "current_direction_deg": towards_deg},
        navigation={"velocity": "through_water", **navigation},
        record={"tracks_hz": 1.0},
    )  # fmt: skip


@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize("towards_deg", [0.0, 90.0, 215.0])
@pytest.mark.parametrize(("model", "speed"), [("bluerov2", 0.5), ("remus100", 1.5)])
def test_a_current_that_nobody_sees_steers_nobody(
    model: str, speed: float, towards_deg: float, frame: str
) -> None:
    """Without bottom lock and without fixes a current carries the whole track along, unnoticed.

    Galilei: through the water, and by its own dead reckoning, the vehicle does exactly what it does
    in still water.
    """
    missions = (
        blind_mission(model, speed, current, towards_deg, bias_frame=frame)
        for current in (0.0, 0.2)
    )
    still, carried = (
        simulate(mission).tables["tracks"].query("vehicle == 'AUV0'") for mission in missions
    )
    moved = 0.2 * still.time_s.to_numpy()
    for axis, share in (("x", math.cos), ("y", math.sin)):
        drifted = (carried[f"{axis}_m"] - still[f"{axis}_m"]).to_numpy()
        assert drifted == pytest.approx(share(math.radians(towards_deg)) * moved, abs=1e-6)
        believed = (carried[f"estimate_{axis}_m"] - still[f"estimate_{axis}_m"]).to_numpy()
        assert believed == pytest.approx(0.0, abs=1e-6)
    assert (carried.yaw_rad - still.yaw_rad).abs().max() < 1e-6


@pytest.mark.parametrize(("towards_deg", "ground"), [(0.0, 0.4), (180.0, 0.2)])
def test_a_speed_asked_for_is_that_of_the_log(towards_deg: float, ground: float) -> None:
    """0.3 m/s through the water in a current of 0.1: 0.4 or 0.2 over ground, 0.3 as it believes."""
    mission = blind_mission("bluerov2", 0.3, 0.1, towards_deg, **QUIET_NAVIGATION)
    straight = {"kind": "waypoints", "points_m": [[[-150, 0], [150, 0]]]}
    mission = scenario(**merged(mission.model_dump(), {"auvs": {"route": straight}}))
    tracks = simulate(mission).tables["tracks"].query("vehicle == 'AUV0'").set_index("time_s")
    for column, expected in (("x_m", ground), ("estimate_x_m", 0.3)):
        made = tracks.loc[150.0, column] - tracks.loc[50.0, column]
        assert made / 100.0 == pytest.approx(expected, abs=1e-4)


def crossing(model: str, speed: float, fix_every_s: float, duration: float) -> Any:
    """Return a voyage along x in 0.3 m/s from abeam, its log through the water, its fixes exact."""
    walk = np.zeros((1, math.ceil(duration) + 2, 2))
    walk[0, :, 1] = -0.3 * np.arange(walk.shape[1])
    guided = voyage(
        model, paths=[LINE], speed_m_per_s=speed, depth_m=5.0, currents=[(0.0, 0.3)],
        duration_s=duration, drift=drift(walk, through_water=True),
    )  # fmt: skip
    for instant in np.arange(fix_every_s, duration, fix_every_s):
        guided.advance(instant)
        guided.corrections[0, 1] = 0.3 * instant
    guided.advance(duration)
    return guided


@pytest.mark.parametrize(("model", "speed"), [("bluerov2", 0.3), ("remus100", 1.5)])
def test_fixes_tell_of_the_current(model: str, speed: float) -> None:
    """Exact fixes each second in 0.3 m/s from abeam: REMUS crabs, BlueROV2 sways against it.

    What remains beside the path is what the current does until the next fix.
    """
    vehicle = crossing(model, speed, 1.0, 120.0).vehicle(0)
    times = np.arange(60.0, 120.0, 0.1)
    assert vehicle.path_error(times).mean() < 0.3
    assert abs(vehicle.sample(times)[:, 1].mean() - 0.15) < 0.1
    yaw = vehicle.sample(times)[:, 3].mean()
    crab = -math.asin(0.3 / 1.5) if model == "remus100" else 0.0
    assert yaw == pytest.approx(crab, abs=0.02)


def test_fixes_that_show_no_headway_make_it_push_harder() -> None:
    """Against 0.25 m/s with 0.3 m/s through the water: half of what is asked for, over ground."""
    duration = 150.0
    walk = np.zeros((1, 152, 2))
    walk[0, :, 0] = 0.25 * np.arange(152)
    guided = voyage(
        "bluerov2", paths=[LINE], speed_m_per_s=0.3, depth_m=5.0, currents=[(-0.25, 0.0)],
        duration_s=duration, drift=drift(walk, through_water=True),
    )  # fmt: skip
    for instant in range(1, 150):
        guided.advance(float(instant))
        guided.corrections[0, 0] = -0.25 * instant
    made = guided.vehicle(0).at(149.0).x - guided.vehicle(0).at(100.0).x
    assert made / 49.0 == pytest.approx(0.15, abs=0.01)


def learnt(times: Floats, sums: Floats) -> Floats:
    """Return the drift (m/s) that sums of corrections (m) at instants (s) have shown."""
    line = np.zeros(1, sensing.TREND)
    for instant, (north, east) in zip(times.tolist(), sums.tolist(), strict=True):
        sensing.learn_drift(instant, north, east, line[0])
    return np.asarray(line["rate"][0])


def test_the_drift_is_the_slope_of_the_corrections() -> None:
    """A steady drift is found exactly at any intervals, whatever the first fix has put right."""
    random = np.random.default_rng(4)
    times = np.cumsum(random.exponential(3.0, 60))
    sums = np.outer(times, (0.2, -0.1))
    assert learnt(times, sums) == pytest.approx([0.2, -0.1], abs=1e-4)
    assert learnt(times, sums + np.array([30.0, -5.0])) == pytest.approx([0.2, -0.1], abs=1e-4)
    assert learnt(times[:1], sums[:1] + 30.0).tolist() == [0.0, 0.0]
    # a minute without a fix: the mean drift meanwhile is what counts
    later = np.append(times, times[-1] + 60.0), np.vstack((sums, sums[-1] + np.array([-6.0, 0.0])))
    assert learnt(*later) == pytest.approx([-0.1, 0.0], abs=0.05)


def test_noise_of_fixes_is_hardly_a_drift() -> None:
    """Fixes each second with noise of 0.5 m leave less than 2 cm/s of drift in still water."""
    random = np.random.default_rng(5)
    times = np.arange(1.0, 301.0)
    found = [learnt(times, random.normal(scale=0.5, size=(300, 2))) for _ in range(50)]
    assert np.sqrt(np.mean(np.square(found))) < 0.02
    assert np.isfinite(learnt(np.array([0.0, 0.0, 1e-12]), np.ones((3, 2)).cumsum(axis=0))).all()


@pytest.mark.parametrize(
    ("navigator", "mean", "most", "position"),
    [("fixed_gain", 0.2, 0.3, 0.6), ("kalman", 0.14, 0.2, 0.2)],
)
def test_harbour_lanes_are_held_by_honest_knowledge(
    navigator: str, mean: float, most: float, position: float
) -> None:
    """In 0.3 m/s, of which its log sees nothing, a BlueROV2 at 0.3 m/s stays within 0.3 m.

    With a filter that learns the current it is closer, and knows far better where it is.
    """
    changes = ["record.detail=summary", f"navigation.filter={navigator}"]
    mission = load_scenario(SCENARIOS / "harbour_current.yaml", overrides=changes)
    found = [simulate(mission, seed).auvs for seed in range(6)]
    errors = np.concatenate([auvs.path_error_m for auvs in found])
    assert errors.mean() < mean
    assert errors.max() < most
    assert np.mean([auvs.position_error_m for auvs in found]) < position
    assert min(auvs.distance_m.min() for auvs in found) > 50.0


def test_who_is_lost_without_knowing_ends_its_mission() -> None:
    """Swept away at twice its own speed, unseen: it believes to be on its path, and goes on."""
    mission = blind_mission("bluerov2", 0.3, 0.6, 180.0)
    long = scenario(**merged(mission.model_dump(), {"duration_s": 600.0}))
    auv = simulate(long).auvs.iloc[0]
    assert auv.fixes_delivered == 0
    assert auv.path_error_m > 50.0


@pytest.mark.parametrize("navigator", ["fixed_gain", "kalman"])
def test_who_is_swept_back_says_so(navigator: str) -> None:
    """Fixes show for minutes that it makes no headway: the mission ends with its reason.

    An error that SimPy and worker processes make anew keeps its words.
    """
    mission = load_scenario(
        SCENARIOS / "harbour_current.yaml",
        overrides=[
            "environment.current_m_per_s=0.72", "environment.current_direction_deg=180",
            "duration_s=600", "asvs.vehicle=moored", f"navigation.filter={navigator}",
        ],
    )  # fmt: skip
    with pytest.raises(
        RuntimeError, match="no headway along its path for 360 s: asked for"
    ) as error:
        simulate(mission)
    again = pickle.loads(pickle.dumps(error.value))
    assert str(again).endswith("by its fixes; ask for more speed")
    assert (str(again), again.vehicle) == (str(error.value), error.value.vehicle)
