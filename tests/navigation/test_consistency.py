"""Whether a Kalman navigator knows how far off it is, and whether fixes are worth taking in."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats
from worlds import merged, paper_case, scenario, still

from bindusbl_des import Scenario, load_scenario, simulate

# Each option alone
OPTIONS: dict[str, dict[str, Any]] = {
    "nothing": {},
    "start": {"initial_position_sd_m": 2.0},
    "world": {"bias_frame": "world"},
    "wandering": {"velocity_bias_time_constant_s": 60.0},
    "wandering_in_the_world": {"velocity_bias_time_constant_s": 60.0, "bias_frame": "world"},
    "scale_factor": {"scale_factor_sd": 0.03},
    "heading": {"heading_sd_deg": 3.0},
}
ALL = {
    **OPTIONS["start"], **OPTIONS["wandering"], **OPTIONS["scale_factor"], **OPTIONS["heading"]
}  # fmt: skip
# An inertial system whose bias would not hide what else is wrong
GOOD = {"velocity_bias_sd_m_per_s": 0.002, "random_walk_m_per_sqrt_s": 0.005}


def drawn(until: float, *navigation: dict[str, Any], **changes: Any) -> Scenario:
    """Return the recovery mission with a bias that is drawn, and a Kalman navigator."""
    told = {"filter": "kalman", "velocity_bias_m_per_s": [0.0, 0.0]}
    told |= {"velocity_bias_sd_m_per_s": 0.06}
    for further in navigation:
        told |= further
    base = {
        "duration_s": until + 0.1,
        "navigation": told,
        "acoustics": {"loss": {"combine": "off"}},
        "record": {"detail": "full", "tracks_hz": 1 / until},
    }
    return paper_case(changes.pop("asvs", 3), **merged(base, changes))


def nees(tested: Scenario, runs: int) -> np.ndarray:
    """Return the mean e' P^-1 e of each AUV at the end, over seeds."""
    found = []
    for seed in range(runs):
        rows = simulate(tested, seed).tables["tracks"]
        rows = rows[(rows.time_s > 0.0) & rows.vehicle.str.startswith("AUV")]
        x, y = rows.estimate_x_m - rows.x_m, rows.estimate_y_m - rows.y_m
        xx, yy, xy = rows.estimate_sd_x_m**2, rows.estimate_sd_y_m**2, rows.estimate_cov_xy_m2
        found.append((yy * x**2 - 2 * xy * x * y + xx * y**2) / (xx * yy - xy**2))
    return np.asarray(np.mean(found, axis=0))


def bounds(runs: int) -> tuple[float, float]:
    """Return where the means of that over seeds of all three AUVs lie with 99.9 % (chi-squared)."""
    out = 0.0005 / 3
    low, high = stats.chi2.ppf((out, 1 - out), 2 * runs) / runs
    return float(low), float(high)


def check(tested: Scenario, runs: int) -> None:
    low, high = bounds(runs)
    means = nees(tested, runs)
    assert ((low < means) & (means < high)).all(), means


def test_errors_are_as_large_as_covariances_say() -> None:
    """With everything wrong at once, and told of: NEES at 200 s over 100 seeds."""
    check(drawn(200.0, ALL), 100)


@pytest.mark.parametrize("untold", ["heading", "velocity_bias"])
def test_what_is_not_told_shows(untold: str) -> None:
    """Left ignorant of one of them, a filter is too sure: NEES is 3.5 and 15, not 2."""
    ignorant = {"filter": {"model": "kalman", "untold": [untold]}}
    kind = {"heading": "heading", "velocity_bias": "wandering"}[untold]
    assert nees(drawn(95.0, GOOD, OPTIONS[kind], ignorant), 30).max() > bounds(30)[1]


@pytest.mark.slow
@pytest.mark.parametrize("system", [{}, GOOD], ids=["paper", "good"])
@pytest.mark.parametrize("option", OPTIONS)
@pytest.mark.parametrize("asvs", [1, 3])
def test_each_option_alone_is_known(asvs: int, option: str, system: dict[str, Any]) -> None:
    """NEES within its 99.9 % bounds over 200 seeds, with one ASV and long gaps as well."""
    for instant in (95.0, 285.0):
        check(drawn(instant, system, OPTIONS[option], asvs=asvs), 200)


