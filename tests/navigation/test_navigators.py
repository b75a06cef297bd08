"""Navigators that ship, and those of one's own."""

import itertools
import math
from typing import ClassVar

import numpy as np
import pytest
from commands_for_tests import explained
from worlds import QUIET_NAVIGATION, QUIET_USBL, paper_case, scenario

from bindusbl_des import DeadReckoning, Odometry, Scenario, simulate


def drawn(**changes: object) -> Scenario:
    """Return the recovery mission with inertial systems that are drawn, and a Kalman navigator."""
    navigation = {
        "filter": "kalman",
        "velocity_bias_m_per_s": [0.0, 0.0],
        "velocity_bias_sd_m_per_s": 0.06,
        **changes,
    }
    return paper_case(3, navigation=navigation, acoustics={"loss": {"combine": "off"}})


def test_kalman_halves_the_error() -> None:
    """Over 40 seeds the RMS error of every AUV is below half that of the fixed gain."""
    runs = {
        name: [simulate(drawn(filter=name), seed).auvs for seed in range(40)]
        for name in ("kalman", "fixed_gain")
    }
    rms = {
        name: np.sqrt(np.mean([run.position_error_rms_m**2 for run in found], axis=0))
        for name, found in runs.items()
    }
    assert (rms["kalman"] < 0.5 * rms["fixed_gain"]).all()


@pytest.mark.parametrize("name", ["kalman", "smoother"])
def test_who_knows_everything_needs_no_fix(name: str) -> None:
    """Without noise of any kind a filter has nothing to weigh, and makes no NaN."""
    result = simulate(
        scenario(
            duration_s=60.0,
            usbl=QUIET_USBL,
            navigation={**QUIET_NAVIGATION, "filter": name},
        )
    )
    assert result.auvs.position_error_max_m.max() < 1e-9
    assert result.auvs.fixes_delivered.min() > 0


def test_dead_reckoning_alone_is_a_navigator() -> None:
    """It takes fixes for what they are, news of how wrong it is, and does nothing about it."""
    result = simulate(scenario(duration_s=60.0, navigation={"filter": "dead_reckoning"}))
    assert result.auvs.position_error_m.tolist() == result.auvs.imu_error_m.tolist()
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    assert (fixes.correction_m == 0.0).all()
    assert (fixes.innovation_m > 0.0).all()
    assert math.isclose(result.auvs.fix_benefit_m.max(), 0.0)


class Still:
    """A navigator of somebody's own that believes whatever the last fix said, and is told so."""

    def __init__(self, reckoning: DeadReckoning, auvs: int) -> None:
        self.held: list[list[tuple[float, np.ndarray]]] = [[] for _ in range(auvs)]

    def correct(self, fixes: np.ndarray, due: np.ndarray) -> None:
        for fix in fixes[due]:
            self.held[fix.auv].append((fix.delivered_at_s, np.array((fix.x_m, fix.y_m))))

    def estimate(self, auv: int, odometry: Odometry) -> np.ndarray:
        out = odometry.position.copy()
        for since, place in self.held[auv]:
            out[odometry.times >= since] = place
        return out

    def covariance(self, auv: int, odometry: Odometry) -> np.ndarray:
        return np.tile((4.0, 4.0, 0.0), (len(odometry.times), 1))


class Noting(Still):
    """The same, with what it is given in `fixes`."""

    given: ClassVar[list[np.recarray]] = []
    weighs = True

    def correct(self, fixes: np.ndarray, due: np.ndarray) -> None:
        super().correct(fixes, due)
        self.given.append(fixes[due])


class Silent(Still):
    """Answers nothing that could be used."""

    def estimate(self, auv: int, odometry: Odometry) -> np.ndarray:
        return np.full((1, 7), np.nan)


@pytest.mark.parametrize("vehicle", ["kinematic", "bluerov2"])
def test_a_navigator_of_ones_own_is_asked(vehicle: str) -> None:
    """Tracks, metrics and an autopilot have its estimate, which is not additive."""
    feedback = "truth" if vehicle == "kinematic" else "estimate"
    result = simulate(
        scenario(
            duration_s=40.0,
            survey={"side_m": 60.0},
            auvs={"count": 2, "vehicle": vehicle, "feedback": feedback, "speed_m_per_s": 0.3},
            asvs={"count": 1, "formation": {"radius_m": 0.0}},
            navigation={"filter": "test_navigators:Still"},
        )
    )
    tracks = result.tables["tracks"].query("vehicle == 'AUV0'")
    fixes = result.tables["fixes"].query("auv == 'AUV0' and outcome == 'delivered'")
    last = fixes[fixes.delivered_at_s <= tracks.time_s.iloc[-1]].iloc[-1]
    assert tracks.estimate_x_m.iloc[-1] == pytest.approx(last.x_m)
    assert (tracks.estimate_sd_x_m == 2.0).all()
    assert (fixes.correction_m > 0).all()


