"""Currents that differ from place to place: against closed forms, and as vehicles meet them."""

from typing import Any

import numpy as np
import pytest

from bindusbl_des import Scenario, Setup, simulate

AUV = {"count": 1, "route": {"kind": "hold", "positions_m": [[30.0, 0.0]]}}
VORTEX = {"model": "vortex", "radius_m": 40.0, "speed_m_per_s": 0.4, "centre_m": [5.0, -3.0]}


def asked(current: Any, **keys: Any) -> Scenario:
    """Return a short mission in a current, whose dead reckoning is perfect through the water."""
    environment = {"current": current, **keys.pop("environment", {})}
    exact = {"velocity_bias_m_per_s": [0.0, 0.0], "random_walk_m_per_sqrt_s": 0.0}
    navigation = {"velocity": "through_water", **exact, **keys.pop("navigation", {})}
    return Scenario.model_validate(
        {"name": "x", "duration_s": 40.0, "auvs": AUV}
        | {"environment": environment, "navigation": navigation, **keys}
    )


def flow(current: Any, times: Any, places: Any, **keys: Any) -> np.ndarray:
    """Return the field (m/s) of a current at instants (s) and positions (m)."""
    instants, spots = np.array(times, dtype=float), np.array(places, dtype=float)
    return Setup(asked(current, **keys)).flow.at(instants, spots)


def test_a_particle_circles_in_a_vortex() -> None:
    """It keeps its distance, and returns after 2 pi r / v(r) (Runge-Kutta, 2,000 steps)."""
    setup, middle, radius = Setup(asked(VORTEX)), np.array([5.0, -3.0]), 25.0
    speed = 0.4 * radius / 40.0 * np.exp((1.0 - (radius / 40.0) ** 2) / 2.0)
    period, place = 2.0 * np.pi * radius / speed, middle + np.array([radius, 0.0])

    def velocity(at: np.ndarray) -> np.ndarray:
        return setup.flow.at(np.zeros(1), np.array([[*at, 7.0]]))[0]

    step = period / 2000
    for k in range(2000):
        one = velocity(place)
        two = velocity(place + step / 2 * one)
        three = velocity(place + step / 2 * two)
        four = velocity(place + step * three)
        place = place + step / 6 * (one + 2 * two + 2 * three + four)
        if k == 499:  # a quarter turn, from +x to +y
            assert place - middle == pytest.approx([0.0, radius], abs=1e-6)
    assert place - middle == pytest.approx([radius, 0.0], abs=1e-6)


def test_a_shear_is_linear_between_its_depths() -> None:
    shear = {"model": "shear", "depths_m": [0.0, 10.0, 30.0], "speeds_m_per_s": [0.4, 0.2, 0.0]}
    at = [[1e3, -1e3, depth] for depth in (-1.0, 0.0, 5.0, 20.0, 30.0, 90.0)]
    found = flow(shear | {"directions_deg": [90.0]}, np.zeros(6), at)
    assert found[:, 1] == pytest.approx([0.4, 0.4, 0.3, 0.1, 0.0, 0.0], abs=1e-15)
    assert np.abs(found[:, 0]).max() < 1e-15


def test_a_tide_turns() -> None:
    """An ellipse: fastest towards 60 deg at 100 s, a quarter period later across, clockwise."""
    tide = {"model": "tide", "speed_m_per_s": 0.5, "minor_m_per_s": 0.1, "direction_deg": 60.0}
    times = 100.0 + np.array([0.0, 900.0, 1800.0, 2700.0])
    found = flow(tide | {"period_h": 1.0, "peak_at_s": 100.0}, times, np.zeros((4, 3)))
    main, minor = (np.array([np.cos(a), np.sin(a)]) for a in np.radians([60.0, 150.0]))
    wanted = [0.5 * main, 0.1 * minor, -0.5 * main, -0.1 * minor]
    assert found == pytest.approx(np.array(wanted), abs=1e-12)


def imu_drift(scenario: Scenario) -> np.ndarray:
    """Return by how much dead reckoning alone is off (m) in the last row of tracks."""
    tracks = simulate(scenario, seed=1).tables["tracks"]
    last = tracks[tracks["vehicle"] == "AUV0"].iloc[-1]
    return np.array([last["imu_x_m"] - last["x_m"], last["imu_y_m"] - last["y_m"], last["time_s"]])


