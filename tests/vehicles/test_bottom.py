"""The bottom: altitudes kept above it, ways into it, and logs that see it."""

from typing import Any

import numpy as np
import pytest

from bindusbl_des import Scenario, Setup, simulate, warnings_of

FALL = np.tan(np.radians(5.0))
SLOPE = {"depth_m": 20.0, "slope_deg": 5.0}
ALONG = {"kind": "waypoints", "points_m": [[[-60.0, 0.0], [60.0, 0.0]]]}


def asked(bathymetry: Any = SLOPE, **keys: Any) -> dict[str, Any]:
    """Return the keys of a short mission of one AUV along x, above a bottom."""
    auvs = {"count": 1, "route": ALONG, "speed_m_per_s": 1.0, "recovery_m": [[60.0, 0.0]]}
    auvs |= keys.pop("auvs", {})
    environment = {"bathymetry": bathymetry, **keys.pop("environment", {})}
    return {"name": "x", "duration_s": 120.0, "auvs": auvs, "environment": environment, **keys}


def flown(**keys: Any) -> Any:
    """Return the track of the AUV."""
    tracks = simulate(Scenario.model_validate(asked(**keys)), seed=1).tables["tracks"]
    return tracks[tracks["vehicle"] == "AUV0"]


def refused(**keys: Any) -> str:
    with pytest.raises(ValueError, match=r"\n  ") as found:
        Scenario.model_validate(asked(**keys))
    return str(found.value)


def test_an_auv_keeps_its_altitude_over_a_slope() -> None:
    """A plane: at x the bottom is at 20 + x tan 5 deg, and the AUV 5 m above it."""
    track = flown(auvs={"depth": {"altitude_m": 5.0}})
    depth = 20.0 + track["x_m"] * FALL
    assert track["z_m"].to_numpy() == pytest.approx(depth - 5.0, abs=1e-6)
    assert track["altitude_m"].to_numpy() == pytest.approx(5.0, abs=1e-6)
    assert track["z_m"].max() > 19.0
    assert track["z_m"].min() < 11.0


def test_a_flat_bottom_and_an_altitude_are_a_depth() -> None:
    """All tables are those of the depth, to rounding."""
    kept = simulate(Scenario.model_validate(asked(30.0, auvs={"depth": {"altitude_m": 18.0}})))
    plain = simulate(Scenario.model_validate(asked(30.0, survey={"depth_m": 12.0})))
    for name in ("x_m", "y_m", "z_m", "estimate_x_m"):
        one, other = (it.tables["tracks"][name].to_numpy(float) for it in (kept, plain))
        assert one == pytest.approx(other, abs=1e-9, nan_ok=True)


def test_auvs_climb_early_enough_and_no_steeper() -> None:
    """A bottom that falls away at 30 deg is followed at 10 deg."""
    steep = {"depth_m": 60.0, "slope_deg": 30.0}
    depth = {"altitude_m": 5.0, "climb_angle_deg": 10.0}
    track = flown(bathymetry=steep, auvs={"depth": depth})
    rate = np.abs(np.diff(track["z_m"]) / np.diff(track["x_m"]))
    assert rate[np.isfinite(rate)].max() < np.tan(np.radians(10.0)) + 1e-6
    assert track["altitude_m"].min() > 5.0 - 1e-6
    # it comes down at 10 deg from x = -60, where it is 5 m above the bottom
    low = 60.0 - 60.0 * np.tan(np.radians(30.0)) - 5.0
    wanted = low + (track["x_m"] + 60.0) * np.tan(np.radians(10.0))
    assert track["z_m"].to_numpy() == pytest.approx(wanted.to_numpy(), abs=1e-6)


def test_an_auv_goes_no_shallower_than_it_may() -> None:
    """Above x = -60 the bottom is at 2.75 m; 5 m above it would be in the air."""
    shallow = {"depth_m": 8.0, "slope_deg": 5.0}
    track = flown(bathymetry=shallow, auvs={"depth": {"altitude_m": 5.0, "shallowest_m": 1.5}})
    depth = 8.0 + track["x_m"] * FALL
    assert track["z_m"].to_numpy() == pytest.approx(np.maximum(depth - 5.0, 1.5), abs=0.23)
    assert track["z_m"].min() == pytest.approx(1.5, abs=1e-9)


