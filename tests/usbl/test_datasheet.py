"""USBLs as their data sheets state them: what is stated is what is measured, by Monte Carlo."""

import math
import re
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from numpy.typing import NDArray
from scipy import stats
from worlds import merged, scenario

from bindusbl_des import Scenario, Setup, simulate, warnings_of

Array = NDArray[np.float64]
COUNT = 4000
SPREAD = 4.0 / math.sqrt(2 * COUNT)  # of a standard deviation of so many draws, four sigma


def sheet(**settings: Any) -> dict[str, Any]:
    return {"model": {"model": "datasheet", **settings}}


def fixes(
    usbl: dict[str, Any], source: Array, snr_db: float = math.nan
) -> tuple[Array, Array]:  # fmt: skip
    """Return fixes (n, 3), m, of a source by an ASV at the origin, and the last covariance."""
    instrument, rng = Setup(scenario(usbl=usbl)).usbl, np.random.default_rng(8)
    travel, found = float(np.linalg.norm(source)) / 1500.0, []
    for noise in rng.standard_normal((COUNT, 12)):
        found.append(instrument.locate(source, np.zeros(3), 0.7, travel, noise, snr_db))
    return np.array([fix for fix, _ in found]), np.mean([it for _, it in found], axis=0)


def ranged(daily: str, *others: str) -> pytest.MarkDecorator:
    """Return a mark that runs a test with each way of ranging, every day with one: each of them,
    with errors that last and without, has equations of its own to be compiled.
    """
    slow = [pytest.param(it, marks=pytest.mark.slow) for it in others]
    return pytest.mark.parametrize("ranging", [daily, *slow])


def polar(reach: float, elevation_deg: float) -> Array:
    level, turn = math.radians(elevation_deg), 0.3
    return reach * np.array(
        [math.cos(level) * math.cos(turn), math.cos(level) * math.sin(turn), math.sin(level)]
    )


def across(source: Array) -> tuple[Array, Array]:
    """Return the unit vectors across the way to a source: level, and steep."""
    unit = source / np.linalg.norm(source)
    level = np.array([-unit[1], unit[0], 0.0]) / np.hypot(unit[0], unit[1])
    return level, np.cross(unit, level)


@pytest.mark.parametrize("elevation_deg", [5.0, 40.0, 70.0])
def test_angles_and_range_err_as_stated(elevation_deg: float) -> None:
    """Both angles across and the slant range, far and near, and the covariance of all of it."""
    stated = sheet(bearing_sd_deg=1.5, elevation_sd_deg=0.8, range_sd_m=0.5, range_sd_percent=1.0)
    for reach in (20.0, 120.0):
        source = polar(reach, elevation_deg)
        found, covariance = fixes(stated, source)
        aside, steep = (found @ way / reach for way in across(source))
        assert np.std(np.degrees(aside)) == pytest.approx(1.5, rel=SPREAD)
        assert np.std(np.degrees(steep)) == pytest.approx(0.8, rel=SPREAD)
        ranges = np.std(np.linalg.norm(found, axis=1))
        assert ranges == pytest.approx(math.hypot(0.5, 0.01 * reach), rel=SPREAD)
        sample = np.cov(found.T)
        assert np.linalg.norm(covariance - sample) < 0.08 * np.linalg.norm(sample)


@pytest.mark.parametrize(
    ("elevation_deg", "published_m"), [(0.0, 6.98), (45.0, 8.55), (80.0, 9.80), (90.0, 9.87)]
)
def test_an_angle_is_one_across_at_every_elevation(
    elevation_deg: float, published_m: float
) -> None:
    """1 deg at 400 m: r sigma sqrt(1 + sin^2 el) seen from above, below the array along both axes;
    the fix says so.
    """
    stated, source = sheet(bearing_sd_deg=1.0), polar(400.0, elevation_deg)
    found, covariance = fixes(stated, source)
    off, exact = (found - source)[:, :2], 400.0 * math.radians(1.0)
    expected = exact * math.sqrt(1.0 + math.sin(math.radians(elevation_deg)) ** 2)
    assert expected == pytest.approx(published_m, abs=0.005)
    assert math.sqrt((off**2).sum(axis=1).mean()) == pytest.approx(expected, rel=SPREAD)
    assert math.sqrt(covariance[0, 0] + covariance[1, 1]) == pytest.approx(expected, rel=0.01)
    if elevation_deg == 90.0:
        assert off.std(axis=0) == pytest.approx([exact, exact], rel=SPREAD)
        assert np.sqrt(covariance.diagonal()[:2]) == pytest.approx([exact, exact], rel=0.01)


