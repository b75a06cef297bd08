"""Arrays of one's own, and the directions that instruments tell in tables."""

import itertools
import math
import re
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from bindusbl_des import Scenario, ScenarioError, Setup, simulate, warnings_of

# A tetrahedron, and a pyramid of five with another two, in places that lean on no axis
TETRAHEDRON = [[0.05, 0.0, -0.02], [-0.02, 0.045, -0.03], [-0.03, -0.04, -0.01], [0.0, 0.01, 0.06]]
SEVEN = [
    *([0.04, 0.01, 0.0], [-0.01, 0.04, 0.01], [-0.04, -0.02, -0.01], [0.02, -0.04, 0.005]),
    *([0.01, 0.0, 0.06], [0.03, 0.03, -0.03], [-0.02, 0.01, 0.02]),
]
QUIET = {
    "tdoa_sd_s": 0.0, "travel_time_sd_s": 0.0, "quantum_s": 0.0, "roll_sd_deg": 0.0,
    "pitch_sd_deg": 0.0, "heading_sd_deg": 0.0,
}  # fmt: skip


def scenario_of(**parts: Any) -> Scenario:
    """Return a mission of three AUVs about two ASVs, all of which hear everything."""
    base: dict[str, Any] = {
        "name": "directions",
        "duration_s": 20,
        "survey": {"side_m": 40},
        "acoustics": {"hf": {"range_m": 200.0, "channel": "disc"}, "mf": {"channel": "disc"}},
        "auvs": {"count": 3},
        "asvs": {"count": 2},
    }
    return Scenario.model_validate({**base, **parts})


def apart_deg(one: pd.Series, other: pd.Series) -> float:
    """Return the largest difference (deg) of two columns of angles."""
    return float(((one - other + 180) % 360 - 180).abs().max())


def truth_of(tables: Any) -> pd.DataFrame:
    """Return receptions that were heard, and the true azimuth and elevation of their ping."""
    heard = tables["receptions"].query("outcome == 'heard'")
    heard = heard.merge(tables["pings"][["ping", "x_m", "y_m", "z_m"]], on="ping")
    tracks = tables["tracks"]
    asvs = tracks[tracks.vehicle.str.startswith("ASV")].groupby("vehicle").first()  # moored
    at = asvs.loc[heard.asv.astype(str), ["x_m", "y_m", "z_m", "yaw_rad"]].to_numpy()
    offset = heard[["x_m", "y_m", "z_m"]].to_numpy() - at[:, :3]
    return heard.assign(
        azimuth=np.degrees(np.arctan2(offset[:, 1], offset[:, 0])),
        elevation=np.degrees(np.arctan2(offset[:, 2], np.hypot(offset[:, 0], offset[:, 1]))),
        yaw=np.degrees(at[:, 3]),
    )


@pytest.mark.parametrize("array", ["oem5", "cross5", TETRAHEDRON, SEVEN])
def test_without_noise_tables_tell_where_pings_came_from(array: Any) -> None:
    told = truth_of(simulate(scenario_of(usbl={**QUIET, "array": array}), seed=1).tables)
    assert len(told) > 20
    assert apart_deg(told.azimuth_deg, told.azimuth) < 0.15  # a wave that is not quite plane
    assert apart_deg(told.elevation_deg, told.elevation) < 0.15
    assert apart_deg(told.body_azimuth_deg, told.azimuth - told.yaw) < 0.15
    assert apart_deg(told.body_elevation_deg, told.elevation) < 0.15
    assert told.azimuth_deg.between(0, 360, inclusive="left").all()


def test_a_compass_that_errs_turns_azimuth_and_not_what_the_array_sees() -> None:
    usbl = {**QUIET, "misalignment_sd_deg": 20.0}
    told = truth_of(simulate(scenario_of(usbl=usbl, duration_s=60), seed=2).tables)
    off = (told.azimuth_deg - told.azimuth + 180) % 360 - 180
    each = off.groupby(told.asv.astype(str)).agg(["min", "max"])
    assert (each["max"] - each["min"] < 0.1).all()
    assert (each["max"].abs() > 1).any()
    assert apart_deg(told.body_azimuth_deg, told.azimuth - told.yaw) < 0.15


