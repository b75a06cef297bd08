"""Two-way ranging: who calls whom, what becomes of calls, and what the answers are worth."""

import math
from typing import Any

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st
from test_reception import LOSSY, PING, at, fleet, moving, uplink
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import Result, Setup, simulate
from bindusbl_des.acoustics.loss import LOSS_LAWS, range_loss
from bindusbl_des.protocol.hf.outcomes import Outcomes
from bindusbl_des.protocol.ranging import TwoWay, nearest, strayed
from bindusbl_des.protocol.schedules.view import View
from bindusbl_des.records.events import COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from bindusbl_des.records.rows import Recorder
from bindusbl_des.usbl.fusion import fuse_shared
from bindusbl_des.usbl.two_way import own_range
from bindusbl_des.vehicles.fleet import VehicleFleet
from bindusbl_des.vehicles.motion import places

TWTT = {"ranging": "twtt", "tick_rate_hz": None}


def view_of(auvs: VehicleFleet, asvs: VehicleFleet) -> View:
    """Return what a fleet knows that sees all AUVs and ASVs where they are at 0 s."""
    plot, own = (places(fleet.motion, 0.0)[:, :3] for fleet in (auvs, asvs))
    heard = np.ones((len(auvs), len(asvs)), dtype=bool)
    return View(0, 0.0, plot, own, heard, 1e6, "horizontal", np.random.default_rng(0))


def answered(
    auvs: VehicleFleet, asvs: VehicleFleet, turnaround: float = 0.0, **changes: Any
) -> tuple[Outcomes, Recorder]:
    """Return what becomes of pings and the record, when all called at 0 s have answered."""
    env = simpy.Environment()
    band, outcomes, record = uplink(auvs, asvs, **changes)
    ranging = TwoWay(env, band, turnaround=turnaround)
    ranging.ping(0, 0, range(len(auvs)), 0.0, view_of(auvs, asvs))
    env.run()
    return outcomes, record


def test_who_calls_allows_for_its_own_way() -> None:
    """A caller that moves 45 m between its call and the answer finds the AUV where it answered."""
    # called from x = 0 in 0.4 s, answered at 0.6 s; met at 30 (0.6 + t) = 600 - 1500 t
    outcomes, record = answered(fleet(at(600.0)), fleet(moving(0.0, 30.0)), 0.19)
    back = (600 - 18) / 1530
    ping = record.pings.rows[0]
    assert (ping["sent_at_s"], ping["call_time_s"]) == pytest.approx((0.6, 0.4))
    assert record.receptions.rows["travel_time_s"] == pytest.approx(back)
    assert outcomes.resolve_passed(2.0) == range(1)
    assert record.fixes.rows["x_m"][0] == pytest.approx(600.0, abs=1e-6)
    fix = record.fixes.rows[0]
    assert (fix["pinged_at_s"], fix["valid_at_s"]) == pytest.approx((0.6, 0.6))


def test_who_did_not_call_finds_the_auv_on_an_ellipse() -> None:
    """Call and answer took 2000 m: of them 1400 m are those from where the listener hears it."""
    for row, asv in enumerate((at(0.0), at(600.0, 1400.0), at(-400.0, 1400.0))):
        outcomes, record = answered(fleet(at(600.0)), fleet(at(0.0), at(600.0, 1400.0), asv), 0.3)
        assert outcomes.resolve(0, min(row, 2))  # the first to hear it makes the fix, by itself
        assert record.fixes.rows["x_m"][0] == pytest.approx(600.0, abs=0.02)
        assert record.fixes.rows["error_m"][0] < 0.03


def test_between_caller_and_listener_nobody_can_tell() -> None:
    """On the line between them every place makes the same way: a fix says so, and is in between."""
    outcomes, record = answered(fleet(at(600.0)), fleet(at(0.0), at(2000.0)))
    assert outcomes.resolve(0, 1)
    fix = record.fixes.rows[0]
    assert 0.0 <= fix["x_m"] <= 2000.0
    assert 400.0 < fix["sd_x_m"] < 1000.0
    outcomes, record = answered(fleet(at(600.0)), fleet(at(0.0), at(2000.0)))
    assert outcomes.resolve_passed(5.0) == range(1)  # with the caller's measurement they can
    assert record.fixes.rows["x_m"][0] == pytest.approx(600.0, abs=1e-6)


