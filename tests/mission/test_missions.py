"""Missions with real vehicles, in currents, steering by their own estimates."""

from pathlib import Path

import numpy as np
import pytest
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario

from bindusbl_des import Scenario, Setup, load_scenario, simulate

SCENARIOS = Path(__file__).parents[2] / "scenarios"
ROV = {"vehicle": "bluerov2", "speed_m_per_s": 0.6}


def rov(**changes: object) -> Scenario:
    """Return a BlueROV2 survey of 60 m, for two minutes, under an ASV that hears it everywhere."""
    base = {
        "duration_s": 120.0,
        "survey": {"side_m": 60.0},
        "auvs": {"count": 2, **ROV},
        "asvs": {"count": 1},
        "acoustics": {"hf": {"range_m": 80.0}, "mf": {"range_m": 160.0}},
    }
    return scenario(**(base | changes))


@pytest.fixture(scope="module")
def starved_and_served() -> dict[int, np.ndarray]:
    """Path errors of the paper's case study in closed loop, with one ASV and with three."""
    errors = {}
    for count in (1, 3):
        mission = load_scenario(
            SCENARIOS / "failure_140m.yaml",
            overrides=[
                "auvs.vehicle=bluerov2", "auvs.speed_m_per_s=0.6", "auvs.feedback=estimate",
                "navigation.bias_frame=world", f"asvs.count={count}", "record.detail=summary",
            ],
        )  # fmt: skip
        found = [simulate(mission, seed).auvs.path_error_m for seed in range(4)]
        errors[count] = np.mean(found, axis=0)
    return errors


def test_a_starved_auv_leaves_its_lane(starved_and_served: dict[int, np.ndarray]) -> None:
    """Steering by its own estimate, AUV0 strays by metres with one ASV, not with three."""
    assert starved_and_served[1][0] > 5.0
    assert (starved_and_served[3] < 0.6).all()


def test_vehicles_are_asked_for_until_the_last_sound_has_come() -> None:
    """From ASVs 9 km away sound is under way for 6 s, whichever way they came to lie there."""
    for placed in ({"clearance_m": 8950.0}, {"radius_m": 9000.0}, {"positions_m": [[9000, 0]] * 3}):
        assert Setup(scenario(asvs={"formation": placed})).afterwards_s > 6.0 + 2.0
    assert Setup(scenario(asvs={"count": 1, "formation": {"radius_m": 9000.0}})).afterwards_s < 3.0


def test_perfect_navigation_makes_both_feedbacks_alike() -> None:
    """With nothing wrong, steering by the estimate is steering by the truth."""
    clean = {
        "navigation": QUIET_NAVIGATION,
        "usbl": QUIET_USBL,
        "survey": {"side_m": 60, "depth_m": 0.0},
    }
    tracks = [
        simulate(rov(**clean, auvs={"count": 2, **ROV, "feedback": feedback})).tables["tracks"]
        for feedback in ("truth", "estimate")
    ]
    apart = np.hypot(tracks[0].x_m - tracks[1].x_m, tracks[0].y_m - tracks[1].y_m)
    # the array's finite size still biases fixes by up to 2 cm
    assert apart.max() < 0.1


def test_real_vehicles_begin_where_they_are() -> None:
    """The first ping is sent from the start of the path, at depth, not from the origin."""
    for feedback in ("truth", "estimate"):
        pings = simulate(rov(auvs={"count": 2, **ROV, "feedback": feedback})).tables["pings"]
        assert pings.y_m[0] == pytest.approx(-15.0, abs=0.01)
        assert pings.z_m[0] == pytest.approx(10.0, abs=0.01)


def test_a_current_is_missed_through_the_water_only() -> None:
    """Dead reckoning through the water falls behind by the current; over ground it does not."""
    water = {"current_m_per_s": 0.2, "current_direction_deg": 90.0}
    for velocity, lag in (("through_water", 0.2 * 100), ("over_ground", 0.0)):
        mission = rov(
            environment=water,
            navigation={**QUIET_NAVIGATION, "velocity": velocity},
            record={"tracks_hz": 1.0},
        )
        tracks = simulate(mission).tables["tracks"]
        at = tracks[(tracks.time_s == 100.0) & (tracks.vehicle == "AUV0")].iloc[0]
        assert at.imu_y_m - at.y_m == pytest.approx(-lag, abs=1e-6)
        assert at.imu_x_m - at.x_m == pytest.approx(0.0, abs=1e-6)


def test_vessels_keep_station_and_their_gnss_enters_the_fixes() -> None:
    """Otters hold 0.3 m/s within half a metre RMS; GNSS noise shows in the fixes' spread."""
    result = simulate(load_scenario(SCENARIOS / "harbour_current.yaml"))
    tracks = result.tables["tracks"]
    settled = tracks[tracks.vehicle.str.startswith("ASV") & (tracks.time_s > 60)]
    rms = settled.groupby("vehicle").path_error_m.agg(lambda error: np.sqrt(np.mean(error**2)))
    assert (rms < 0.5).all()
    noisy, clean = (
        simulate(rov(usbl={**QUIET_USBL, "gnss_sd_m": sd})).tables["fixes"].error_m
        for sd in (0.5, 0.0)
    )
    assert np.sqrt(np.mean(noisy**2) / 2) == pytest.approx(0.5, rel=0.15)
    assert clean.max() < 0.05


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"auvs": {"count": 1, "vehicle": "bluerov2", "speed_m_per_s": 0.9}},
            r"auvs.speed_m_per_s: bluerov2: a speed of 0\.9 m/s .* reaches",
        ),
        ({"environment": {"current_m_per_s": 0.9}}, r"AUV0 .*current of 0\.900 m/s is stronger"),
        (
            {
                "asvs": {"count": 1, "vehicle": "cybership2"},
                "environment": {"current_m_per_s": 0.65},
                "auvs": {"count": 1},
            },
            r"ASV0 .*current of 0\.650 m/s is stronger",
        ),
    ],
)  # fmt: skip
def test_impossible_demands_are_refused(changes: dict[str, object], message: str) -> None:
    """Too fast, or a current too strong: the error says which vehicle, and why."""
    with pytest.raises((RuntimeError, ValueError), match=message):
        simulate(rov(**changes))


