"""What is wrong all through a mission: drawn for each vehicle by itself, and found in fixes."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from worlds import QUIET_USBL, merged, paper_case, scenario, still

from bindusbl_des import Mission, Result, Setup, simulate, warnings_of

EVERYTHING = {
    "usbl": {
        "misalignment_sd_deg": 2.0,
        "gnss_correlated_sd_m": 0.5,
        "outlier_share": 0.05,
    },
    "environment": {"assumed_sound_speed_m_per_s": 1490.0},
    "navigation": {"clock_offset_sd_s": 2e-4, "clock_drift_sd": 1e-6},
}


def quiet(**changes: Any) -> tuple[Result, pd.DataFrame]:
    """Return a mission of an AUV at (20, 0, 10) m of one ASV, without noise; and its fixes, with
    what was wrong as each ping was heard.
    """
    result = simulate(still(1, **merged({"usbl": QUIET_USBL, "duration_s": 60.0}, changes)), 4)
    return result, result.tables["fixes"].merge(result.tables["receptions"], on=["ping", "auv"])


def test_a_misaligned_array_turns_every_fix() -> None:
    """All fixes of an ASV lie beside the AUV by the same angle."""
    _, fixes = quiet(usbl={"misalignment_sd_deg": 3.0})
    assert len(fixes) > 50
    turn = math.radians(fixes.misalignment_deg.iloc[0])
    assert abs(turn) > 1e-3
    found = np.arctan2(fixes.y_m, fixes.x_m).to_numpy()
    assert found == pytest.approx(np.full(len(fixes), turn), abs=1e-4)
    assert fixes.sd_y_m.iloc[0] == pytest.approx(20.0 * math.radians(3.0), rel=0.01)


def test_slow_gnss_errors_are_those_of_the_instant() -> None:
    """A fix is off by what the ASV's GNSS is off as the ping arrives (and its array's size)."""
    _, fixes = quiet(usbl={"gnss_correlated_sd_m": 0.8, "gnss_time_constant_s": 20.0})
    off = fixes[["gnss_error_x_m", "gnss_error_y_m"]].to_numpy()
    assert fixes[["x_m", "y_m"]].to_numpy() - (20.0, 0.0) == pytest.approx(off, abs=0.02)
    assert np.std(off, axis=0).min() > 0.1


def test_slow_gnss_errors_fade_as_they_should() -> None:
    """Their variance, and what is left of them after half and after twice the time constant."""
    world = still(
        1, duration_s=20_000.0, asvs={"count": 8},
        usbl={"gnss_correlated_sd_m": 2.0, "gnss_time_constant_s": 10.0},
        acoustics={"hf": {"range_m": 200.0}}, protocol={"shortest_uplink_slot_s": 4.8},
        navigation={"filter": "dead_reckoning"}, record={"tracks_hz": 0.01},
    )  # fmt: skip
    met = simulate(world, 1).tables["receptions"].query("outcome == 'heard'")
    every_s = float(np.median(np.diff(met.arrived_at_s[met.asv == "ASV0"])))
    found = np.array([
        own[name] for _, own in met.groupby("asv", observed=True)
        for name in ("gnss_error_x_m", "gnss_error_y_m")
    ])  # fmt: skip
    independent = found.size * every_s / 20.0
    assert found.var() == pytest.approx(4.0, rel=4 * math.sqrt(2 / independent))
    for steps in (1, 4):
        product = (found[:, :-steps] * found[:, steps:]).mean() / 4.0
        expected = math.exp(-steps * every_s / 10.0)
        assert product == pytest.approx(expected, abs=4 * math.sqrt(2 / independent))
    assert 4.0 < every_s < 6.0


def test_sound_that_is_taken_for_too_fast_makes_ranges_too_long() -> None:
    """By the ratio of both speeds, true places of arrival notwithstanding."""
    _, fixes = quiet(environment={"assumed_sound_speed_m_per_s": 1530.0})
    slant = math.hypot(20.0, 10.0)
    found = np.sqrt(fixes.x_m**2 + fixes.y_m**2 + fixes.z_m**2).to_numpy()
    assert found == pytest.approx(np.full(len(fixes), slant * 1.02), abs=1e-4)
    assert fixes.travel_time_s.iloc[0] == pytest.approx(slant / 1500.0)


def test_the_fleet_plans_with_the_sound_speed_that_it_assumes() -> None:
    """Slots are shorter where sound is taken for faster."""
    planned = Setup(scenario(environment={"assumed_sound_speed_m_per_s": 1560.0})).slots
    assert planned.crossing_time == pytest.approx(140.0 / 1560.0)
    assert Setup(scenario()).slots.crossing_time == pytest.approx(140.0 / 1500.0)


def test_late_clocks_make_ranges_too_long() -> None:
    """By the sound's way in what a clock is late, which grows; never where AUVs are called."""
    late = {"clock_offset_sd_s": 1e-3, "clock_drift_sd": 2e-5}
    _, fixes = quiet(navigation=late)
    found = np.sqrt(fixes.x_m**2 + fixes.y_m**2 + fixes.z_m**2) - math.hypot(20.0, 10.0)
    late_s = fixes.clock_late_s.to_numpy()
    assert found.to_numpy() == pytest.approx(1500.0 * late_s, abs=1e-3)
    assert late_s[0] != late_s[-1]
    called, _ = quiet(navigation=late, protocol={"ranging": "twtt"})
    assert called.tables["fixes"].error_m.max() < 0.01