@settings(max_examples=200, deadline=None)
@given(
    place=st.tuples(*[st.floats(-500.0, 500.0)] * 3),
    caller=st.tuples(*[st.floats(-500.0, 500.0)] * 3),
)
def test_the_ellipse_goes_through_the_auv(place: Any, caller: Any) -> None:
    """Whatever the geometry: the range found is the AUV's unless it is in line, and in reach."""
    auv, called_from = np.array(place), np.array(caller)
    reach = float(np.linalg.norm(auv))
    path = reach + float(np.linalg.norm(auv - called_from))
    unit = auv / reach if reach > 1e-3 else np.array([0.0, 0.0, 1.0])
    way, seen = tuple(called_from.tolist()), tuple(unit.tolist())
    found, share, bearing, lean, doubt = own_range(path, way, seen)
    rest = path - float(unit @ called_from)
    if reach > 1e-3 and rest > 1e-4 * path:
        assert found == pytest.approx(reach, abs=1e-6 * path)
        step = 1e-3 * rest
        farther = own_range(path + step, way, seen)[0]
        assert farther - found == pytest.approx(share * step, rel=0.01)
        assert doubt == 0.0
    away = float(np.linalg.norm(called_from))
    assert -1e-6 <= found <= (path + away) / 2 + 1e-6
    assert all(np.isfinite(it).all() for it in (share, bearing, lean, doubt))


def nees_of(result: Result) -> np.ndarray:
    """Return the NEES of the horizontal errors of all fixes, (n,)."""
    fixes = result.tables["fixes"].merge(result.tables["pings"], on="ping", suffixes=("", "_true"))
    error = np.array([fixes.x_m - fixes.x_m_true, fixes.y_m - fixes.y_m_true]).T
    assert np.hypot(*error.T) == pytest.approx(fixes.error_m)
    covariance = np.array(
        [[fixes.sd_x_m**2, fixes.cov_xy_m2], [fixes.cov_xy_m2, fixes.sd_y_m**2]]
    ).transpose(2, 0, 1)
    return np.asarray(np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance), error))


@pytest.mark.parametrize(
    "turnaround",
    [0.0, 1.0, *(pytest.param(it, marks=pytest.mark.slow) for it in (0.1, 0.5))],
)
@pytest.mark.parametrize("asvs", [1, 2, 3])
@pytest.mark.parametrize("combine", ["off", "clamp_first"])
def test_answers_are_as_good_as_they_say(asvs: int, turnaround: float, combine: str) -> None:
    """At 1.5 m/s up to a second of turnaround the errors agree with the covariances: NEES 2.

    With `clamp_first` one call and one answer in seven is lost, many of them at the caller.
    """
    world = scenario(
        survey={"side_m": 60.0},
        auvs={
            "count": 4,
            "vehicle": {"model": "kinematic", "turning_radius_m": 3.0},
            "speed_m_per_s": 1.5,
        },
        asvs={"count": asvs, "formation": {"radius_m": 20.0}},
        acoustics={"hf": {"range_m": 100.0}, "loss": {"combine": combine}},
        protocol={"ranging": {"model": "twtt", "turnaround_s": turnaround}},
    )
    results = [simulate(world, seed) for seed in range(4)]
    found = np.concatenate([nees_of(result) for result in results])
    assert 1.6 < found.mean() < 2.5
    if combine == "clamp_first" and asvs == 3:
        fixes = results[0].tables["fixes"].merge(results[0].tables["pings"], on="ping")
        missed = [by not in asvs.split() for by, asvs in zip(fixes.called_by, fixes.asvs)]  # noqa: B905
        assert 0.1 < np.mean(missed) < 0.3


def test_the_fleet_knows_how_far_an_auv_may_have_gone() -> None:
    """At its planned speed for a ping and a turnaround; nowhere if it holds."""
    protocol = {"ranging": {"model": "twtt", "turnaround_s": 0.99}}
    auvs = fleet(at(0.0), moving(0.0, 2.0))
    moves = scenario(auvs={"count": 2, "speed_m_per_s": 1.5}, protocol=protocol)
    assert strayed(Setup(moves), auvs) == pytest.approx([1.5**2 / 2] * 2)
    holds = still(2, protocol=protocol)
    assert strayed(Setup(holds), auvs).tolist() == [0.0, 0.0]
    data = {"kind": "track", "files": ["a.csv", "b.csv"]}
    tracks = scenario(auvs={"count": 2, "route": data}, protocol=protocol)
    assert strayed(Setup(tracks), auvs) == pytest.approx([0.0, 2.0**2 / 2])
    drifts = scenario(
        auvs={"count": 2, "vehicle": "bluerov2", "speed_m_per_s": 0.3}, protocol=protocol,
        environment={"current_m_per_s": 0.4},
    )  # fmt: skip
    assert strayed(Setup(drifts), auvs) == pytest.approx([0.5**2 / 2] * 2)


