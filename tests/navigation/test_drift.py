"""Inertial systems as their sheets state them: what is stated is what is found when it is flown."""

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats
from worlds import merged, scenario

from bindusbl_des import Scenario, Setup, View, simulate

SPEED, MANY, YAW = 2.0, 1000, 0.6
SHARES = {"cep": 0.5, "p95": 0.95}
STATISTICS = ["cep", "drms", "p95"]

# Errors that are drawn once hold at any distance.
CONSTANT = {"line_m": None}


def straight(
    ways: list[float], count: int = MANY, seed: int = 0, speed: float = SPEED, **navigation: Any
) -> np.ndarray:
    """Return how far off along x + iy dead reckoning is (m) after straight ways (m), of each of
    many AUVs that nobody hears, (ways, AUVs).
    """
    far, step = max(ways), math.gcd(*map(round, ways))
    there = [1e4 + far * math.cos(YAW), far * math.sin(YAW)]
    world = scenario(
        duration_s=far / speed + 0.5,
        auvs={
            "count": count, "speed_m_per_s": speed,
            "route": {"kind": "waypoints", "points_m": [[[1e4, 0.0], there]] * count},
        },
        asvs={"count": 1},
        protocol={"shortest_uplink_slot_s": 60.0, "schedule": everybody},
        navigation={"imu_rate_hz": 1.0, "filter": "dead_reckoning", **navigation},
        record={"tracks_hz": speed / step},
    )  # fmt: skip
    tracks = simulate(world, seed).tables["tracks"]
    tracks = tracks[tracks.imu_x_m.notna()]
    found = []
    for way in ways:
        at = tracks[np.isclose(tracks.time_s, way / speed)]
        found.append((at.imu_x_m - at.x_m) + 1j * (at.imu_y_m - at.y_m))
    return np.array(found)


def everybody(view: View) -> list[list[int]]:
    """Have all AUVs ping at once."""
    return [list(range(len(view.auvs)))]


def offs(drift: dict[str, Any], ways: list[float], **navigation: Any) -> np.ndarray:
    """Return how far off dead reckoning is (m) after straight ways (m), (AUVs, ways)."""
    return np.abs(straight(ways, drift=drift, **navigation)).T


def check(found: np.ndarray, stated: float, statistic: str) -> None:
    """See that errors (m) have a statistic, within 99.9 % bounds of that many."""
    if statistic == "drms":
        low, high = stats.chi2.ppf((0.0005, 0.9995), 2 * found.size) / (2 * found.size)
        assert low < np.mean(found**2) / stated**2 < high
    else:
        share = SHARES[statistic]
        low, high = stats.binom.ppf((0.0005, 0.9995), found.size, share)
        assert low <= np.sum(found <= stated) <= high


@pytest.mark.parametrize("statistic", STATISTICS)
def test_a_percentage_holds_at_any_distance(statistic: str) -> None:
    ways = [40.0, 200.0, 1000.0]
    found = offs({"percent_of_distance": 0.5, "statistic": statistic, **CONSTANT}, ways)
    for way, off in zip(ways, found.T, strict=True):
        check(off, 0.005 * way, statistic)


@pytest.mark.parametrize("frame", ["body", "world"])
def test_metres_per_hour_hold_at_any_time(frame: str) -> None:
    found = offs(
        {"m_per_hour": 90.0, "statistic": "p95", **CONSTANT}, [40.0, 400.0], bias_frame=frame
    )
    for seconds, off in zip((20.0, 200.0), found.T, strict=True):
        check(off, seconds / 40.0, "p95")


@pytest.mark.parametrize("given", [{}, {"time_constant_s": 15.0}])
@pytest.mark.parametrize("figure", [{"percent_of_distance": 1.0}, {"m_per_hour": 72.0}])
def test_with_a_line_it_is_met_at_its_end_alone(
    figure: dict[str, float], given: dict[str, float]
) -> None:
    """Twice as far it is less of the distance: what wanders grows as the square root at last."""
    found = offs({**figure, "statistic": "drms", "line_m": 200.0, **given}, [200.0, 400.0])
    check(found[:, 0], 2.0, "drms")
    assert np.sqrt(np.mean(found[:, 1] ** 2)) < 0.92 * 4.0
    late = math.sqrt(np.mean(found[:, 1] ** 2) / np.mean(found[:, 0] ** 2))
    passed = np.array([100.0, 200.0]) / given.get("time_constant_s", 100.0)
    once, twice = np.sqrt(passed - 1 + np.exp(-passed))
    assert late == pytest.approx(twice / once, rel=0.05)