def test_outliers_are_so_many_and_no_others_change() -> None:
    """Share and spread as asked; whoever is none is measured as without them."""
    share, spread = 0.2, 25.0
    plain, _ = quiet(usbl={"heading_sd_deg": 1.0}, duration_s=300.0)
    result, _ = quiet(
        usbl={"heading_sd_deg": 1.0, "outlier_share": share, "outlier_sd_m": spread},
        duration_s=300.0,
    )
    one, other = plain.tables["fixes"], result.tables["fixes"]
    off = (other[["x_m", "y_m"]] - one[["x_m", "y_m"]]).to_numpy()
    out, count = (off != 0.0).any(axis=1), len(one)
    assert out.mean() == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / count))
    assert np.sqrt((off[out] ** 2).mean()) == pytest.approx(
        spread, rel=4 / math.sqrt(4 * out.sum())
    )
    assert (one.sd_x_m == other.sd_x_m).all()  # nobody told the covariance


def test_a_further_vehicle_leaves_what_others_have() -> None:
    """Each ASV and AUV draws by itself."""
    drawn = merged(EVERYTHING, {"navigation": {"clock_drift_sd": 0.0}})

    def wrong(count: int, seed: int) -> dict[tuple[str, str], list[float]]:
        """Return what is wrong as the first ping is heard by each ASV."""
        stations = [[10.0 * k, 0.0] for k in range(count)]
        near = {
            "asvs": {"count": count, "formation": {"positions_m": stations}},
            "auvs": {"count": count}, "duration_s": 5.0,
            "acoustics": {"hf": {"range_m": 200.0}, "loss": {"law": "none"}},
        }  # fmt: skip
        world = scenario(**merged(drawn, near))
        met = simulate(world, seed).tables["receptions"].dropna(subset="misalignment_deg")
        names = ["misalignment_deg", "clock_late_s"]
        return {pair: own[names].iloc[0].tolist() for pair, own in met.groupby(["asv", "auv"])}

    few, many, others = wrong(2, 7), wrong(4, 7), wrong(2, 8)
    assert len(few) == 4
    assert few.items() <= many.items()
    assert not {it[0] for it in few.values()} & {it[0] for it in others.values()}


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt", "passive"])
def test_who_looks_changes_nothing(ranging: str) -> None:
    """With all that lasts, a mission that was stopped at odd instants is the mission."""
    world = paper_case(
        3, **merged(EVERYTHING, {"duration_s": 40.0, "protocol": {"ranging": ranging}}),
        record={"detail": "full"},
    )  # fmt: skip
    mission = Mission(world, 2)
    for instant in (3.3, 3.35, 17.0, 39.9):
        mission.advance(instant)
        mission.auvs()
    assert mission.result().tables["fixes"].equals(simulate(world, 2).tables["fixes"])
    assert mission.result().auvs.equals(simulate(world, 2).auvs)