@pytest.mark.parametrize("vehicle", ["bluerov2", "remus100"])
def test_a_hull_follows_the_bottom_below_it(vehicle: str) -> None:
    """By its own autopilot; that of a REMUS lags behind a slope that it has long followed."""
    auvs = {"vehicle": vehicle, "speed_m_per_s": 0.5 if vehicle == "bluerov2" else 1.0}
    track = flown(auvs={**auvs, "depth": {"altitude_m": 6.0}}, duration_s=60.0)
    late = track[track["time_s"] > 20.0]
    assert late["z_m"].max() - late["z_m"].min() > 1.5
    assert late["altitude_m"].to_numpy() == pytest.approx(6.0, abs=1.0)


def test_echoes_meet_the_bottom_below_the_middle_of_their_way() -> None:
    """From (40, 0) to an ASV at (0, 0): as over a flat sea of 20 + 20 tan 5 deg."""
    route = {"kind": "hold", "positions_m": [[40.0, 0.0]]}

    def heard(bottom: Any, bathymetry: Any) -> Any:
        sonar = {"model": "sonar", "bottom_m": bottom, "bandwidth_khz": 0.1}  # it blends in 15 m
        keys: dict[str, Any] = {
            "auvs": {"route": route, "recovery_m": None},
            "asvs": {"count": 1, "formation": {"model": "positions", "positions_m": [[0, 0]]}},
            "acoustics": {"hf": {"channel": sonar}},
            "duration_s": 10.0,
        }
        scenario = Scenario.model_validate(asked(bathymetry, **keys))
        assert Scenario.model_validate(scenario.model_dump(mode="json")) == scenario
        return simulate(scenario, seed=1).tables["receptions"]

    there = heard("bathymetry", SLOPE)
    flat = heard(20.0 + 20.0 * FALL, None)
    assert len(there) > 5
    for name in ("snr_db", "arrived_at_s"):
        assert there[name].to_numpy() == pytest.approx(flat[name].to_numpy(), rel=1e-12)
    other = heard(20.0, None)
    assert np.abs(other["snr_db"] - there["snr_db"]).max() > 0.01


def test_a_held_place_is_above_its_bottom() -> None:
    route = {"kind": "hold", "positions_m": [[40.0, 0.0]]}
    setup = Setup(Scenario.model_validate(asked(auvs={"route": route, "depth": {"altitude_m": 7}})))
    assert simulate(setup.scenario, seed=1).tables["tracks"]["z_m"][0] == pytest.approx(
        20.0 + 40.0 * FALL - 7.0
    )


def test_groups_keep_altitudes_and_depths_of_their_own() -> None:
    groups = [
        {"count": 1, "depth": {"altitude_m": 3.0}},
        {"count": 1, "depth_m": 6.0},
        {"count": 1},
    ]
    route = {"kind": "hold", "positions_m": [[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]]}
    auvs = {"count": 3, "groups": groups, "route": route, "depth": {"altitude_m": 8.0}}
    tracks = simulate(Scenario.model_validate(asked(auvs=auvs)), seed=1).tables["tracks"]
    depths = tracks.groupby("vehicle")["z_m"].first()
    assert depths[["AUV0", "AUV1", "AUV2"]].tolist() == pytest.approx([17.0, 6.0, 12.0])


