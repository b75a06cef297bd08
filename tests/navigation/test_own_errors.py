"""AUVs' own sensors as they are: biases that wander, scale factors, headings that are wrong."""

import math

import numpy as np
import pandas as pd
import pytest
from test_drift import YAW, straight
from worlds import merged, scenario

from bindusbl_des import Mission, simulate

# Nothing wrong but what a test adds
EXACT = {
    "velocity_bias_m_per_s": [0.0, 0.0], "random_walk_m_per_sqrt_s": 0.0, "filter": "dead_reckoning"
}  # fmt: skip
WANDERING = {"velocity_bias_sd_m_per_s": 0.05, "velocity_bias_time_constant_s": 40.0}
SKEWED = {"scale_factor_sd": 0.02, "heading_sd_deg": 2.0}


def mission(seed: int = 0, navigation: dict[str, object] | None = None, **changes: object):
    """Return the tables of a short survey in which only the options asked for are wrong."""
    base = {"duration_s": 120.0, "survey": {"side_m": 60.0},
            "auvs": {"vehicle": {"model": "kinematic", "turning_radius_m": 3.0}},
            "navigation": {**EXACT, **(navigation or {})}}  # fmt: skip
    return simulate(scenario(**merged(base, changes)), seed).tables


def reckoned(tables: dict[str, pd.DataFrame], auv: str = "AUV0") -> pd.DataFrame:
    """Return truth and dead reckoning of an AUV from the start, and what is between them (m)."""
    rows = tables["tracks"]
    rows = rows[rows.vehicle == auv].reset_index(drop=True)
    return rows.assign(
        way_x=rows.x_m - rows.x_m[0], way_y=rows.y_m - rows.y_m[0],
        off_x=rows.imu_x_m - rows.x_m, off_y=rows.imu_y_m - rows.y_m,
    )  # fmt: skip


@pytest.mark.parametrize("vehicle", ["kinematic", "bluerov2"])
def test_scale_factor_and_heading_are_a_function_of_the_place(vehicle: str) -> None:
    """Dead reckoning is a straight map, the same all the way, of the true one."""
    feedback = "truth" if vehicle == "kinematic" else "estimate"
    rows = reckoned(mission(3, SKEWED, auvs={"vehicle": vehicle, "feedback": feedback}))
    way = (rows.way_x + 1j * rows.way_y).to_numpy()
    off = (rows.off_x + 1j * rows.off_y).to_numpy()
    far = abs(way) > 1.0
    factor = 1.0 + off[far] / way[far]
    assert abs(factor - factor[0]).max() < 1e-9
    assert 0.0 < abs(abs(factor[0]) - 1.0) < 0.1
    assert 0.0 < abs(np.angle(factor[0], deg=True)) < 10.0


def test_through_the_water_it_is_the_way_through_the_water() -> None:
    """A vehicle that holds its place in a current is told of the way that it makes against it."""
    hold = {"kind": "hold", "positions_m": [[0.0, 0.0]] * 3}
    tables = mission(
        5,
        {**SKEWED, "velocity": "through_water"},
        auvs={"route": hold},
        environment={"current_m_per_s": 0.5},
    )
    rows = reckoned(tables)
    told = (rows.off_x + 1j * rows.off_y)[1:] / (-0.5 * rows.time_s[1:])
    assert abs(told - told.iloc[0]).max() < 1e-9
    assert told.iloc[0] != pytest.approx(1.0, abs=1e-4)
    dry = reckoned(mission(5, SKEWED))
    turned = 1.0 + (dry.off_x + 1j * dry.off_y).iloc[-1] / (dry.way_x + 1j * dry.way_y).iloc[-1]
    assert told.iloc[0] == pytest.approx(turned, abs=1e-9)


def test_each_auv_draws_its_scale_factor_and_heading() -> None:
    """With the spread asked for, of each AUV and seed, whoever else is there."""

    def told(count: int, seed: int) -> np.ndarray:
        [off] = straight([120.0], count, seed, **EXACT, **SKEWED)
        return 1.0 + off / (120.0 * np.exp(1j * YAW))

    drawn = told(1000, 0)
    bound = 4.0 / math.sqrt(2 * len(drawn))
    assert np.std(np.abs(drawn)) == pytest.approx(0.02, rel=bound)
    assert np.std(np.angle(drawn, deg=True)) == pytest.approx(2.0, rel=bound)
    assert told(1, 0) == pytest.approx(drawn[:1])
    assert told(1, 0) != pytest.approx(told(1, 1))