@pytest.mark.parametrize("statistic", ["drms", "cep", "p95"])
@pytest.mark.parametrize("elevation_deg", [10.0, 80.0])
def test_accuracy_is_that_of_the_horizontal_position(statistic: str, elevation_deg: float) -> None:
    """Whatever the direction; binomial or chi-squared bounds of 99.9 %."""
    source = polar(100.0, elevation_deg)
    stated = sheet(accuracy_m=1.0, accuracy_percent=2.0, statistic=statistic)
    off = np.linalg.norm((fixes(stated, source)[0] - source)[:, :2], axis=1)
    figure = math.hypot(1.0, 2.0)
    if statistic == "drms":
        low, high = stats.chi2.ppf((0.0005, 0.9995), 2 * COUNT) / (2 * COUNT)
        assert low < np.mean(off**2) / figure**2 < high
    else:
        share = {"cep": 0.5, "p95": 0.95}[statistic]
        low, high = stats.binom.ppf((0.0005, 0.9995), COUNT, share)
        assert low <= np.sum(off <= figure) <= high


@pytest.mark.parametrize(
    ("preset", "angle_deg", "published_m"),
    [("cerulean_rovl", 5.2, 13.6), ("cerulean_rovl_gnss", 2.1, 7.2)],
)
def test_the_budget_that_cerulean_publishes(
    preset: str, angle_deg: float, published_m: float
) -> None:
    """CEP = sqrt(5^2 + (sin(angle) R)^2), at 140 m as published."""
    for reach in (30.0, 140.0):
        source = polar(reach, 15.0)
        off = np.linalg.norm((fixes({"preset": preset}, source)[0] - source)[:, :2], axis=1)
        cep = math.hypot(5.0, math.sin(math.radians(angle_deg)) * reach)
        low, high = stats.binom.ppf((0.0005, 0.9995), COUNT, 0.5)
        assert low <= np.sum(off <= cep) <= high
    assert cep == pytest.approx(published_m, abs=0.05)


def test_angles_grow_as_the_snr_falls_down_to_a_floor() -> None:
    """Ten times for 20 dB less; where nobody knows the SNR they are as stated."""
    stated = sheet(bearing_sd_deg=1.0, reference_snr_db=20.0, angle_floor_deg=0.3)
    source, expected = polar(80.0, 10.0), {20.0: 1.0, 14.0: 1.995, 50.0: 0.3, math.nan: 1.0}
    for snr_db, sd in expected.items():
        found, covariance = fixes(stated, source, snr_db)
        assert np.std(np.degrees(np.arctan2(*found.T[1::-1]))) == pytest.approx(sd, rel=SPREAD)
        across = np.array([-math.sin(0.3), math.cos(0.3), 0.0])
        own = math.sqrt(across @ covariance @ across) / math.hypot(*source[:2])
        assert math.degrees(own) == pytest.approx(sd, rel=0.02)


ANGLES = sheet(bearing_sd_deg=1.0, range_sd_m=0.2, range_sd_percent=0.5)
PLACE = sheet(accuracy_m=0.3, accuracy_percent=1.0)
LASTING = {
    "usbl": {"misalignment_sd_deg": 1.0, "gnss_correlated_sd_m": 0.5, "gnss_sd_m": 0.1},
    "environment": {"assumed_sound_speed_m_per_s": 1495.0},
}