def test_a_way_into_the_ground_is_a_mistake() -> None:
    """At x the bottom is at 20 + x tan 5 deg: at 14.75 m where the way begins."""
    text = refused(survey={"depth_m": 18.0})
    assert "survey.depth_m: takes AUV0 into the ground" in text
    assert "18 m where the bottom is at 14.75 m, first at x -60 m, y 0 m" in text
    assert "is 3.25 m below it" in text
    assert "use a depth of less than 14.8 m, or auvs.depth.altitude_m" in text
    Scenario.model_validate(asked(survey={"depth_m": 14.0}))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            {"bathymetry": None, "auvs": {"depth": {"altitude_m": 5.0}}},
            "auvs.depth.altitude_m: is above a bottom, and there is none; add environment.bathym",
        ),
        (
            {"bathymetry": None, "navigation": {"dvl_range_m": 20.0}},
            "navigation.dvl_range_m: needs a bottom, and there is none",
        ),
        (
            {"navigation": {"dvl_range_m": 20.0, "velocity": "through_water"}},
            "navigation.dvl_range_m: excludes velocity: through_water",
        ),
        (
            {"auvs": {"depth": {"altitude_m": 5.0}}, "survey": {"depths_m": [3.0]}},
            "auvs.depth.altitude_m: excludes survey.depths_m",
        ),
        (
            {"bathymetry": 0.8, "auvs": {"depth": {"altitude_m": 5.0}}},
            "the bottom is 0.8 m deep at x -60 m, y 0 m, and the AUV goes no shallower than 1 m",
        ),
        (
            {"bathymetry": {"depth_m": 20.0, "file": "x.tif"}},
            "excludes depth_m and slope_deg",
        ),
        (
            {
                "bathymetry": None,
                "acoustics": {"hf": {"channel": {"model": "sonar", "bottom_m": "bathymetry"}}},
            },
            "acoustics.hf.channel.bottom_m: is that of environment.bathymetry, and there is none",
        ),
        ({"bathymetry": {"slope_deg": 2.0}}, "gives neither depth_m nor file"),
        (
            {"asvs": {"count": 1, "formation": {"model": "positions", "positions_m": [[-250, 0]]}}},
            "ASV0 at (-250, 0) m is on land by environment.bathymetry, 1.87 m above the water",
        ),
        (
            {"auvs": {"depth": {"altitude_m": 5.0}, "route": {**ALONG, "surface_every_s": 60.0}}},
            "AUVs that surface climb from one depth",
        ),
    ],
)
def test_what_does_not_fit_is_told(keys: dict[str, Any], words: str) -> None:
    assert words in refused(**keys)


def test_slopes_that_are_too_steep_are_told_before() -> None:
    """A kinematic AUV dives at 10 deg over 30 deg: at the end it is 120 (tan 30 - tan 10) m higher.

    A REMUS at 1 m/s climbs by some 7 deg; a BlueROV2 follows 15 deg.
    """
    steep = {"depth_m": 60.0, "slope_deg": 30.0}

    def told(bathymetry: Any, **auvs: Any) -> list[str]:
        scenario = Scenario.model_validate(asked(bathymetry, auvs=auvs))
        return [it.message for it in warnings_of(scenario) if it.key.startswith("auvs.depth")]

    (slow,) = told(steep, depth={"altitude_m": 5.0, "climb_angle_deg": 10.0})
    assert "leaves AUV0 up to 48.1 m higher than altitude_m, at x 60 m, y 0 m" in slow
    assert told(steep, depth={"altitude_m": 5.0, "climb_angle_deg": 31.0}) == []
    gentle = {"depth_m": 40.0, "slope_deg": 15.0}
    (remus,) = told(gentle, vehicle="remus100", depth={"altitude_m": 5.0})
    assert "at 1 m/s remus100 climbs by 6.79 deg, and it does not look ahead" in remus
    assert told(gentle, vehicle="bluerov2", speed_m_per_s=0.5, depth={"altitude_m": 5.0}) == []


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        (
            {"navigation": {"dvl_range_m": 20.0}, "survey": {"depth_m": 5.0}},
            "navigation.dvl_range_m",
        ),
        (
            {"bathymetry": {"depth_m": 30.0, "slope_towards_deg": 40.0}},
            "environment.bathymetry.slope_towards_deg",
        ),
        ({"auvs": {"depth": {"altitude_m": 5.0}}, "survey": {"depth_m": 5.0}}, "survey.depth_m"),
        ({"bathymetry": 30.0, "auvs": {"depth": {"shallowest_m": 2.0}}}, "auvs.depth.shallowest_m"),
    ],
)
def test_keys_without_effect_are_told(keys: dict[str, Any], key: str) -> None:
    found = {it.key: it.message for it in warnings_of(Scenario.model_validate(asked(**keys)))}
    assert "no effect" in found[key] or "does nothing" in found[key], found[key]