# Each kind alone, and all at once
ALONE: dict[str, Any] = {
    "misalignment": {"usbl": {"misalignment_sd_deg": 2.0}},
    "gnss": {"usbl": {"gnss_correlated_sd_m": 1.0, "gnss_time_constant_s": 120.0}},
    "sound_speed": {"environment": {"assumed_sound_speed_m_per_s": 1480.0}},
    "clock": {"navigation": {"clock_offset_sd_s": 1e-3, "clock_drift_sd": 2e-6}},
    "slow": {"usbl": {"slow_share": 0.8, "correlation_s": 60.0}},
    "outliers": {"usbl": {"outlier_share": 0.05}},
}
TOGETHER = merged(merged(ALONE["misalignment"], ALONE["gnss"]), ALONE["sound_speed"])
TOGETHER = merged(merged(TOGETHER, ALONE["clock"]), ALONE["outliers"])


def squares(changes: dict[str, Any], runs: int = 100, instant: float = 200.0) -> np.ndarray:
    """Return the mean NEES of each AUV of the recovery mission at an instant (s) over seeds."""
    drawn = {"velocity_bias_m_per_s": [0.0, 0.0], "velocity_bias_sd_m_per_s": 0.06}
    base = {
        "duration_s": instant + 0.1,
        "acoustics": {"loss": {"combine": "off"}},
        "navigation": {"filter": "kalman", **drawn},
        "record": {"detail": "full", "tracks_hz": 1 / instant},
    }
    world, found = paper_case(3, **merged(base, changes)), []
    for seed in range(runs):
        rows = simulate(world, seed).tables["tracks"]
        rows = rows[(rows.time_s == instant) & rows.vehicle.str.startswith("AUV")]
        x, y = rows.estimate_x_m - rows.x_m, rows.estimate_y_m - rows.y_m
        xx, yy, xy = rows.estimate_sd_x_m**2, rows.estimate_sd_y_m**2, rows.estimate_cov_xy_m2
        found.append((yy * x**2 - 2 * xy * x * y + xx * y**2) / (xx * yy - xy**2))
    return np.asarray(np.mean(found, axis=0))


def bounds(runs: int = 100) -> tuple[float, float]:
    """Return between which the mean of squares with 2 degrees of freedom lies in 99.9 %."""
    low, high = stats.chi2.ppf((0.0005, 0.9995), 2 * runs) / runs
    return float(low), float(high)


def test_who_is_told_of_all_that_lasts_knows_how_sure_it_is() -> None:
    """NEES with everything wrong at once."""
    (low, high), found = bounds(50), squares(TOGETHER, 50)
    assert ((low < found) & (found < high)).all(), found


@pytest.mark.slow
@pytest.mark.parametrize("kind", ALONE)
@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_who_is_told_of_one_that_lasts_knows_how_sure_it_is(kind: str, ranging: str) -> None:
    """NEES with one kind alone."""
    low, high = bounds()
    found = squares(merged(ALONE[kind], {"protocol": {"ranging": ranging}}))
    assert ((low < found) & (found < high)).all(), found


@pytest.mark.slow
@pytest.mark.parametrize("ranging", ["owtt_sync", "passive"])
def test_large_misalignments_are_known_for_what_they_are(ranging: str) -> None:
    """NEES with arrays turned by 3 degrees, of which the second order is larger than the noise."""
    low, high = bounds()
    found = squares({"usbl": {"misalignment_sd_deg": 3.0}, "protocol": {"ranging": ranging}})
    assert ((low < found) & (found < high)).all(), found


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["misalignment", "gnss", "sound_speed", "clock"])
def test_who_is_not_told_is_too_sure(kind: str) -> None:
    """The tests above can fail: errors that last are taken for noise, which would average out."""
    untold = {"navigation": {"filter": {"model": "kalman", "untold": [kind]}}}
    assert (squares(merged(ALONE[kind], untold)) > bounds()[1]).all()


def test_an_unknown_word_of_what_is_untold_is_told() -> None:
    """Where, and which there are."""
    with pytest.raises(ValueError, match=r"navigation.filter.untold.*misalignment"):
        scenario(navigation={"filter": {"model": "kalman", "untold": ["compass"]}})


def test_of_many_asvs_a_filter_is_told_nothing_each_has_by_itself() -> None:
    """Their errors count as noise, and a warning says so; what all share is told."""
    asvs = {
        "asvs": {"count": 17},
        "acoustics": {"hf": {"range_m": 140.0}, "mf": {"range_m": 500.0}},
    }
    world = scenario(**merged(EVERYTHING, {**asvs, "duration_s": 5.0}))
    assert [kind.name for kind in Setup(world).estimated_errors] == ["sound_speed", "clock"]
    keys = {found.key for found in warnings_of(world)}
    assert {"usbl.misalignment_sd_deg", "usbl.gnss_correlated_sd_m"} <= keys
    assert simulate(world).auvs.fixes_delivered.min() > 0
    fewer = scenario(**merged(EVERYTHING, {"asvs": {"count": 16}}))
    assert [kind.name for kind in Setup(fewer).estimated_errors][:2] == ["misalignment", "gnss"]
    assert not {found.key for found in warnings_of(fewer)} & keys