@pytest.mark.parametrize("frame", ["world", "body"])
def test_a_bias_that_wanders_has_the_spread_and_memory_asked_for(frame: str) -> None:
    """Variance and covariance of what it has done on a straight leg, over many AUVs."""
    sd, lasts = 0.05, 40.0
    ends = straight([40.0, 80.0], 1000, 0, speed=1.0, **EXACT, **WANDERING, bias_frame=frame)
    half, whole = (np.stack([it.real, it.imag]) for it in ends)

    def spread(time: float) -> float:
        return sd * lasts * math.sqrt(2 * (time / lasts - 1 + math.exp(-time / lasts)))

    bound = 4.0 / math.sqrt(2 * half.size)
    assert np.std(half) == pytest.approx(spread(40.0), rel=bound)
    assert np.std(whole) == pytest.approx(spread(80.0), rel=bound)
    # what the second half adds has the same variance, and is correlated with the first
    assert np.std(whole - half) == pytest.approx(spread(40.0), rel=bound)
    shared = (sd * lasts * (1 - math.exp(-1.0))) ** 2
    assert np.mean(half * (whole - half)) == pytest.approx(shared, rel=4 * bound)


def test_a_wandering_bias_begins_as_the_constant_one_and_hardly_moves_if_slow() -> None:
    """With a time constant of months both are the same, on legs and in turns."""
    constant = {"velocity_bias_sd_m_per_s": 0.05}
    slow = {**constant, "velocity_bias_time_constant_s": 1e7}
    for frame in ("body", "world"):
        one, other = (reckoned(mission(1, {**it, "bias_frame": frame})) for it in (constant, slow))
        assert other.off_x.to_numpy() == pytest.approx(one.off_x.to_numpy(), abs=0.05)
        assert other.off_y.to_numpy() == pytest.approx(one.off_y.to_numpy(), abs=0.05)
        assert abs(other.off_x - one.off_x).max() > 0.0


class Program:
    """An outside program whose AUV swims in a circle."""

    def advance_to(self, time: float) -> dict[str, list[tuple[float, float, float, float]]]:
        yaw = 0.1 * time
        return {"auvs": [(20.0 * math.sin(yaw), 20.0 - 20.0 * math.cos(yaw), 5.0, yaw)]}


KINDS = {
    "kinematic": {"vehicle": "kinematic"},
    "by_estimate": {"vehicle": "bluerov2", "feedback": "estimate", "speed_m_per_s": 0.5},
    "posed": {"vehicle": "kinematic", "count": 1},
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("filter_", ["kalman", "fixed_gain"])
def test_who_looks_on_changes_nothing(kind: str, filter_: str) -> None:
    """Stops at any instants leave every bit of every table as it was, with all errors at once."""
    world = scenario(
        duration_s=45.0,
        survey={"side_m": 60.0},
        auvs=KINDS[kind],
        navigation={**WANDERING, **SKEWED, "filter": filter_},
    )

    def tables(stops: list[float]) -> dict[str, pd.DataFrame]:
        source = {"poses": Program()} if kind == "posed" else {}
        held = Mission(world, 2, **source)
        for stop in stops:
            held.advance(stop)
            held.auvs()
        return held.result().tables

    once, often = tables([]), tables(np.linspace(0.3, 44.9, 33).tolist())
    for name, table in once.items():
        pd.testing.assert_frame_equal(table, often[name], check_exact=True)
    assert once["fixes"].shape[0] > 5


def test_who_steers_by_a_skewed_compass_goes_astray_by_it() -> None:
    """Without fixes the path flown is the one planned, as log and compass make it."""
    route = {"kind": "waypoints", "points_m": [[[-50.0, 0.0], [50.0, 0.0]]]}
    tables = mission(
        3,
        SKEWED,
        auvs={"count": 1, "vehicle": "bluerov2", "feedback": "estimate", "route": route,
              "speed_m_per_s": 0.6},
    )  # fmt: skip
    rows = reckoned(tables)
    assert rows.imu_y_m[60:].abs().max() < 0.1  # where it believes to be: on its line
    told = (rows.way_x + rows.off_x + 1j * (rows.way_y + rows.off_y)).iloc[-1]
    made = (rows.way_x + 1j * rows.way_y).iloc[-1]
    assert abs(np.angle(made, deg=True)) == pytest.approx(
        abs(np.angle(told / made, deg=True)), abs=0.3
    )
