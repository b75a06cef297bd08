"""A navigator of one's own that wants receptions in place of fused fixes."""

from typing import Any

import numpy as np
import pytest

from bindusbl_des import Mission, Scenario, load_result, simulate

EXACT = {
    "tdoa_sd_s": 0.0, "travel_time_sd_s": 0.0, "quantum_s": 0.0, "roll_sd_deg": 0.0,
    "pitch_sd_deg": 0.0, "heading_sd_deg": 0.0,
}  # fmt: skip


class Listening:
    """Keeps all that it is given, and believes in dead reckoning."""

    wants = "receptions"
    answer: Any = None

    def __init__(self, reckoning: Any, auvs: int) -> None:
        self.reckoning, self.heard = reckoning, list[Any]()

    def correct(self, receptions: Any, due: Any) -> Any:
        self.heard.append(receptions[due].copy())
        return self.answer

    def estimate(self, auv: int, odometry: Any) -> Any:
        return odometry.position

    def covariance(self, auv: int, odometry: Any) -> Any:
        return np.tile((1.0, 1.0, 0.0), (len(odometry.times), 1))


def flown(navigator: type = Listening, **keys: Any) -> Any:
    data = {"name": "raw", "duration_s": 40, "navigation": {"filter": navigator}} | keys
    return simulate(Scenario.model_validate(data), 2)


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt", "passive"])
def test_it_is_given_what_each_vessel_measured(ranging: str) -> None:
    """Without noise: the true range and place, by the table's instants and directions."""
    result = flown(protocol={"ranging": ranging}, usbl=EXACT)
    table = result.tables["receptions"].set_index(["ping", "auv", "asv"])
    pings = result.tables["pings"].set_index("ping")
    fixes = result.tables["fixes"].set_index(["ping", "auv"])
    rows = np.concatenate(result.navigator.heard).view(np.recarray)
    assert len(rows) > 20
    for row in rows:
        auv, asv = f"AUV{row.auv}", f"ASV{row.asv}"
        own = table.loc[row.ping, auv, asv]
        assert own.outcome == "heard"
        assert (row.arrived_at_s, row.azimuth_deg) == (own.arrived_at_s, own.azimuth_deg)
        assert row.delivered_at_s == fixes.loc[row.ping, auv].delivered_at_s
        if np.isnan(row.range_m):
            assert ranging == "twtt"
            assert pings.loc[row.ping].called_by != asv
            assert row.path_m > 0.0
            continue
        assert row.range_m == pytest.approx(own.slant_range_m, abs=0.02)
        vessel = np.array((row.vessel_x_m, row.vessel_y_m, row.vessel_z_m))
        place = np.array((row.x_m, row.y_m, row.z_m))
        assert np.linalg.norm(place - vessel) == pytest.approx(row.range_m)
        if ranging != "passive":
            sent = pings.loc[row.ping]
            assert place == pytest.approx((sent.x_m, sent.y_m, sent.z_m), abs=0.05)


def test_one_vessel_alone_is_as_sure_as_its_fix() -> None:
    result = flown()
    fixes = result.tables["fixes"].set_index("ping")
    alone = [rows[0] for rows in result.navigator.heard if len(rows) == 1]
    assert len(alone) > 5
    for row in alone:
        fix = fixes.loc[row.ping]
        told = row.cov_xx_m2, row.cov_yy_m2, row.cov_xy_m2
        wanted = fix.sd_x_m**2, fix.sd_y_m**2, fix.cov_xy_m2
        assert told == pytest.approx(wanted, rel=0.03, abs=2e-3)


def test_levels_range_rates_and_depth_are_told() -> None:
    result = flown(
        acoustics={"hf": {"channel": "sonar"}}, usbl={"range_rate_sd_m_per_s": 0.05}, duration_s=10
    )
    table = result.tables["receptions"].set_index(["ping", "auv", "asv"])
    for row in np.concatenate(result.navigator.heard).view(np.recarray):
        own = table.loc[row.ping, f"AUV{row.auv}", f"ASV{row.asv}"]
        for name in ("snr_db", "level_db", "margin_db", "range_rate_m_per_s"):
            assert row[name] == own[name]
        assert row.vessel_x_m_per_s == 0.0
        assert result.navigator.reckoning.depth(int(row.auv), row.valid_at_s) == 10.0


def test_gnss_fixes_are_places() -> None:
    route = {"kind": "hold", "positions_m": [[0.0, 0.0]]}
    result = flown(
        auvs={"count": 1, "route": route}, survey={"depth_m": 0.2}, duration_s=5,
        navigation={"filter": Listening, "gnss_fix": {"sd_m": 2.0, "every_s": 1.0}},
    )  # fmt: skip
    rows = [rows[0] for rows in result.navigator.heard if rows[0].ping == -1]
    assert len(rows) == 4
    assert all(row.cov_xx_m2 == 4.0 and row.asv == -1 and np.isnan(row.range_m) for row in rows)


def test_what_it_returns_is_kept() -> None:
    class Refusing(Listening):
        answer = {"nis": 7.5, "innovation_m": 1.25, "refused": True}  # noqa: RUF012

    result = flown(Refusing)
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    assert set(fixes.nis) == {7.5}
    assert set(fixes.innovation_m) == {1.25}
    assert fixes.correction_m.isna().all()
    assert (result.auvs.fixes_refused == result.auvs.fixes_delivered).all()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (3, "returned 3 from correct; it must be None, or a mapping of nis"),
        ({"nees": 1.0}, "it must be None, or a mapping of nis, innovation_m and refused"),
        ({"nis": -1.0}, "returned nis = -1 from correct; it must be a finite number"),
        ({"nis": "much"}, "raised ValueError: could not convert string to float"),
    ],
)
def test_answers_are_checked(answer: Any, words: str) -> None:
    class Answering(Listening):
        pass

    Answering.answer = answer
    with pytest.raises(ValueError, match="navigation") as error:
        flown(Answering)
    assert words in str(error.value)


def test_what_it_wants_must_be_there() -> None:
    class Greedy(Listening):
        wants = "everything"

    with pytest.raises(ValueError, match="wants 'everything'; give one of fixes, receptions"):
        flown(Greedy)


def test_the_object_can_be_had_back(tmp_path: Any) -> None:
    data = {"name": "raw", "duration_s": 5, "navigation": {"filter": Listening}}
    mission = Mission(Scenario.model_validate(data), 0)
    assert isinstance(mission.navigator, Listening)
    result = mission.result()
    assert result.navigator is mission.navigator
    result.write(tmp_path / "out")
    assert load_result(tmp_path / "out").navigator is None
    shipped = Mission(Scenario(name="own", duration_s=5), 0)
    assert shipped.navigator is None
    assert shipped.result().navigator is None