@pytest.mark.parametrize(
    "parts",
    [
        {"protocol": {"ranging": "twtt"}},
        {"protocol": {"ranging": "twtt"}, "usbl": {"gnss_correlated_sd_m": 1.0}},
        {"usbl": {"preset": "cerulean_rovl"}},
        {"usbl": {"misalignment_sd_deg": 1.0}},
        {"protocol": {"ranging": "passive"}},
        {"protocol": {"ranging": "passive"}, "usbl": {"misalignment_sd_deg": 1.0}},
    ],
)
def test_who_was_heard_has_a_direction_and_a_fix_of_one_asv_has_it_too(
    parts: dict[str, Any],
) -> None:
    parts = {**parts, "asvs": {"count": 2}, "acoustics": {"hf": {"range_m": 30.0}}}
    tables = simulate(scenario_of(**parts), seed=3).tables
    receptions, fixes = tables["receptions"], tables["fixes"]
    angles = ["azimuth_deg", "elevation_deg", "body_azimuth_deg", "body_elevation_deg"]
    heard = receptions.outcome == "heard"
    assert receptions.loc[heard, angles].notna().all(axis=None)
    assert receptions.loc[~heard, angles].isna().all(axis=None)
    alone = ~fixes.asvs.str.contains(" ")
    assert alone.any()
    assert fixes.loc[~alone, angles].isna().all(axis=None)
    keys = ["ping", "auv", "asv"]
    one = fixes[alone].assign(asv=fixes.asvs).merge(receptions[heard], on=keys)
    assert len(one) == alone.sum()
    for name in angles:
        assert (one[f"{name}_x"] == one[f"{name}_y"]).all()


@pytest.mark.parametrize("array", [TETRAHEDRON, SEVEN])
def test_fixes_by_an_array_of_ones_own_are_as_sure_as_they_say(array: Any) -> None:
    """Mean squared error over covariance: 3 numbers a fix, from all sides."""
    usbl = {**QUIET, "array": array, "tdoa_sd_s": 1e-7, "travel_time_sd_s": 1e-5}
    instrument, draw = Setup(scenario_of(usbl=usbl)).usbl, np.random.default_rng(4)
    squares, further = [], max(len(array) - 5, 0)
    for _ in range(4000):
        source = draw.normal(size=3)
        source *= 100.0 / np.linalg.norm(source)
        noise = draw.normal(size=13 + further)
        fix, covariance = instrument.locate(source, np.zeros(3), 0.7, 100.0 / 1500.0, noise)
        squares.append((fix - source) @ np.linalg.solve(covariance, fix - source))
    assert np.mean(squares) == pytest.approx(3.0, abs=0.15)


def test_the_noise_of_an_array_is_that_of_its_least_squares() -> None:
    """An array that is turned sees as well as before; its noise by the normal equations."""
    turn = Rotation.from_euler("xyz", (0.3, -0.5, 1.0)).as_matrix()
    usbl = {**QUIET, "tdoa_sd_s": 1e-7}
    plain = Setup(scenario_of(usbl={**usbl, "array": SEVEN})).usbl.level_sds()
    places = np.array(SEVEN) - np.mean(SEVEN, axis=0)
    sd = 1500.0 * 1e-7 / math.sqrt(2)
    worst = np.zeros(2)
    for azimuth in np.radians(range(0, 360, 5)):
        across = np.array([[-math.sin(azimuth), math.cos(azimuth), 0.0], [0.0, 0.0, 1.0]]).T
        seen = places @ across  # arrival times along the two, of the common one nothing is known
        covariance = np.linalg.inv(seen.T @ seen) * sd**2
        worst = np.maximum(worst, np.diag(covariance))
    assert plain == pytest.approx(tuple(np.sqrt(worst)))
    instruments = [
        Setup(scenario_of(usbl={**usbl, "array": (np.array(SEVEN) @ by).tolist()})).usbl
        for by in (np.eye(3), turn)
    ]
    noise = np.random.default_rng(5).normal(size=15)
    source = np.array([60.0, 20.0, 30.0])
    one, _ = instruments[0].locate(source, np.zeros(3), 0.0, 0.05, noise)
    other, _ = instruments[1].locate(turn.T @ source, np.zeros(3), 0.0, 0.05, noise)
    assert np.allclose(turn @ other, one, atol=1e-6)