@ranged("owtt_sync", "twtt")
@pytest.mark.parametrize("usbl", [ANGLES, PLACE], ids=["angles", "place"])
def test_fused_fixes_are_as_good_as_they_say(usbl: dict[str, Any], ranging: str) -> None:
    """Whoever ranges how: mean e' P^-1 e (2) of a mission's fixes, which err independently."""
    tested = scenario(
        duration_s=120.0, usbl=usbl, protocol={"ranging": ranging}, record={"tracks_hz": 0.1}
    )
    found = np.concatenate([squares(tested, seed) for seed in range(3)])
    low, high = stats.chi2.ppf((0.0005, 0.9995), 2 * found.size) / found.size
    assert low < found.mean() < high


def squares(tested: Scenario, seed: int) -> Array:
    """Return e' P^-1 e of all fixes of a mission, of their horizontal places."""
    rows = simulate(tested, seed).tables
    fixes = rows["fixes"]
    pings = rows["pings"].set_index("ping").loc[fixes.ping]
    error = fixes[["x_m", "y_m"]].to_numpy() - pings[["x_m", "y_m"]].to_numpy()
    xx, yy, xy = fixes.sd_x_m**2, fixes.sd_y_m**2, fixes.cov_xy_m2
    x, y = error.T
    return ((yy * x**2 - 2 * xy * x * y + xx * y**2) / (xx * yy - xy**2)).to_numpy()


@ranged("twtt", "owtt_sync", "passive")
@pytest.mark.parametrize("usbl", [ANGLES, PLACE], ids=["angles", "place"])
def test_navigators_know_of_what_lasts_beside_a_sheet(usbl: dict[str, Any], ranging: str) -> None:
    """NEES of three AUVs at the end of 20 missions, taken for 20 errors of two axes."""
    base = {"duration_s": 90.1, "usbl": usbl, "protocol": {"ranging": ranging}}
    tested = scenario(**merged(merged(base, LASTING), {"record": {"tracks_hz": 1 / 90.0}}))
    found = []
    for seed in range(20):
        rows = simulate(tested, seed).tables["tracks"]
        rows = rows[(rows.time_s > 0.0) & rows.vehicle.str.startswith("AUV")]
        x, y = rows.estimate_x_m - rows.x_m, rows.estimate_y_m - rows.y_m
        xx, yy, xy = rows.estimate_sd_x_m**2, rows.estimate_sd_y_m**2, rows.estimate_cov_xy_m2
        found.append(((yy * x**2 - 2 * xy * x * y + xx * y**2) / (xx * yy - xy**2)).mean())
    low, high = stats.chi2.ppf((0.0005, 0.9995), 40) / 20
    assert low < np.mean(found) < high


PRESETS = re.findall(r"(?m)^(\w+)  \(usbl: ", call("presets").output)


@pytest.mark.parametrize("usbl", [ANGLES, *({"preset": name} for name in PRESETS)], ids=str)
def test_written_out_and_read_again_it_is_the_same(usbl: dict[str, Any]) -> None:
    """In full, or only what was given; and a preset is taken back with all that it said."""
    one = scenario(usbl={**usbl, "gnss_sd_m": 0.2})
    for given in (one.model_dump(mode="json"), one.model_dump(mode="json", exclude_unset=True)):
        again = Scenario.model_validate(given)
        assert again == one
    if "preset" in given["usbl"]:
        del given["usbl"]["preset"]
        assert Scenario.model_validate(given) == scenario(usbl={"gnss_sd_m": 0.2})


def test_the_attitude_is_in_the_sheet_unless_it_is_given() -> None:
    """Then it is added to what is stated."""
    assert scenario(usbl=ANGLES).usbl.heading_sd_deg == 0.0
    both = {**sheet(bearing_sd_deg=1.0), "heading_sd_deg": 0.8}
    found, _ = fixes(both, polar(80.0, 10.0))
    assert np.std(np.degrees(np.arctan2(*found.T[1::-1]))) == pytest.approx(1.28, rel=SPREAD)


def test_what_is_given_beside_a_preset_wins() -> None:
    own = scenario(usbl={"preset": "evologics_oem", "heading_sd_deg": 0.3}).usbl
    assert (own.heading_sd_deg, own.roll_sd_deg, own.array) == (0.3, 0.2, "oem5")