@pytest.mark.parametrize("ranging", ["owtt_sync", "passive"])
def test_a_navigator_of_ones_own_is_given_the_columns_of_table_fixes(ranging: str) -> None:
    """All of them and no others, texts as in the table, vehicles as numbers; but no truth, and
    nothing that comes of the correction.
    """
    Noting.given.clear()
    result = simulate(
        scenario(
            duration_s=30.0,
            survey={"side_m": 60.0},
            auvs={"count": 2},
            asvs={"count": 2, "formation": {"radius_m": 35.0}},
            protocol={"ranging": ranging},
            navigation={"filter": "test_navigators:Noting"},
        )
    )
    table = result.tables["fixes"].query("outcome == 'delivered'").set_index("fix")
    given = np.concatenate(Noting.given).view(np.recarray)
    assert list(given.dtype.names) == list(result.tables["fixes"].columns)
    assert sorted(given.fix) == list(table.index)
    assert len({*given.asvs}) > 1
    for fix in given:
        row = table.loc[fix.fix]
        assert f"AUV{fix.auv}" == row.auv
        assert (fix.asvs, fix.outcome) == (row.asvs, "delivered")
        assert f"ASV{fix.broadcast_by}" == row.broadcast_by or ranging == "passive"
        assert math.isnan(fix.error_m)
        assert math.isnan(fix.correction_m)
        for name in {*table.columns} - {"auv", "asvs", "outcome", "error_m", "correction_m"}:
            if given.dtype[name] == np.float64:
                assert fix[name] == pytest.approx(row[name], nan_ok=True), name
    assert [fix.fix for fix in given] == sorted(
        given.fix, key=lambda fix: table.delivered_at_s[fix]
    )


def test_nis_of_a_navigator_of_ones_own_is_counted() -> None:
    """Against what it believed of the instant at which the fix holds: here its last fix, which it
    took to be known to 2 m; dof 2, and what explain says of it names no gate, since it has none.
    """
    result = simulate(
        scenario(
            duration_s=40.0,
            survey={"side_m": 60.0},
            auvs={"count": 1, "speed_m_per_s": 0.3},
            asvs={"count": 1, "formation": {"radius_m": 0.0}},
            navigation={"filter": "test_navigators:Noting"},
        )
    )
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    assert fixes.nis.notna().all()
    for before, fix in itertools.pairwise(fixes.itertuples()):
        if before.delivered_at_s > fix.valid_at_s:
            continue  # it believed something else then
        off = np.array((fix.x_m - before.x_m, fix.y_m - before.y_m))
        spread = [[4 + fix.sd_x_m**2, fix.cov_xy_m2], [fix.cov_xy_m2, 4 + fix.sd_y_m**2]]
        assert fix.nis == pytest.approx(off @ np.linalg.inv(spread) @ off)
    assert result.auvs.nis[0] == pytest.approx(fixes.nis.mean())
    assert result.mission.nis[0] == pytest.approx(fixes.nis.mean())
    told = explained(result, fix=int(fixes.fix.iloc[5]))
    assert f"normalised, its square is {fixes.nis.iloc[5]:.2f}" in told
    assert "gate" not in told


def test_what_a_navigator_of_ones_own_gets_wrong_is_told() -> None:
    """Its name, the verb, and what was expected."""
    for name, message in (
        ("test_navigators:Silent", "answered estimate with an array of shape"),
        ("test_navigators:Nobody", "cannot load 'test_navigators:Nobody'"),
        ("math:sqrt", "'math:sqrt' cannot be called as a filter is"),
    ):
        with pytest.raises(ValueError, match=f"navigation.filter: .*{message}"):
            simulate(scenario(duration_s=5.0, navigation={"filter": name}))
    with pytest.raises(ValueError, match="did you mean 'kalman'"):
        scenario(navigation={"filter": "kalmann"})