def test_dead_reckoning_falls_behind_by_the_water_that_passed() -> None:
    """An AUV at rest in the vortex: minus the velocity there, times the time."""
    (north, east), (x, y, time) = (
        flow(VORTEX, [0.0], [[30.0, 0.0, 10.0]])[0],
        imu_drift(asked(VORTEX)),
    )
    assert (x, y) == pytest.approx((-north * time, -east * time), abs=1e-9)


def test_the_log_measures_the_way_through_the_water() -> None:
    """A scale factor stretches what passes the log, not the way over ground."""
    scale = {"scale_factor_sd": 0.2, "initial_position_sd_m": 0.0}
    plain = imu_drift(asked(VORTEX))[:2]
    stretched = imu_drift(asked(VORTEX, navigation=scale))[:2]
    factors = stretched / plain
    assert factors[0] == pytest.approx(factors[1])
    assert abs(factors[0] - 1.0) > 0.01


@pytest.mark.parametrize("by", ["truth", "estimate"])
def test_a_shear_that_is_the_same_at_all_depths_is_a_uniform_current(by: str) -> None:
    """Hulls, their dead reckoning and their vessels: to a micrometre."""
    auvs = {"count": 1, "vehicle": "bluerov2", "speed_m_per_s": 0.4, "feedback": by}
    there = {"auvs": auvs, "asvs": {"vehicle": "otter", "count": 2}}
    shear = {"model": "shear", "depths_m": [0.0], "speeds_m_per_s": [0.2], "directions_deg": [40.0]}
    uniform = {"current_m_per_s": 0.2, "current_direction_deg": 40.0}
    one = simulate(asked(shear, **there), seed=2).tables["tracks"]
    other = simulate(asked("uniform", environment=uniform, **there), seed=2).tables["tracks"]
    for name in ("x_m", "y_m", "yaw_rad"):
        assert one[name].to_numpy() == pytest.approx(other[name].to_numpy(), abs=1e-6), name
    own = one["vehicle"] == "AUV0"
    imu = [table.loc[own, ["imu_x_m", "imu_y_m"]].to_numpy() for table in (one, other)]
    assert imu[0] == pytest.approx(imu[1], abs=1e-6)


def test_vehicles_feel_the_water_where_they_are() -> None:
    """Otters on both sides of a vortex point their bows against it, opposite ways."""
    asvs = {
        "vehicle": "otter",
        "count": 2,
        "formation": {"positions_m": [[40.0, 0.0], [-40.0, 0.0]]},
    }
    vortex = {"model": "vortex", "radius_m": 40.0, "speed_m_per_s": 0.3}
    tracks = simulate(asked(vortex, asvs=asvs), seed=1).tables["tracks"]
    yaws = [tracks[tracks["vehicle"] == f"ASV{n}"]["yaw_rad"].iloc[-1] for n in range(2)]
    assert np.sin(yaws) == pytest.approx([-1.0, 1.0], abs=0.05)


def test_a_filter_knows_of_the_field_or_does_not() -> None:
    """Without the current among what it assumes it takes drift for something else."""
    walk = {"random_walk_m_per_sqrt_s": 0.03}
    untold = {"model": "kalman", "assumes": {"environment": {"current": "uniform"}}}
    each = (walk, walk | {"filter": untold})
    knows, ignores = (simulate(asked(VORTEX, navigation=keys), seed=3).auvs for keys in each)
    assert knows["nees"][0] < 6.0 < ignores["nees"][0]


@pytest.mark.parametrize(
    ("current", "message"),
    [
        ({"model": "votrex"}, "environment.current: 'votrex' is no current; did you mean 'vortex'"),
        ({"model": "shear", "depths_m": [5.0, 0.0], "speeds_m_per_s": [1.0, 1.0]}, "must rise"),
        (
            {"model": "shear", "depths_m": [0.0, 5.0], "speeds_m_per_s": [1.0]},
            "one number per depth",
        ),
        ({"model": "vortex", "radius_m": 0.0, "speed_m_per_s": 1.0}, "must be > 0"),
    ],
)
def test_wrong_currents_end_in_a_line(current: Any, message: str) -> None:
    with pytest.raises(ValueError, match=r"environment\.current") as told:
        asked(current)
    assert message in str(told.value)