def test_a_navigator_compares_with_the_instant_at_which_a_fix_holds() -> None:
    """With `shift` a drift of 1 m/s makes no innovation but what it was at the answer."""
    drifting = {"filter": "fixed_gain", "velocity_bias_m_per_s": [1.0, 0.0]}
    world = still(
        1, protocol={"ranging": {"model": "twtt", "turnaround_s": 0.4}},
        navigation={**QUIET_NAVIGATION, **drifting},
        usbl=QUIET_USBL,
    )  # fmt: skip
    fixes = simulate(world).tables["fixes"]
    assert fixes.valid_at_s.tolist() == fixes.pinged_at_s.tolist()
    drift = fixes.valid_at_s[0]  # of its estimate, at the first fix, since the start
    assert fixes.innovation_m[0] == pytest.approx(drift, abs=0.01)
    assert fixes.latency_s[0] > 0.1  # by the delivery the drift was larger


def test_the_nearest_calls_as_far_as_the_fleet_knows() -> None:
    """Each AUV has a caller: the ASV nearest to where it is believed, the first of equals."""
    auvs, asvs = fleet(at(10.0), at(90.0), at(50.0)), fleet(at(0.0), at(100.0))
    view = view_of(auvs, asvs)
    assert nearest(view, [0, 1, 2]).tolist() == [0, 1, 0]
    view.auvs[0] = 99.0, 0.0, 0.0
    assert nearest(view, [1, 0]).tolist() == [1, 1]


def test_calls_that_meet_at_an_auv_destroy_each_other() -> None:
    """Two calls that reach an AUV less than a ping apart leave it silent; touching ones do not."""
    for gap, outcome in ((14.99, COLLIDED), (15.0, HEARD)):
        auvs, asvs = fleet(at(15.0), at(30.0 + gap - 14.0)), fleet(at(0.0), at(30.0 + gap))
        band, _, _ = uplink(auvs, asvs, hf_range=100.0)
        calls = band.call([0, 1], nearest(view_of(auvs, asvs), [0, 1]), 0.0)
        assert calls["call"][0] == outcome


def test_a_call_that_names_two_auvs_is_one_sound() -> None:
    """Both hear it, and answer when it has reached them."""
    _, record = answered(fleet(at(15.0), at(-60.0)), fleet(at(0.0)))
    assert record.pings.rows["call"].tolist() == [HEARD, HEARD]
    assert record.pings.rows["sent_at_s"] == pytest.approx([0.01 + PING, 0.04 + PING])


@pytest.mark.parametrize(("turnaround", "outcome"), [(0.0, COLLIDED), (0.05, HEARD)])
def test_a_call_drowns_answers_at_other_asvs(turnaround: float, outcome: int) -> None:
    """ASV1's call arrives 50 m away at 33 ms, when the answer from 20 m comes to ASV0 at 37 ms."""
    auvs, asvs = fleet(at(-20.0), at(70.0)), fleet(at(0.0), at(50.0))
    outcomes, record = answered(auvs, asvs, turnaround, hf_range=50.0)
    outcomes.resolve_passed(1.0)
    heard = record.receptions.rows[record.receptions.rows["outcome"] != OUT_OF_RANGE]
    assert heard["arrived_at_s"] == pytest.approx([0.08 / 3 + PING + turnaround] * 2)
    assert heard["outcome"].tolist() == [outcome] * 2
    # from farther away the call is not heard
    outcomes, record = answered(fleet(at(-20.0), at(71.0)), fleet(at(0.0), at(51.0)), hf_range=50.0)
    outcomes.resolve_passed(1.0)
    assert HEARD in record.receptions.rows["outcome"]
    assert COLLIDED not in record.receptions.rows["outcome"]


@pytest.mark.parametrize(("time", "outcome"), [(0.0899, HEARD), (0.095, COLLIDED), (0.11, HEARD)])
def test_an_asv_hears_nothing_while_it_calls(time: float, outcome: int) -> None:
    """A ping of 10 ms arrives at 0.1 s; a call of the ASV's own, to somebody else, drowns it."""
    band, outcomes, record = uplink(
        fleet(at(150.0), at(0.0, 900.0)), fleet(at(0.0), at(0.0, 5000.0))
    )
    band.send(0, 0, [0], 0.0)
    band.call([1], np.array([0]), time)
    band.call([1], np.array([1]), 0.1)  # far away, out of range of all
    outcomes.resolve_passed(1.0)
    assert record.receptions.rows["outcome"][0] == outcome