def test_by_default_errors_wander_over_a_kilometre() -> None:
    """The sheet is met there; over 4 km it is as if each were an eighth less of the distance."""
    sheet = {"percent_of_distance": 0.5, "statistic": "drms"}
    assert scenario(navigation={"drift": sheet}).navigation.drift.line_m == 1000.0
    found = offs(sheet, [1000.0, 4000.0], speed=20.0)
    check(found[:, 0], 5.0, "drms")
    once, late = (math.sqrt(2 * (t - 1 + math.exp(-t))) for t in (1.0, 4.0))
    rms = np.sqrt(np.mean(found[:, 1] ** 2))
    assert rms == pytest.approx(5.0 * late / once, rel=4 / math.sqrt(2 * MANY))


CONSTANTLY = [
    {"auvs": {"count": 2, "route": {"kind": "hold", "positions_m": [[5.0, 0.0], [-5.0, 0.0]]}}},
    {"auvs": {"count": 2, "speeds_m_per_s": [1.0, 2.0]}},
    {"protocol": {"ranging": "passive"}},
    {"navigation": {"drift": {"percent_of_distance": 0.5, "line_m": None}}},
]


@pytest.mark.parametrize("changes", CONSTANTLY)
def test_where_no_one_speed_is_planned_they_are_constant(changes: dict[str, Any]) -> None:
    """AUVs that hold still, go at several speeds, or whose heading turns their array as well."""
    drift = {"drift": {"percent_of_distance": 0.5, "statistic": "drms"}}
    found = Setup(scenario(**merged({"navigation": drift}, changes))).own_sensors
    assert found.bias_sd_m_per_s == 0.0
    assert found.scale_factor_sd == pytest.approx(0.005 / math.sqrt(2.0), rel=0.2)


def test_a_report_says_how_drift_is_drawn() -> None:
    for line, words in ((1000.0, "wandering over 1000 m."), (None, "constant for the mission.")):
        told = Setup(survey({"percent_of_distance": 0.3, "line_m": line})).drift_words
        assert "is a scale factor of" in told
        assert told.endswith(words)


def test_what_else_is_wrong_with_log_and_compass_is_added() -> None:
    sheet = {"percent_of_distance": 0.5, "statistic": "drms"}
    found = offs({**sheet, **CONSTANT}, [400.0], scale_factor_sd=0.01)
    expected = 400.0 * math.hypot(0.005, 0.01)  # sqrt(s^2 + (s^2 + 0.01^2)), 2 s^2 = 0.005^2
    assert np.sqrt(np.mean(found**2)) == pytest.approx(expected, rel=4 / math.sqrt(2 * MANY))


def test_the_default_is_what_the_paper_flies() -> None:
    """13.5 % of the distance."""
    off = Setup(scenario()).own_sensors.straight_drift_rms(300.0, 0.627)
    assert off / (0.627 * 300.0) == pytest.approx(0.1354, abs=5e-5)


SHEETS = [
    {"percent_of_distance": 0.3},
    {"percent_of_distance": 0.3, "line_m": None},
    {"percent_of_distance": 0.3, "statistic": "drms", "line_m": 1000.0, "time_constant_s": 60.0},
    {"m_per_hour": 20.0, "statistic": "p95"},
]


@pytest.mark.parametrize("drift", SHEETS)
def test_written_out_and_read_again_it_is_the_same(drift: dict[str, Any]) -> None:
    """In full, or only what was given, to which the sheet may be taken back again."""
    one = scenario(navigation={"drift": drift})
    assert one.navigation.random_walk_m_per_sqrt_s == 0.0
    assert one.navigation.velocity_bias_m_per_s == (0.0, 0.0)
    for given in (one.model_dump(mode="json"), one.model_dump(mode="json", exclude_unset=True)):
        again = Scenario.model_validate(given)
        assert (again, Setup(again).own_sensors) == (one, Setup(one).own_sensors)
    del given["navigation"]["drift"]
    assert Setup(Scenario.model_validate(given)).own_sensors == Setup(scenario()).own_sensors


@pytest.mark.parametrize(
    ("key", "value"),
    [("velocity_bias_m_per_s", [0.06, 0.06]), ("velocity_bias_sd_m_per_s", 0.01),
     ("velocity_bias_time_constant_s", 60.0), ("random_walk_m_per_sqrt_s", 0.027)],
)  # fmt: skip
def test_what_it_replaces_is_refused_beside_it(key: str, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"navigation.{key}: is replaced by .*remove it or set"):
        scenario(navigation={"drift": {"percent_of_distance": 0.3}, key: value})