@pytest.mark.parametrize("model", ["array", {"model": "datasheet", "bearing_sd_deg": 2.0}])
def test_another_instrument_than_that_of_the_preset_is_refused(model: Any) -> None:
    with pytest.raises(ValueError, match=r"usbl.model: is not that of the preset .*keep one of"):
        scenario(usbl={"preset": "cerulean_rovl", "model": model})


@pytest.mark.parametrize(("ranging", "ways"), [("owtt_sync", 1), ("twtt", 2)])
def test_ranges_are_as_good_as_the_sheet_says_however_they_are_taken(
    ranging: str, ways: int
) -> None:
    stated = scenario(usbl=sheet(bearing_sd_deg=1.0, range_sd_m=0.4), protocol={"ranging": ranging})
    assert Setup(stated).usbl.range_sd(ways) == pytest.approx(0.4)


WRONG = {
    "states no direction; add bearing_sd_deg": {},
    "stated twice": {"bearing_sd_deg": 1.0, "accuracy_percent": 1.0},
    "statistic says more of accuracy_m": {"bearing_sd_deg": 1.0, "statistic": "cep"},
    "range_sd_m says more of bearing_sd_deg": {"accuracy_m": 1.0, "range_sd_m": 1.0},
    "angle_floor_deg needs reference_snr_db": {"bearing_sd_deg": 1.0, "angle_floor_deg": 0.1},
}


@pytest.mark.parametrize("message", WRONG)
def test_a_sheet_that_says_nothing_or_too_much_is_refused(message: str) -> None:
    with pytest.raises(ValueError, match=f"usbl.model.*{message}"):
        scenario(usbl=sheet(**WRONG[message]))


def test_a_sonar_tells_how_sure_the_angles_are() -> None:
    """What is worse by 20 dB of reference is ten times as unsure, in the same receptions."""

    def sds(reference_snr_db: float, ranging: str) -> Array:
        quiet = {"model": "sonar", "shadowing_sd_db": 0.0, "snr_threshold_db": 0.0}
        heard = scenario(
            duration_s=20.0,
            asvs={"count": 1},
            acoustics={"hf": {"channel": quiet}},
            protocol={"ranging": ranging},
            usbl=sheet(bearing_sd_deg=0.1, reference_snr_db=reference_snr_db),
        )
        return simulate(heard, 0).tables["fixes"][["sd_x_m", "sd_y_m"]].to_numpy()

    for ranging in ("owtt_sync", "passive"):
        one, worse = sds(30.0, ranging), sds(50.0, ranging)
        assert len(one) == len(worse) > 5
        assert worse == pytest.approx(10.0 * one, rel=0.2)


def test_an_snr_that_no_channel_tells_of_has_no_effect_and_is_told() -> None:
    told = {it.key: it.message for it in warnings_of(scenario(usbl=sheet(
        bearing_sd_deg=1.0, reference_snr_db=20.0
    )))}  # fmt: skip
    assert "acoustics.hf.channel" in told["usbl.model.reference_snr_db"]


@pytest.mark.parametrize("elevation_sd_deg", [1.0, 3.0, 9.0])
@pytest.mark.parametrize("aside_m", [0.0, 1.0, 2.0, 5.0, 15.0])
def test_who_is_almost_below_is_not_taken_for_surely_there(
    aside_m: float, elevation_sd_deg: float
) -> None:
    """NEES of the place, 2 as the mean: 40 to 6e5 where a measured direction straight down leaves
    its bearing nothing to be wrong in, 2.9 where the angles are those of the direction measured.
    """
    angles = {"bearing_sd_deg": 3.0, "elevation_sd_deg": elevation_sd_deg}
    instrument = Setup(scenario(usbl=sheet(**angles, range_sd_m=0.1))).usbl
    rng, source, found = np.random.default_rng(3), np.array([aside_m, 0.0, 30.0]), []
    for noise in rng.standard_normal((COUNT, 12)):
        way = float(np.linalg.norm(source)) / 1500.0
        fix, spread = instrument.locate(source, np.zeros(3), rng.uniform(0, 6.28), way, noise)
        off = (fix - source)[:2]
        found.append(off @ np.linalg.solve(spread[:2, :2], off))
    assert 1.3 < np.mean(found) < 2.2