def test_calls_of_other_slots_are_searched_as_well() -> None:
    """A call from afar, sent long before a ping, is still under way when that arrives."""
    auvs, asvs = fleet(at(15.0), at(2000.0)), fleet(at(0.0), at(2250.0))
    band, outcomes, record = uplink(auvs, asvs)
    band.call([1], np.array([1]), 0.0)  # at ASV0 at 1.5 s
    for slot in range(20):
        band.call([0], np.array([0]), 0.5 + 0.02 * slot)
    band.send(0, 0, [0], 1.495)  # at ASV0 at 1.505 s, at ASV1 at 2.985 s
    for slot in range(20):
        band.call([0], np.array([0]), 2.0 + 0.02 * slot)
    outcomes.resolve_passed(5.0)
    assert record.receptions.rows["outcome"].tolist() == [COLLIDED, HEARD]


def test_calls_are_lost_as_pings_are() -> None:
    """Over 300 m the OEM head loses 68 % of the calls, and 68 % of the answers to the others."""
    world = still(
        1, at=math.sqrt(300.0**2 - 10.0**2), duration_s=2000.0,
        acoustics={"hf": {"range_m": 400.0}, "loss": {"law": "head"}}, protocol=TWTT,
    )  # fmt: skip
    result = simulate(world)
    pings, met = result.tables["pings"], result.tables["receptions"]
    chance = range_loss(300.0, LOSS_LAWS["head"])
    lost = pings.call == "lost"
    assert lost.mean() == pytest.approx(chance, abs=4 * math.sqrt(chance / 4 / len(lost)))
    answers = met[~lost]
    share = (answers.outcome == "lost").mean()
    assert share == pytest.approx(chance, abs=4 * math.sqrt(chance / 4 / len(answers)))
    auv = result.auvs.iloc[0]
    assert auv.hf_coverage == 1.0  # a silent turn in range is covered all the same
    assert auv.receptions_lost == (met.outcome == "lost").sum()
    assert (met.outcome[lost] == "lost").all()
    assert met.arrived_at_s[lost].isna().all()


def test_a_turn_without_an_answer_is_no_sound() -> None:
    """HF is in use while an ASV calls, and while an AUV answers: not when it hears no call."""
    heard = simulate(still(1, duration_s=100.0, protocol=TWTT))
    rounds = heard.mission.rounds[0]
    both = 2 * 0.010 * rounds / 100.0
    assert heard.mission.hf_utilisation[0] == pytest.approx(both, rel=0.01)
    beyond = simulate(still(1, at=51.0, duration_s=100.0, protocol=TWTT))
    pings, rounds = beyond.tables["pings"], beyond.mission.rounds[0]
    assert set(pings.call) == {"out_of_range"}
    assert pings.sent_at_s.tolist() == pings.called_at_s.tolist()
    assert set(beyond.tables["receptions"].outcome) == {"out_of_range"}
    assert beyond.tables["receptions"].arrived_at_s.isna().all()
    assert beyond.mission.hf_utilisation[0] == pytest.approx(0.010 * rounds / 100.0, rel=0.01)
    assert beyond.auvs.hf_coverage[0] == 0.0


def test_a_call_not_answered_by_the_end_is_under_way() -> None:
    """Cut between call and answer, the turn is on record, and neither covered nor uncovered."""
    # called in 14.9 ms, answered 10 ms and the turnaround later
    result = simulate(
        still(1, duration_s=0.05, protocol={"ranging": {"model": "twtt", "turnaround_s": 0.1}})
    )
    assert result.tables["pings"].call.tolist() == ["in_flight"]
    assert result.tables["receptions"].outcome.tolist() == ["in_flight"]
    assert result.auvs.pings.tolist() == [1]
    assert result.arrow["auvs"]["hf_coverage"].null_count == 1
    assert result.mission.hf_utilisation[0] == pytest.approx(0.010 / 0.05)