def test_two_statements_of_one_system_are_refused() -> None:
    with pytest.raises(ValueError, match=r"navigation.drift.m_per_hour: .*keep one of them"):
        scenario(navigation={"drift": dict.fromkeys(("percent_of_distance", "m_per_hour"), 0.3)})


def survey(drift: dict[str, Any], **changes: Any) -> Scenario:
    """Return a survey whose AUVs know of their drift by its sheet, looked at once at the end."""
    base = {
        "duration_s": 150.1,
        "auvs": {"speed_m_per_s": 1.5},
        "survey": {"side_m": 140.0},
        "acoustics": {"hf": {"range_m": 50.0}, "mf": {"range_m": 100.0}},
        "navigation": {"drift": drift},
        "record": {"tracks_hz": 1 / 150.0},
    }
    return scenario(**merged(base, changes))


def nees(tested: Scenario, runs: int) -> float:
    """Return the mean e' P^-1 e at the end, over seeds and AUVs."""
    found = []
    for seed in range(runs):
        rows = simulate(tested, seed).tables["tracks"]
        rows = rows[(rows.time_s > 0.0) & rows.vehicle.str.startswith("AUV")]
        x, y = rows.estimate_x_m - rows.x_m, rows.estimate_y_m - rows.y_m
        xx, yy, xy = rows.estimate_sd_x_m**2, rows.estimate_sd_y_m**2, rows.estimate_cov_xy_m2
        found.append((yy * x**2 - 2 * xy * x * y + xx * y**2) / (xx * yy - xy**2))
    return float(np.mean(found))


@pytest.mark.parametrize("filter_", ["kalman", pytest.param("smoother", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "drift", [{"percent_of_distance": 2.0, "line_m": line} for line in (None, 100.0, 1000.0)]
)
def test_navigators_know_of_it(drift: dict[str, Any], filter_: str) -> None:
    """NEES of three AUVs over 40 seeds, taken for as few as 40 independent errors of two axes."""
    low, high = stats.chi2.ppf((0.0005, 0.9995), 80) / 40
    assert low < nees(survey(drift, navigation={"filter": filter_}), 40) < high


def test_who_is_not_told_of_it_is_too_sure() -> None:
    ignorant = {"untold": ["heading", "scale_factor"], "random_walk_m_per_sqrt_s": 0.01}
    told = {"filter": {"model": "kalman", **ignorant}}
    assert nees(survey({"percent_of_distance": 2.0, **CONSTANT}, navigation=told), 20) > 6.0


@pytest.mark.slow
@pytest.mark.parametrize("statistic", STATISTICS)
def test_a_thousand_missions_find_the_figure_again(statistic: str) -> None:
    """On straight ways of 30, 60 and 120 m, by the whole mission."""
    route = {"kind": "waypoints", "points_m": [[[-65.0, 0.0], [65.0, 0.0]]]}
    flown = survey(
        {"percent_of_distance": 1.0, "statistic": statistic, **CONSTANT},
        duration_s=81.0,
        auvs={"count": 1, "route": route},
        asvs={"count": 1},
        navigation={"filter": "dead_reckoning"},
        record={"tracks_hz": 0.05},
    )
    found: dict[float, list[float]] = {20.0: [], 40.0: [], 80.0: []}
    for seed in range(1000):
        rows = simulate(flown, seed).tables["tracks"]
        rows = rows[rows.vehicle == "AUV0"].set_index("time_s")
        for time, off in found.items():
            it = rows.loc[time]
            off.append(math.hypot(it.imu_x_m - it.x_m, it.imu_y_m - it.y_m))
    for time, off in found.items():
        check(np.array(off), 0.01 * 1.5 * time, statistic)


def test_an_inertial_system_by_its_name() -> None:
    """Its figures stand for what is not given, and are written out and read again."""
    one = scenario(navigation={"drift": {"preset": "rlg_dvl_sea"}}).navigation.drift
    assert (one.percent_of_distance, one.statistic, one.line_m) == (0.2, "cep", 1000.0)
    assert one.model_fields_set == {"preset"}
    own = scenario(navigation={"drift": {"preset": "rlg_dvl_sea", "percent_of_distance": 0.3}})
    assert own.navigation.drift.percent_of_distance == 0.3
    for given in (own.model_dump(mode="json"), own.model_dump(mode="json", exclude_unset=True)):
        assert Scenario.model_validate(given) == own
    with pytest.raises(ValueError, match=r"no inertial preset is named 'rlg'.*did you mean"):
        scenario(navigation={"drift": {"preset": "rlg"}})