@pytest.mark.slow
@pytest.mark.parametrize("feedback", ["truth", "estimate"])
@pytest.mark.parametrize("asvs", [1, 3])
def test_all_options_together_are_known(asvs: int, feedback: str) -> None:
    """The same with all at once, also of who steers by the estimates."""
    auvs = {"vehicle": "bluerov2", "feedback": feedback}
    check(drawn(200.0, ALL, asvs=asvs, auvs=auvs), 100)
    check(drawn(200.0, {**ALL, "velocity_bias_m_per_s": [0.03, -0.02]}, asvs=asvs), 200)


@pytest.mark.slow
@pytest.mark.parametrize("untold", ["heading", "scale_factor", "velocity_bias", "initial_position"])
def test_each_that_is_not_told_shows(untold: str) -> None:
    """Outside the bounds over 200 seeds."""
    kind = {"velocity_bias": "wandering", "initial_position": "start"}.get(untold, untold)
    ignorant = {"filter": {"model": "kalman", "untold": [untold]}}
    assert nees(drawn(95.0, GOOD, OPTIONS[kind], ignorant), 200).max() > bounds(200)[1]


@pytest.mark.parametrize(
    ("ranging", "elevation_deg", "aside_m"),
    [("owtt_sync", 1.0, 1.0), ("owtt_sync", 3.0, 4.0),
     *(pytest.param(way, 1.0, aside, marks=pytest.mark.slow)
       for way in ("owtt_sync", "twtt", "passive") for aside in (0.0, 2.0, 6.0, 20.0))],
)  # fmt: skip
@pytest.mark.parametrize("filter_", ["kalman", "smoother"])
def test_slow_angles_are_known_near_the_vertical(
    filter_: str, ranging: str, elevation_deg: float, aside_m: float
) -> None:
    """An AUV 30 m below its ASV and a little aside, where which way is level is all but unknown:
    an error that turned with it, taken at the fix, errs by the same number (NEES 14 to 163).
    """
    angles = {"bearing_sd_deg": 1.0, "elevation_sd_deg": elevation_deg}
    model = {"model": "datasheet", **angles, "range_sd_m": 0.1}
    below = still(
        1, at=aside_m, duration_s=100.1, survey={"depth_m": 30.0}, protocol={"ranging": ranging},
        usbl={"model": model, "slow_share": 0.9, "correlation_s": 60.0},
        navigation={"filter": filter_, "velocity_bias_m_per_s": [0.0, 0.0],
                    "velocity_bias_sd_m_per_s": 0.06},
        record={"detail": "full", "tracks_hz": 0.05},
    )  # fmt: skip
    assert nees(below, 30).mean() < 3.2


def few(*everyday: tuple[Any, ...], slow: list[tuple[Any, ...]]) -> list[Any]:
    """Return parameters of which some are for every day."""
    return [*everyday, *(pytest.param(*one, marks=pytest.mark.slow) for one in slow)]


@pytest.mark.parametrize(
    ("depth_m", "ranging", "runs"),
    few((40.0, "owtt_sync", 15), (80.0, "owtt_sync", 15), (80.0, "passive", 4),
        slow=[(depth, way, 60) for depth in (10.0, 80.0, 200.0)
              for way in ("owtt_sync", "twtt", "passive")]),
)  # fmt: skip
@pytest.mark.parametrize("filter_", ["kalman", "smoother"])
def test_who_hovers_below_a_vessel_knows_how_well(
    filter_: str, depth_m: float, ranging: str, runs: int
) -> None:
    """Where nobody moves, whatever errs alike from ping to ping is no noise.  With arrival
    differences rounded to 1 us NEES was 4.8 (smoother 7.1) at 40 m, 7.3 (12) at 80 m, 13 (22) at
    200 m; with passive ranging 16 (29) at 80 m.
    """
    places = [[2.6, 1.0], [5.0, -8.0], [-15.0, 3.0]]
    held = still(
        3, side=100.0, duration_s=600.0, survey={"depth_m": depth_m},
        auvs={"route": {"positions_m": places}}, protocol={"ranging": ranging},
        acoustics={"hf": {"range_m": max(150.0, 2.0 * depth_m)}, "mf": {"range_m": 600.0}},
        navigation={"filter": filter_, "velocity_bias_m_per_s": [0.0, 0.0],
                    "random_walk_m_per_sqrt_s": 0.005, "initial_position_sd_m": 1.0},
        record={"detail": "full", "tracks_hz": 0.02},
    )  # fmt: skip
    assert nees(held, runs).mean() < (2.9 if runs < 20 else 2.5)


