"""GNSS fixes of AUVs at the surface: when they come, what navigators make of them."""

from typing import Any

import numpy as np
import pytest
from commands_for_tests import call, explained
from worlds import merged, scenario

from bindusbl_des import Mission, Scenario, load_result, simulate


def afloat(**changes: Any) -> Scenario:
    """Return three AUVs at the surface, which have a fix each 5 s."""
    told = {"velocity_bias_m_per_s": [0.0, 0.0], "velocity_bias_sd_m_per_s": 0.05}
    base = {
        "duration_s": 61.0,
        "survey": {"depth_m": 0.3, "side_m": 140.0},
        "navigation": {"gnss_fix": {"every_s": 5.0}, **told},
    }
    return scenario(**merged(base, changes))


def test_each_auv_at_the_surface_has_a_fix_at_each_instant_of_its_receiver() -> None:
    fixes = simulate(afloat(navigation={"gnss_fix": {"sd_m": 3.0}}), 1).tables["gnss_fixes"]
    for _, own in fixes.groupby("auv"):
        assert own.fixed_at_s.tolist() == [5.0 * k for k in range(1, 13)]
    assert fixes.gnss_fix.tolist() == list(range(36))
    assert fixes.fixed_at_s.is_monotonic_increasing
    assert (fixes.sd_m == 3.0).all()
    squares = fixes.error_m**2 / 3.0**2  # chi-squared with 2 x 36 degrees of freedom, 99.99 %
    assert 38.4 < squares.sum() < 122.0
    assert (fixes.nis > 0.0).all()


def test_a_deeper_auv_has_none_and_one_without_a_receiver_no_table() -> None:
    deep = simulate(afloat(survey={"depth_m": 0.6}), 1)
    assert len(deep.tables["gnss_fixes"]) == 0
    assert deep.auvs.gnss_fixes.tolist() == [0, 0, 0]
    assert "gnss_fixes" not in simulate(scenario(duration_s=2.0), 1).tables


def test_a_receiver_leaves_all_that_is_sent_as_it_is() -> None:
    with_it, without = (
        simulate(afloat(navigation={"gnss_fix": it}), 2) for it in ({"every_s": 5.0}, None)
    )
    for table in ("rounds", "pings", "receptions", "broadcasts"):
        assert with_it.arrow[table].equals(without.arrow[table])
    own = [name for name in with_it.arrow["fixes"].schema.names if name not in OF_NAVIGATORS]
    assert with_it.arrow["fixes"].select(own).equals(without.arrow["fixes"].select(own))
    assert not with_it.arrow["fixes"].equals(without.arrow["fixes"])


# What the table `fixes` has of what a navigator made of a fix
OF_NAVIGATORS = ("innovation_m", "correction_m", "nis")


@pytest.mark.parametrize("name", ["kalman", "smoother", "fixed_gain"])
def test_fixes_by_gnss_correct_every_navigator_but_dead_reckoning(name: str) -> None:
    quiet = {"asvs": {"formation": {"radius_m": 5000.0}}, "duration_s": 300.0}  # none is heard
    found = simulate(afloat(navigation={"filter": name}, **quiet), 3).auvs
    assert (found.fixes == 0).all()
    assert (found.gnss_fixes > 50).all()
    assert (found.position_error_m < found.imu_error_m).all()
    # none is older than two, of which the gate has refused one
    assert (found.fix_age_max_s <= 10.0 + 1e-9).all()


def test_dead_reckoning_ignores_them() -> None:
    found = simulate(afloat(navigation={"filter": "dead_reckoning"}), 3).auvs
    assert found.position_error_m.tolist() == found.imu_error_m.tolist()