def test_elements_beyond_five_have_noise_of_their_own() -> None:
    usbl = {**QUIET, "array": SEVEN, "tdoa_sd_s": 1e-6, "outlier_share": 0.1, "outlier_sd_m": 1.0}
    scenario = scenario_of(usbl=usbl, duration_s=60)
    told = truth_of(simulate(scenario, seed=6).tables)
    bearing, _ = Setup(scenario).usbl.level_sds()
    off = (told.body_azimuth_deg - told.azimuth + told.yaw + 180) % 360 - 180
    level = np.cos(np.radians(told.elevation))
    assert np.std(off * level) == pytest.approx(math.degrees(bearing), rel=0.35)


@pytest.mark.parametrize(
    ("array", "said"),
    [
        ("oem6", "one of oem5, cross5"),
        ([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], "has 3 elements; give 4 to 64"),
        ([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0.001]], "lies in a plane"),
        ([[0, 0, 0]] * 5, "lies in a plane"),
        ([[0, 0]] * 4, "places of its elements in metres"),
        ([[0, 0, math.nan]] * 4, "places of its elements in metres"),
        ([[0, 0, 11.0]] * 4, "none beyond 10 m"),
        (7, "places of its elements in metres"),
    ],
)
def test_what_is_no_array_is_refused(array: Any, said: str) -> None:
    with pytest.raises((ScenarioError, ValueError), match="array") as error:
        scenario_of(usbl={"array": array})
    assert said in str(error.value)


def test_elements_beyond_half_a_wavelength_are_named() -> None:
    sonar = {"hf": {"range_m": 200.0, "channel": "sonar"}}  # of 25 kHz
    wide = [[3 * it for it in place] for place in TETRAHEDRON]
    for array, named in ((wide, True), ([[it / 4 for it in p] for p in TETRAHEDRON], False)):
        told = warnings_of(scenario_of(usbl={"array": array}, acoustics=sonar))
        assert any("grating lobes" in str(it) for it in told) == named
    assert not any("grating" in str(it) for it in warnings_of(scenario_of(acoustics=sonar)))


def thin(height_m: float, turned: bool = False) -> list[list[float]]:
    """Return four elements around one, 0.1 m wide, and so high; on edge if it is turned."""
    half = height_m / 2
    flat = [[0.05, 0, -half], [0, 0.05, half], [-0.05, 0, -half], [0, -0.05, half], [0, 0, half]]
    return [[z, x, y] for x, y, z in flat] if turned else flat


@pytest.mark.parametrize(
    ("height_m", "depth_m", "turned", "named"),
    [
        (0.006, 5.0, False, True),  # 3-D NEES of fixes 4.2 to 4.7, at 0.2 m width 7 to 25
        (0.006, 40.0, False, False),  # steeper than the mirror image matters: 2.9
        (0.012, 5.0, False, False),  # 3.1
        (0.003, 40.0, True, True),  # on edge some AUV is always in its plane: 26
    ],
)
def test_an_array_that_hardly_tells_up_from_down_is_named(
    height_m: float, depth_m: float, turned: bool, named: bool
) -> None:
    array = thin(height_m, turned)
    tested = scenario_of(
        usbl={"array": array}, survey={"depth_m": depth_m}, acoustics={"hf": {"range_m": 50.0}}
    )
    told = [str(it) for it in warnings_of(tested) if "mirror images" in str(it)]
    assert len(told) == named
    if named:
        [thick] = re.findall(r"make it (\S+) mm", told[0])
        assert float(thick) > 1e3 * height_m
        thicker = scenario_of(
            usbl={"array": thin(1.06e-3 * float(thick), turned)}, survey={"depth_m": depth_m}
        )
        assert not any("mirror images" in str(it) for it in warnings_of(thicker))


def test_a_scenario_with_an_array_is_written_and_read_again() -> None:
    scenario = scenario_of(usbl={"array": SEVEN})
    again = Scenario.model_validate(scenario.model_dump(mode="json"))
    assert again == scenario
    assert [list(place) for place in itertools.chain(again.usbl.array)] == SEVEN