@pytest.mark.parametrize(
    ("start_m", "runs"), few((10.0, 30), slow=[(m, 150) for m in (2.0, 5.0, 10.0)])
)
@pytest.mark.parametrize("filter_", ["kalman", "smoother"])
def test_who_learns_its_start_from_afar_knows_how_well(
    filter_: str, start_m: float, runs: int
) -> None:
    """One vessel 500 m away whose angles err slowly, which tells ranges from directions only as
    far as the AUV knows which way it is seen.  NEES was 3.8 (smoother 10) with a start
    known to 10 m.
    """
    angles = {"model": "datasheet", "bearing_sd_deg": 1.0, "range_sd_m": 0.1}
    afar = scenario(
        duration_s=600.0, survey={"side_m": 140.0, "depth_m": 10.0},
        auvs={"count": 1, "speed_m_per_s": 0.627,
              "route": {"kind": "lawnmower", "lane_spacing_m": 10, "end_margin_m": 5}},
        asvs={"count": 1, "formation": {"positions_m": [[500.0, 0.0]]}},
        acoustics={"hf": {"range_m": 1500.0}, "mf": {"range_m": 3000.0}, "loss": {"law": "none"}},
        usbl={"model": angles, "slow_share": 0.9, "correlation_s": 600.0},
        navigation={"filter": filter_, "drift": {"percent_of_distance": 1.0},
                    "initial_position_sd_m": start_m},
        record={"detail": "full", "tracks_hz": 0.05},
    )  # fmt: skip
    assert nees(afar, runs).mean() < 3.0


def test_settings_tune_what_the_filter_believes() -> None:
    """A prior, a start and a process noise of one's own are what it reports where no fix comes."""
    told = {"initial_position_sd_m": 3.0, "velocity_bias_sd_m_per_s": 0.0}
    filter_ = {"model": "kalman", "random_walk_m_per_sqrt_s": 0.5, **told}
    deaf = {"hf": {"range_m": 0.1}, "mf": {"range_m": 0.1}}
    tested = drawn(100.0, {"filter": filter_}, acoustics=deaf)
    rows = simulate(tested, 0).tables["tracks"]
    last = rows[(rows.time_s == 100.0) & (rows.vehicle == "AUV0")].iloc[0]
    assert last.estimate_sd_x_m == pytest.approx(math.sqrt(9.0 + 25.0), rel=1e-9)


def harm(tested: Scenario, runs: int) -> list[str]:
    """Return the AUVs that fixes make worse than none: mean over seeds, beyond noise and 2 %."""
    alone, benefit = [], []
    for seed in range(runs):
        auvs = simulate(tested, seed).auvs
        alone.append(auvs.imu_error_m)
        benefit.append(auvs.fix_benefit_m)
    mean, error = np.mean(benefit, axis=0), np.std(benefit, axis=0, ddof=1) / math.sqrt(runs)
    worse = mean < -0.02 * np.mean(alone, axis=0) - 3.0 * error
    return [f"AUV{auv} {mean[auv]:.3f} m" for auv in np.flatnonzero(worse)]


SHIPPED = sorted((Path(__file__).parents[2] / "scenarios").glob("*.yaml"))


@pytest.mark.parametrize(
    "path",
    [pytest.param(it, marks=[] if it.stem == "failure_140m" else pytest.mark.slow, id=it.stem)
     for it in SHIPPED],
)  # fmt: skip
def test_fixes_harm_nobody_in_what_ships(path: Path) -> None:
    tested = load_scenario(
        path, overrides=["navigation.filter=kalman", "record.detail=summary", "record.metrics_hz=2"]
    )
    assert harm(tested, 10) == []


