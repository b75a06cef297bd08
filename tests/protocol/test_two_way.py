"""Two-way ranging: who calls whom, what becomes of calls, and what the answers are worth."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from played_for_tests import PING, Track, at, moving, played
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import Result, Scenario, range_loss, simulate
from bindusbl_des.core.usbl.two_way import own_range

TWTT = {"ranging": "twtt", "tick_rate_hz": None}


def answered(
    auvs: list[Track], asvs: list[Track], turnaround: float = 0.0, **changes: Any
) -> Scenario:
    """Return a mission in which all are called at 0 s, and answer."""
    ranging = {"model": "twtt", "turnaround_s": turnaround}
    return played(auvs, asvs, ranging=ranging, **changes)


def heard_by(*asvs: int) -> dict[str, Any]:
    """Return changes of a mission: some ASVs alone hear answers, though any may call."""

    def channel(signals: Any) -> np.ndarray:
        hears = np.isin(np.arange(len(signals.asvs)), asvs) | signals.calling
        return np.broadcast_to(hears * 1.0, signals.ranges.shape).copy()

    return {"acoustics": {"hf": {"channel": channel}}}


def test_who_calls_allows_for_its_own_way() -> None:
    """A caller that moves 45 m between its call and the answer finds the AUV where it answered."""
    # called from x = 0 in 0.4 s, answered at 0.6 s; met at 30 (0.6 + t) = 600 - 1500 t
    tables = simulate(answered([at(600.0)], [moving(0.0, 30.0)], 0.19)).tables
    ping, fix = tables["pings"].iloc[0], tables["fixes"].iloc[0]
    assert (ping.called_at_s, ping.sent_at_s) == pytest.approx((0.0, 0.6))
    assert tables["receptions"].travel_time_s[0] == pytest.approx((600 - 18) / 1530)
    assert fix.x_m == pytest.approx(600.0, abs=1e-6)
    assert (fix.pinged_at_s, fix.valid_at_s) == pytest.approx((0.6, 0.6))


@pytest.mark.parametrize("place", [(600.0, 1400.0), (-400.0, 1400.0)])
def test_who_did_not_call_finds_the_auv_on_an_ellipse(place: tuple[float, float]) -> None:
    """Call and answer are one way, whose last part is that from where the listener hears it."""
    world = answered([at(600.0)], [at(0.0), at(*place)], 0.3, **heard_by(1))
    [fix] = simulate(world).tables["fixes"].itertuples()
    assert fix.asvs == "ASV1"
    assert fix.x_m == pytest.approx(600.0, abs=0.02)
    assert fix.error_m < 0.03


def test_between_caller_and_listener_nobody_can_tell() -> None:
    """On the line between them every place makes the same way: a fix says so, and is in between."""
    between: tuple[Any, ...] = [at(600.0)], [at(0.0), at(2000.0)]
    [fix] = simulate(answered(*between, **heard_by(1))).tables["fixes"].itertuples()
    assert 0.0 <= fix.x_m <= 2000.0
    assert 400.0 < fix.sd_x_m < 1000.0
    [fix] = simulate(answered(*between)).tables["fixes"].itertuples()
    assert fix.asvs == "ASV0 ASV1"  # with the caller's measurement they can
    assert fix.x_m == pytest.approx(600.0, abs=1e-6)


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


def test_a_fix_allows_for_what_an_auv_has_gone_between_call_and_answer() -> None:
    """Who did not call knows it at the planned speed for a ping and a turnaround, on an unknown
    course: not at all if the AUV holds; a current adds its own way to that of hulls.
    """

    def sd_m(**auvs: Any) -> float:
        water = auvs.pop("environment", {})
        world = scenario(
            duration_s=2.0, survey={"side_m": 60.0}, auvs={"count": 1, **auvs}, usbl=QUIET_USBL,
            asvs={"count": 2, "formation": {"positions_m": [[-40.0, 0.0], [40.0, 300.0]]}},
            acoustics={"hf": {"range_m": 900.0, **heard_by(1)["acoustics"]["hf"]}},
            protocol={"ranging": {"model": "twtt", "turnaround_s": 0.99}},
            environment=water, navigation=QUIET_NAVIGATION,
        )  # fmt: skip
        fix = simulate(world).tables["fixes"].iloc[0]
        assert fix.asvs == "ASV1"
        return math.hypot(fix.sd_x_m, fix.sd_y_m)

    assert sd_m(route={"kind": "hold", "positions_m": [[0.0, 0.0]]}) < 1e-3
    slow, fast = sd_m(speed_m_per_s=1.0), sd_m(speed_m_per_s=2.0)
    assert 0.1 < slow < 1.0
    assert fast / slow == pytest.approx(2.0, rel=0.1)  # it is elsewhere by then
    hull = {"vehicle": "bluerov2", "speed_m_per_s": 0.3}
    drifts = sd_m(**hull, environment={"current_m_per_s": 0.4})
    assert drifts / sd_m(**hull) == pytest.approx(0.5 / 0.3, rel=0.05)


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


def calls(world: Scenario) -> list[str]:
    """Return what became of the call of each AUV."""
    return simulate(world).tables["pings"].sort_values("auv").call.tolist()


def test_the_nearest_calls() -> None:
    """Each AUV has a caller: the ASV nearest to it, the first of equals."""
    world = answered([at(10.0), at(90.0), at(50.0)], [at(0.0), at(100.0)])
    pings = simulate(world).tables["pings"].sort_values("auv")
    assert pings.called_by.tolist() == ["ASV0", "ASV1", "ASV0"]


def test_calls_that_meet_at_an_auv_destroy_each_other() -> None:
    """Two calls that reach an AUV less than a ping apart leave it silent; touching ones do not."""
    for gap, outcome in ((14.99, "collided"), (15.0, "heard")):
        auvs, asvs = [at(15.0), at(30.0 + gap - 14.0)], [at(0.0), at(30.0 + gap)]
        assert calls(answered(auvs, asvs, hf_range=100.0))[0] == outcome


def test_a_call_that_names_two_auvs_is_one_sound() -> None:
    """Both hear it, and answer when it has reached them."""
    pings = simulate(answered([at(15.0), at(-60.0)], [at(0.0)])).tables["pings"]
    assert pings.call.tolist() == ["heard", "heard"]
    assert pings.sent_at_s.to_numpy() == pytest.approx([0.01 + PING, 0.04 + PING])


@pytest.mark.parametrize(("turnaround", "outcome"), [(0.0, "collided"), (0.05, "heard")])
def test_a_call_drowns_answers_at_other_asvs(turnaround: float, outcome: str) -> None:
    """ASV1's call arrives 50 m away at 33 ms, when the answer from 20 m comes to ASV0 at 37 ms."""
    world = answered([at(-20.0), at(70.0)], [at(0.0), at(50.0)], turnaround, hf_range=50.0)
    met = simulate(world).tables["receptions"]
    heard = met[met.outcome != "out_of_range"]
    assert heard.arrived_at_s.to_numpy() == pytest.approx([0.08 / 3 + PING + turnaround] * 2)
    assert heard.outcome.tolist() == [outcome] * 2
    # from farther away the call is not heard
    world = answered([at(-20.0), at(71.0)], [at(0.0), at(51.0)], hf_range=50.0)
    assert set(simulate(world).tables["receptions"].outcome) == {"heard", "out_of_range"}