def test_every_call_and_ping_has_one_outcome() -> None:
    """In a crowded fleet with stale beliefs and losses, all are accounted for."""
    world = scenario(
        duration_s=60.41, survey={"side_m": 200.0},
        auvs={"count": 20, "speed_m_per_s": 2.0,
              "vehicle": {"model": "kinematic", "turning_radius_m": 3.0}},
        asvs={"count": 5, "formation": {"radius_m": 40.0}},
        acoustics={
            "hf": {"range_m": 60.0}, "loss": {"combine": "clamp_first", "contention_per_auv": 0.01},
        },
        protocol={"ranging": {"model": "twtt", "turnaround_s": 0.02}, "positions": "estimate"},
    )  # fmt: skip
    result = simulate(world, 3)
    pings, met = result.tables["pings"], result.tables["receptions"]
    assert set(pings.call) == {"heard", "lost", "collided", "out_of_range", "in_flight"}
    assert len(met) == 5 * len(pings)
    assert (pings.called_at_s.notna() & pings.called_by.notna()).all()
    of_turn = met.merge(pings[["ping", "call"]], on="ping")
    silent = of_turn.call != "heard"
    assert (of_turn.arrived_at_s.isna() == silent).all()
    in_range = of_turn.outcome != "out_of_range"
    assert (of_turn.outcome == of_turn.call)[
        silent & in_range & (of_turn.call != "out_of_range")
    ].all()
    assert "in_flight" not in set(of_turn.outcome[~silent])
    heard = met[met.outcome == "heard"].ping
    assert set(result.tables["fixes"].ping) <= set(heard)
    assert set(pings.ping[pings.call == "heard"]) >= set(heard)


def test_calls_change_no_other_noise() -> None:
    """What is measured of an answer does not depend on calls that were lost before."""
    draws = {}
    for loss in (LOSSY, None):
        auvs, asvs = fleet(at(300.0)), fleet(at(0.0))
        band, outcomes, record = uplink(auvs, asvs, **({} if loss is None else {"channel": loss}))
        calls = [band.call([0], np.array([0]), float(time)) for time in range(50)]
        lost = [call["call"][0] == LOST for call in calls]
        draws[loss is None] = lost
        band.send(0, 0, [0], 60.0)
        outcomes.resolve_passed(100.0)
        assert record.receptions.rows["outcome"][0] in (HEARD, LOST, IN_FLIGHT)
    assert not any(draws[True])
    assert 10 < sum(draws[False]) < 50


@given(st.integers(0, 10_000), st.integers(1, 4))
def test_shared_errors_are_fused_as_by_all_at_once(seed: int, others: int) -> None:
    """Fix by fix or all in one weighted least squares: the same estimate and covariance."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((4, 4))
    prior, first = root @ root.T + 0.1 * np.eye(4), rng.standard_normal(4)
    information, vector = np.linalg.inv(prior), np.linalg.inv(prior) @ first
    state, spread = first, prior
    for _ in range(others):
        unit, root = rng.standard_normal(3), rng.standard_normal((3, 3))
        unit /= np.linalg.norm(unit)
        noise, fix = root @ root.T + 0.1 * np.eye(3), rng.standard_normal(3)
        design = np.column_stack((np.eye(3), -unit))
        information = information + design.T @ np.linalg.inv(noise) @ design
        vector = vector + design.T @ np.linalg.inv(noise) @ fix
        state, spread, _, _ = fuse_shared(state, spread, fix, noise, -unit.reshape(3, 1))
    assert spread == pytest.approx(np.linalg.inv(information), abs=1e-7)
    assert state == pytest.approx(np.linalg.solve(information, vector), abs=1e-6)


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
@pytest.mark.parametrize("asvs", [1, 2])
def test_an_auv_under_its_asv_is_located(asvs: int, ranging: str) -> None:
    """At the surface, where it meets the ASVs themselves, no estimate is lost for ever."""
    stations = [[0.0, 0.0], [0.0, 0.0]][:asvs]
    world = scenario(
        duration_s=20.0, survey={"side_m": 20.0, "depth_m": 0.0}, protocol={"ranging": ranging},
        auvs={"count": 1, "route": {"kind": "hold", "positions_m": [[0.0, 0.0]]}},
        asvs={"count": asvs, "formation": {"positions_m": stations}},
    )  # fmt: skip
    for seed in range(3):
        result = simulate(world, seed)
        fixes = result.tables["fixes"]
        assert len(fixes) > 10
        assert fixes.error_m.max() < 0.2
        assert np.isfinite(fixes[["x_m", "y_m", "z_m", "sd_x_m", "cov_xy_m2"]]).all(axis=None)
        assert math.isfinite(result.mission.position_error_m[0])