def anything(number: int) -> Scenario:
    """Return a random mission: who, where, how far heard, and how wrong everything is."""
    rng = np.random.default_rng(number)

    def some(value: float) -> float:
        return float(value * rng.uniform() * (rng.uniform() < 0.5))

    side = float(rng.uniform(60.0, 300.0))
    return scenario(
        duration_s=float(rng.uniform(60.0, 200.0)),
        survey={"side_m": side, "depth_m": float(rng.uniform(2.0, 30.0))},
        auvs={"count": int(rng.integers(1, 5)), "speed_m_per_s": float(rng.uniform(0.3, 2.0))},
        asvs={"count": int(rng.integers(1, 5)),
              "formation": {"radius_m": float(rng.uniform(0.1, 0.6)) * side}},
        acoustics={"hf": {"range_m": float(rng.uniform(0.3, 2.0)) * side},
                   "mf": {"range_m": float(rng.uniform(1.0, 3.0)) * side}},
        protocol={"ranging": str(rng.choice(["owtt_sync", "twtt"]))},
        usbl={"heading_sd_deg": float(rng.uniform(0.2, 4.0)),
              "misalignment_sd_deg": some(3.0), "gnss_correlated_sd_m": some(2.0)},
        navigation={
            "velocity_bias_m_per_s": [some(0.1), some(0.1)],
            "velocity_bias_sd_m_per_s": some(0.1),
            "velocity_bias_time_constant_s": float(rng.uniform(20.0, 600.0)),
            "random_walk_m_per_sqrt_s": float(10 ** rng.uniform(-3.0, -1.0)),
            "initial_position_sd_m": some(3.0),
            "scale_factor_sd": some(0.03),
            "heading_sd_deg": some(4.0),
            "bias_frame": str(rng.choice(["body", "world"])),
        },
        record={"detail": "summary", "metrics_hz": 2.0},
    )  # fmt: skip


@pytest.mark.parametrize(
    "numbers",
    [
        range(4),
        *(pytest.param(range(n, n + 20), marks=pytest.mark.slow) for n in range(0, 200, 20)),
    ],
    ids=str,
)
def test_fixes_harm_nobody_at_random(numbers: range) -> None:
    """A filter that is told of what is wrong is never better off without fixes."""
    found = {number: worse for number in numbers if (worse := harm(anything(number), 8))}
    assert found == {}


# Errors that last, and of which a filter may be told something else
LASTING: dict[str, tuple[str, dict[str, Any]]] = {
    "bias": ("navigation", {"velocity_bias_sd_m_per_s": 0.1}),
    "walk": ("navigation", {"random_walk_m_per_sqrt_s": 0.1}),
    "wandering": (
        "navigation", {"velocity_bias_sd_m_per_s": 0.1, "velocity_bias_time_constant_s": 20.0},
    ),
    "scale_factor": ("navigation", {"scale_factor_sd": 0.2}),
    "heading": ("navigation", {"heading_sd_deg": 15.0}),
    "start": ("navigation", {"initial_position_sd_m": 3.0}),
    "clock": ("navigation", {"clock_offset_sd_s": 5e-4}),
    "misalignment": ("usbl", {"misalignment_sd_deg": 5.0}),
    "gnss": ("usbl", {"gnss_correlated_sd_m": 1.0}),
    "slow": ("usbl", {"slow_share": 0.9, "correlation_s": 60.0}),
    "sound_speed": ("environment", {"assumed_sound_speed_m_per_s": 1530.0}),
}  # fmt: skip
FREE: dict[str, Any] = {
    "acoustics": {"loss": {"combine": "off"}}, "record": {"detail": "full"},
    "navigation": {"velocity_bias_m_per_s": [0.0, 0.0], "random_walk_m_per_sqrt_s": 0.01,
                       "initial_position_sd_m": 0.5, "nis_gate": None},
}  # fmt: skip