EXACT = {
    "velocity_bias_m_per_s": [0.0, 0.0],
    "random_walk_m_per_sqrt_s": 0.0,
    "filter": "dead_reckoning",
}
CURRENT = {"current_m_per_s": 0.2, "current_direction_deg": 90.0}


def test_a_log_misses_the_current_while_it_sees_no_bottom() -> None:
    """At 1 m/s from x = -60 m, 5 m deep: the bottom is 15 m below the AUV at x = 0, after 60 s, and
    farther later, so that a range of 15 m is lost there.
    """
    navigation = {**EXACT, "dvl_range_m": 15.0}
    given: dict[str, Any] = {"survey": {"depth_m": 5.0}, "environment": CURRENT}
    track = flown(navigation=navigation, **given, duration_s=100.0)
    drift = (track["imu_y_m"] - track["y_m"]).to_numpy()
    missed = -0.2 * np.maximum(track["time_s"].to_numpy() - 60.0, 0.0)
    assert drift == pytest.approx(missed, abs=0.021)  # a control interval
    result = simulate(Scenario.model_validate(asked(navigation=navigation, **given)), seed=1)
    assert result.auvs["lock_share"][0] == pytest.approx(0.5, abs=0.01)


def test_without_lock_and_with_it_are_the_known_cases() -> None:
    """A range above all is a log over ground; one below all is a log through the water."""
    given: dict[str, Any] = {
        "survey": {"depth_m": 5.0},
        "environment": {**CURRENT, "current_variation_m_per_s": 0.05},
        "duration_s": 60.0,
    }

    def drift(**navigation: Any) -> np.ndarray:
        track = flown(navigation={**EXACT, **navigation}, **given)
        return (track[["imu_x_m", "imu_y_m"]].to_numpy() - track[["x_m", "y_m"]]).to_numpy()

    assert np.abs(drift(dvl_range_m=200.0)).max() < 1e-9
    never, through = drift(dvl_range_m=1.0), drift(velocity="through_water")
    assert never == pytest.approx(through, abs=1e-9)


def test_filters_expect_the_current_that_logs_miss() -> None:
    """Half of the way without lock in 0.2 m/s: its RMS is 0.2 sqrt(1/2); `untold` leaves it out."""
    keys: dict[str, Any] = {"survey": {"depth_m": 5.0}, "environment": CURRENT}
    navigation = {**EXACT, "filter": "kalman", "dvl_range_m": 15.0}
    setup = Setup(Scenario.model_validate(asked(navigation=navigation, **keys)))
    assert setup.missed is not None
    assert setup.missed.flow.rms_m_per_s == pytest.approx(0.2 * np.sqrt(0.5), abs=0.001)
    known = setup.beliefs[0].covariances[0]
    assert known[4, 4] == pytest.approx(0.02, abs=0.0002)
    navigation["filter"] = {"model": "kalman", "untold": ["current"]}
    untold = Setup(Scenario.model_validate(asked(navigation=navigation, **keys)))
    assert untold.beliefs[0].covariances[0][4, 4] == 0.0


def test_a_steered_auv_loses_and_finds_its_way_by_lock() -> None:
    """A hull that steers by its estimate: dead reckoning adds up what its log missed."""
    auvs = {"vehicle": "bluerov2", "speed_m_per_s": 0.5, "feedback": "estimate"}
    given: dict[str, Any] = {"survey": {"depth_m": 5.0}, "environment": CURRENT}
    navigation = {**EXACT, "dvl_range_m": 11.0}
    track = flown(auvs=auvs, navigation=navigation, **given, duration_s=60.0)
    lost = (20.0 + track["x_m"] * FALL - track["z_m"] > 11.0).to_numpy()
    steps = np.diff(track["time_s"].to_numpy())
    missed = np.concatenate(([0.0], np.cumsum(-0.2 * lost[:-1] * steps)))
    drift = (track["imu_y_m"] - track["y_m"]).to_numpy()
    assert 0.1 < lost.mean() < 0.9
    assert drift == pytest.approx(missed, abs=0.15)