@pytest.mark.parametrize(
    ("time", "outcome"), [(0.0899, "heard"), (0.095, "collided"), (0.11, "heard")]
)
def test_an_asv_hears_nothing_while_it_calls(time: float, outcome: str) -> None:
    """A ping of 10 ms arrives at 0.1 s; a call of the ASV's own, to somebody else, drowns it."""
    world = played(
        [at(150.0), at(0.0, 900.0)], [at(0.0), at(0.0, 5000.0)], pings=[(0.0, 0)],
        calls=[(time, 1, 0), (0.1, 1, 1)],  # the second far away, out of range of all
    )  # fmt: skip
    assert simulate(world).tables["receptions"].outcome[0] == outcome


def test_calls_of_other_slots_are_searched_as_well() -> None:
    """A call from afar, sent long before a ping, is still under way when that arrives."""
    others = [(start + 0.02 * k, 0, 0) for start in (0.5, 2.0) for k in range(20)]
    world = played(
        [at(15.0), at(2000.0)], [at(0.0), at(2250.0)],
        pings=[(1.495, 0)],  # at ASV0 at 1.505 s, at ASV1 at 2.985 s
        calls=[(0.0, 1, 1), *others],  # the first at ASV0 at 1.5 s
    )  # fmt: skip
    assert simulate(world).tables["receptions"].outcome.tolist() == ["collided", "heard"]


def test_calls_are_lost_as_pings_are() -> None:
    """Over 300 m the paper's law loses 29 % of the calls, and 29 % of the answers to the others."""
    world = still(
        1, at=math.sqrt(300.0**2 - 10.0**2), duration_s=2000.0,
        acoustics={"hf": {"range_m": 400.0}, "loss": {"law": "paper", "combine": "clamp_first"}},
        protocol=TWTT,
    )  # fmt: skip
    result = simulate(world)
    pings, met = result.tables["pings"], result.tables["receptions"]
    chance = range_loss(300.0)
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

    def errors(lost: float) -> list[float]:
        def channel(signals: Any) -> np.ndarray:
            return np.full(signals.ranges.shape, 1.0 - lost * signals.calling)

        changes = {"acoustics": {"hf": {"channel": channel}}, "protocol": TWTT}
        found: list[float] = simulate(still(1, duration_s=60.0, **changes)).tables["fixes"].error_m
        return list(found)

    every, some = errors(0.0), errors(0.5)
    assert 50 < len(some) < 0.7 * len(every)
    assert some == every[: len(some)]


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