def told_of(world: dict[str, Any], **filter_: Any) -> tuple[np.ndarray, bytes]:
    """Return how sure AUVs are of themselves (m), and all that is recorded of them."""
    options = {"navigation": {"filter": {"model": "kalman", **filter_}}}
    tested = paper_case(2, **merged(merged({"duration_s": 30.0, **FREE}, world), options))
    rows = simulate(tested, 3).tables["tracks"]
    rows = rows[rows.vehicle.str.startswith("AUV")]
    spreads = rows[["estimate_sd_x_m", "estimate_sd_y_m"]].to_numpy()
    return spreads, rows.to_csv().encode()


@pytest.mark.parametrize("error", LASTING)
def test_a_filter_may_assume_something_else_than_is_true(error: str) -> None:
    """It is as sure of itself as where that were true, whatever is; what it assumes of the rest is
    the scenario's.
    """
    section, wrong = LASTING[error]
    usual = Scenario(name="m").model_dump()[section]
    right = {name: FREE.get(section, {}).get(name, usual[name]) for name in wrong}
    planned, known = told_of({}), told_of({section: wrong})
    unknown = told_of({section: wrong}, assumes={section: right})
    assert (unknown[0] / planned[0]).mean() == pytest.approx(1.0, abs=0.02)
    assert (known[0] / planned[0]).mean() > 1.04
    assert unknown[1] not in (planned[1], known[1])
    assert told_of({section: wrong}, assumes={section: wrong})[1] == known[1]


def test_a_sheet_of_an_inertial_system_may_be_taken_for_another() -> None:
    """Both statements of it, wandering or not: as of the other sheet where no fix comes."""
    deaf = {"hf": {"range_m": 0.1}, "mf": {"range_m": 0.1}}
    for one, other in (
        ({"percent_of_distance": 1.0}, {"percent_of_distance": 0.5}),
        ({"percent_of_distance": 1.0, "line_m": 50.0}, {"line_m": 300.0}),
        ({"percent_of_distance": 1.0}, {"line_m": None}),
        ({"m_per_hour": 50.0}, {"m_per_hour": 5.0}),
    ):
        base = {"acoustics": deaf, "navigation": FREE["navigation"] | {"drift": one}}
        base["navigation"].pop("velocity_bias_m_per_s")
        base["navigation"].pop("random_walk_m_per_sqrt_s")
        sure = []
        for drift, assumes in ((one, other), ({**one, **other}, {})):
            filter_ = {"model": "kalman", "assumes": {"navigation": {"drift": assumes}}}
            tested = scenario(**merged(base, {"navigation": {"drift": drift, "filter": filter_}}))
            tracks = simulate(tested, 0).tables["tracks"]
            sure.append(tracks[["estimate_sd_x_m", "estimate_sd_y_m"]].to_numpy())
        assert sure[0] == pytest.approx(sure[1], rel=0.02, nan_ok=True)


@pytest.mark.parametrize(
    ("assumes", "said"),
    [
        ({"navigation": {"scale_factr_sd": 0.1}}, "assumes.navigation.scale_factr_sd.*scale_"),
        ({"navigation": {"filter": "kalman"}}, "assumes.navigation.filter: is nothing"),
        ({"usbl": {"slow_share": 3}}, "assumes.usbl.slow_share: must be <= 1; got 3"),
        ({"usbl": {"gnss_sd_m": 3}}, "assumes.usbl.gnss_sd_m: is nothing"),
        ({"navigation": {"drift": {"line": 3}}}, "assumes.navigation.drift.line: is no such key"),
        ({"usbl": 3}, "assumes.usbl: needs keys and values"),
        (3, "assumes: needs keys and values"),
        (
            {"navigation": {"drift": {"m_per_hour": 3}, "scale_factor_sd": 0.1,
                            "random_walk_m_per_sqrt_s": 0.1}},
            "assumes.navigation.random_walk_m_per_sqrt_s: is replaced by navigation.drift",
        ),
    ],
)  # fmt: skip
def test_what_a_filter_cannot_assume_is_refused(assumes: Any, said: str) -> None:
    """With the key, the rule and the remedy."""
    with pytest.raises(ValueError, match=rf"navigation.filter.{said}"):
        scenario(navigation={"filter": {"model": "kalman", "assumes": assumes}})
    with pytest.raises(ValueError, match=r"assumes: unknown setting"):
        scenario(navigation={"filter": {"model": "fixed_gain", "assumes": assumes}})