def test_a_vessel_keeps_its_station_by_where_gnss_says_it_is() -> None:
    """An ASV with dynamics is off its station by as much as its GNSS, the other way."""
    slow = {"gnss_correlated_sd_m": 3.0, "gnss_time_constant_s": 1e5}
    world = scenario(
        duration_s=150.0, auvs={"count": 1}, asvs={"count": 2, "vehicle": "otter"}, usbl=slow
    )
    tables, stations = simulate(world, 5).tables, Setup(world).stations_m
    for asv in range(2):
        last = tables["tracks"].query(f"vehicle == 'ASV{asv}'").iloc[-1]
        heard = tables["receptions"].query(f"asv == 'ASV{asv}' and outcome == 'heard'")
        astray = heard.iloc[-1]
        off = np.array([last.x_m, last.y_m]) - stations[asv]
        assert off == pytest.approx([-astray.gnss_error_x_m, -astray.gnss_error_y_m], abs=1.5)
        assert np.hypot(*off) > 1.0


class Drifting:
    """An outside program that lets both ASVs drift along x."""

    def advance_to(self, time: float) -> dict[str, Any]:
        return {"asvs": np.array([[0.1 * time, 30.0 * k, 0.0, 0.3] for k in range(2)])}


def test_what_lasts_is_that_of_vessels_that_others_move() -> None:
    """Poses of an outside program are true; headings and GNSS are wrong all the same."""
    world = scenario(**merged(EVERYTHING, {"duration_s": 60.0, "asvs": {"count": 2}}))
    result = Mission(world, 3, poses=Drifting()).result()
    plain = Mission(scenario(duration_s=60.0, asvs={"count": 2}), 3, poses=Drifting()).result()
    assert result.auvs.fixes_delivered.sum() > 20
    assert result.auvs.fix_error_rms_m.mean() > 1.5 * plain.auvs.fix_error_rms_m.mean()
    assert result.auvs.nees.mean() < 6.0


@pytest.mark.parametrize("seed", [12, 53])
def test_a_late_clock_misleads_nobody_who_passes_an_asv(seed: int) -> None:
    """AUVs that pass ASVs at some 15 m with clocks off by as much know how unsure they are, though
    sound seems to have arrived there before it was sent (normalised squares of errors, 2 as the
    mean; 171 where that was cut off at no range).
    """
    world = scenario(
        duration_s=300.0,
        auvs={"count": 3},
        asvs={"count": 3},
        navigation={
            "filter": "kalman",
            "velocity_bias_m_per_s": [0.0, 0.0],
            "velocity_bias_sd_m_per_s": 0.03,
            "clock_offset_sd_s": 0.004,
        },
    )
    result = simulate(world, seed)
    lengths = np.hypot(*result.tables["fixes"][["x_m", "y_m"]].to_numpy().T)
    assert np.isfinite(lengths).all()
    assert result.auvs.nees.max() < 6.0, result.auvs.nees.tolist()


@pytest.mark.parametrize("navigator", ["kalman", "smoother"])
def test_one_array_tells_nothing_of_its_misalignment_by_its_own_noise(navigator: str) -> None:
    """AUVs that do not know where they start, some of whom one ASV alone hears, stay as unsure as
    they are: squares of errors, 2 as the mean, were 7 in these missions before.
    """
    world = scenario(
        duration_s=120.0,
        auvs={"count": 3},
        asvs={"count": 3},
        usbl={"misalignment_sd_deg": 3.0},
        navigation={
            "filter": navigator,
            "initial_position_sd_m": 10.0,
            "velocity_bias_m_per_s": [0.0, 0.0],
            "velocity_bias_sd_m_per_s": 0.03,
        },
    )
    squares = np.array([simulate(world, seed).auvs.nees for seed in range(16)])
    assert squares.mean() < 3.5
    assert (squares < 6.0).mean() > 0.9