@pytest.mark.parametrize(
    ("common", "within_m"),
    [
        ({}, 2e-3),
        ({"navigation": {"clock_offset_sd_s": 0.002}}, 2e-2),
        ({"usbl": {"misalignment_sd_deg": 5.0}, "duration_s": 15.01}, 0.12),
    ],
)
def test_a_fix_that_comes_late_is_put_before_those_by_gnss(
    common: dict[str, Any], within_m: float
) -> None:
    """At the end a smoother, which weighs all fixes by when they hold, knows what a filter
    does; but for clocks and headings, about whose last estimates it expands all fixes anew.
    """
    changes = merged({"duration_s": 60.01, "record": {"tracks_hz": 100.0}}, common)
    changes = merged(changes, {"navigation": {"gnss_fix": {"every_s": 0.7}, "nis_gate": None}})
    last = []
    for name in ("kalman", "smoother"):
        run = simulate(afloat(**merged(changes, {"navigation": {"filter": name}})), 4)
        rows = run.tables["tracks"].query("vehicle == 'AUV1'").iloc[-1]
        last.append(rows[["estimate_x_m", "estimate_y_m", "estimate_sd_x_m"]].to_list())
    assert last[0] == pytest.approx(last[1], abs=within_m)


def test_who_steers_by_fixes_has_each_at_its_instant() -> None:
    """Its estimate, and with it its way, does not depend on who looks at the mission."""
    steered = {
        "auvs": {"count": 1, "vehicle": "bluerov2", "feedback": "estimate"},
        "survey": {"side_m": 40.0},
        "asvs": {"formation": {"radius_m": 5000.0}},
        "navigation": {"gnss_fix": {"depth_m": 1.0, "every_s": 0.77}},
    }
    looked = Mission(afloat(duration_s=12.0, **steered), 5)
    for instant in np.arange(0.0, 12.0, 0.31):
        looked.advance(float(instant))
        looked.auvs()
    alone = simulate(afloat(duration_s=12.0, **steered), 5)
    assert looked.result().arrow["tracks"].equals(alone.arrow["tracks"])
    assert len(alone.tables["gnss_fixes"]) == 15


class Noting:
    """A navigator of one's own that notes what it is given."""

    def __init__(self, reckoning: Any, count: int) -> None:
        self.fixes = SEEN

    def correct(self, fixes: Any, due: Any) -> None:
        self.fixes += [(fix.ping, fix.auv, fix.delivered_at_s, fix.sd_x_m) for fix in fixes[due]]

    def estimate(self, auv: int, odometry: Any) -> Any:
        return odometry.position

    def covariance(self, auv: int, odometry: Any) -> Any:
        return np.zeros((len(odometry.times), 3))


SEEN: list[tuple[int, int, float, float]] = []


def test_a_navigator_of_ones_own_is_given_them_as_fixes_of_no_ping() -> None:
    SEEN.clear()
    run = simulate(afloat(navigation={"filter": Noting}), 6)
    by_gnss = [it for it in SEEN if it[0] == -1]
    assert len(by_gnss) == 36
    assert {it[3] for it in by_gnss} == {2.0}
    assert len(SEEN) == 36 + (run.tables["fixes"].outcome == "delivered").sum()
    instants = [it[2] for it in SEEN]
    assert instants == sorted(instants)


def test_the_kalman_filter_knows_how_wrong_it_is_with_them() -> None:
    """NEES over 60 missions of 10 AUVs is 2 within a tenth, five of its standard errors of 2 %."""
    few = {"acoustics": {"hf": {"range_m": 30.0}}, "auvs": {"count": 10}, "duration_s": 200.0}
    tested = afloat(record={"detail": "summary", "metrics_hz": 0.2}, **few)
    found = [simulate(tested, seed).auvs.nees.mean() for seed in range(60)]
    assert 1.8 < np.mean(found) < 2.2


def test_a_folder_keeps_them_and_explain_tells_of_the_last(tmp_path: Any) -> None:
    run = simulate(afloat(), 7)
    again = load_result(run.write(tmp_path / "out"))
    assert again.arrow["gnss_fixes"].equals(run.arrow["gnss_fixes"])
    late = run.tables["fixes"].query("outcome == 'delivered' and delivered_at_s > 10").iloc[0]
    told = explained(again, fix=int(late.fix))
    assert "its last GNSS fix at the surface, which moved the estimate by" in told


def test_a_receiver_that_never_surfaces_is_told(tmp_path: Any) -> None:
    path = tmp_path / "deep.yaml"
    path.write_text("name: deep\nnavigation: {gnss_fix: {sd_m: 1}}\n")
    said = call("validate", path)
    assert "navigation.gnss_fix" in said.output
    assert "brings no fix: AUVs stay at 10 m and deeper" in said.output