def test_a_survey_too_small_to_turn_in_is_refused() -> None:
    """A REMUS cannot fly lanes in a square smaller than its turning circle."""
    with pytest.raises(
        ValueError, match=r"turns with a radius of .* too wide for a survey of 60 m"
    ):
        simulate(rov(auvs={"count": 1, "vehicle": "remus100", "speed_m_per_s": 1.0}))


def test_noisy_fixes_do_not_lose_the_path() -> None:
    """An AUV whose estimate jumps by more than its turning radius still finds its way round."""
    noisy = load_scenario(
        SCENARIOS / "harbour_current.yaml",
        overrides=[
            "navigation.velocity=over_ground", "navigation.filter=fixed_gain",
            "record.detail=summary",
        ],
    )  # fmt: skip
    for seed in range(6):
        assert (simulate(noisy, seed).auvs.path_error_m < 0.6).all()


def test_coefficients_change_the_vehicle() -> None:
    """A REMUS whose yaw is damped less turns more tightly, and its plan uses that."""

    def radius(vehicle: object) -> float:
        return Setup(scenario(auvs={"vehicle": vehicle, "speed_m_per_s": 1.5})).turning_radii_m[0]

    stiff, agile = radius("remus100"), radius({"model": "remus100", "yaw_time_constant_s": 5})
    assert stiff == pytest.approx(27.0, rel=0.03)
    assert agile == pytest.approx(1.3 * 16.3, rel=0.03)


def test_current_varies_as_its_model_says() -> None:
    """The variation around the mean has its standard deviation and its correlation time, each axis
    by itself: by what a log through the water misses of it.
    """
    hold = {"kind": "hold", "positions_m": [[0.0, 0.0]]}
    world = scenario(
        duration_s=40_000.0, auvs={"count": 1, "route": hold}, asvs={"count": 1},
        protocol={"shortest_uplink_slot_s": 60.0},
        navigation={**QUIET_NAVIGATION, "velocity": "through_water", "filter": "dead_reckoning"},
        environment={
            "current_m_per_s": 0.3, "current_direction_deg": 90.0,
            "current_variation_m_per_s": 0.1, "current_variation_time_s": 20.0,
        },
        record={"tracks_hz": 1.0},
    )  # fmt: skip
    track = simulate(world).tables["tracks"].query("vehicle == 'AUV0'")
    current = -np.diff(track[["imu_x_m", "imu_y_m"]].to_numpy(), axis=0)  # mean of each second
    assert current.mean(axis=0) == pytest.approx([0.0, 0.3], abs=0.013)
    assert current.std(axis=0) == pytest.approx([0.1, 0.1], rel=0.08)
    for axis in range(2):
        lagged = np.corrcoef(current[:-20, axis], current[20:, axis])[0, 1]
        assert lagged == pytest.approx(np.exp(-1), abs=0.08)
    assert abs(np.corrcoef(current.T)[0, 1]) < 0.12


def test_waypoints_and_tracks_are_flown(tmp_path: Path) -> None:
    """Routes of one's own: waypoints are passed, a recorded track is repeated."""
    points = [[[0, 0], [20, 0], [20, 15]]]
    by_points = scenario(auvs={"count": 1, "route": {"kind": "waypoints", "points_m": points}})
    tracks = simulate(by_points).tables["tracks"]
    assert np.hypot(tracks.x_m - 20, tracks.y_m - 15).min() < 0.5
    file = tmp_path / "dive.csv"
    file.write_text("time_s,x_m,y_m,depth_m\n0,0,0,5\n100,50,0,20\n")
    recorded = scenario(
        duration_s=120.0, auvs={"count": 1, "route": {"kind": "track", "files": [str(file)]}}
    )
    tracks = simulate(recorded).tables["tracks"]
    at = tracks[(tracks.vehicle == "AUV0") & (tracks.time_s == 50.0)].iloc[0]
    assert (at.x_m, at.y_m, at.z_m) == pytest.approx((25.0, 0.0, 12.5))
    assert tracks.path_error_m[tracks.vehicle == "AUV0"].isna().all()


def test_closed_loop_missions_repeat() -> None:
    """Steering by the estimate leaves a mission reproducible, and its books in order."""
    mission = rov(auvs={"count": 2, **ROV, "feedback": "estimate"}, duration_s=40.0)
    one, two = simulate(mission, 3), simulate(mission, 3)
    assert all(one.arrow[name].equals(two.arrow[name]) for name in one.arrow)
