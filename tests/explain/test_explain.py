"""Causal chains: each step has its instant, its distance and the rule that decided it."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from explain_for_tests import chain_of_fix, chain_of_ping
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import Odometry, Result, Scenario, Setup, Signals, limits, load_scenario, simulate

# Error (m) at 22 m of a fix without noise: the array takes a spherical wave for a plane one.
PLANE_WAVE = 6e-3


def step(chain: Any, who: str) -> Any:
    """Return the first step of somebody."""
    return next(it for it in chain.steps if it.who == who)


def delivered(run: Result) -> list[Any]:
    """Return the rows of the fixes that were delivered."""
    return list(run.tables["fixes"].query("outcome == 'delivered'").itertuples())


def around(*stations: tuple[float, float], auvs: int = 1, at: float = 20.0, **changes: Any) -> Any:
    """Return AUVs that hold still at (at, 0) with ASVs where one wants them, without noise."""
    base: dict[str, Any] = {
        "duration_s": 3.0,
        "asvs": {"count": len(stations), "formation": {"positions_m": list(map(list, stations))}},
        "navigation": QUIET_NAVIGATION,
        "usbl": QUIET_USBL,
    }
    return still(auvs, at=at, **{**base, **changes})


def test_who_is_near_hears_and_who_is_far_does_not() -> None:
    """Horizontal 20 m is within, 63.2 m beyond the HF range of 50 m; slant ranges are 10 m deep."""
    chain = chain_of_ping(simulate(around((0.0, 0.0), (-43.2, 0.0))), 0)
    near, far = step(chain, "ASV0"), step(chain, "ASV1")
    assert near.why.startswith("horizontal range 20.0 m <= 50 m HF range; no other ping overlaps")
    assert far.why == "horizontal range 63.2 m > 50 m HF range"
    assert near.facts["slant_range_m"] == pytest.approx(np.hypot(20.0, 10.0))
    assert near.time_s == pytest.approx(np.hypot(20.0, 10.0) / 1500.0)
    assert (near.facts["outcome"], far.facts["outcome"]) == ("heard", "out_of_range")
    assert [it.time_s for it in chain.steps] == sorted(it.time_s for it in chain.steps)


def test_acknowledgements_of_a_ping_are_told_with_what_became_of_them() -> None:
    """ASV1, in its turn, has heard ASV0 say so, and keeps quiet."""
    access = {"model": "aloha", "acknowledgement_bytes": 2}
    asked = {"access": access, "frame_s": 2.0}
    result = simulate(around((0.0, 0.0), (3.0, 0.0), protocol=asked, duration_s=30.0))
    ping, signal = (result.tables[name].iloc[0] for name in ("pings", "signals"))
    [told] = [it for it in chain_of_ping(result, 0).steps if "'acknowledgement'" in it.what]
    assert (told.who, told.time_s) == ("ASV0", signal.sent_at_s)
    assert told.what == "sends 'acknowledgement' to AUV0, 16.0 ms"
    way = np.hypot(20.0, 10.0) / 1500.0
    assert told.time_s == pytest.approx(ping.sent_at_s + 0.01 + way)
    assert told.why == f"AUV0 decodes it by {told.time_s + way + 0.016:.4f} s"
    for number in range(len(result.tables["pings"])):
        steps = [it for it in chain_of_ping(result, number).steps if "'acknowl" in it.what]
        assert len(steps) == 1, number


def test_a_slant_range_is_compared_as_such() -> None:
    """With range_metric slant the way itself counts."""
    hf = {"range_m": 22.0, "range_metric": "slant"}
    chain = chain_of_ping(simulate(around((0.0, 0.0), acoustics={"hf": hf})), 0)
    assert step(chain, "ASV0").why == "slant range 22.4 m > 22 m HF range"
    assert chain.told == "no fix: every ASV is out of HF range (22 m slant)"


@pytest.mark.parametrize("metric", ["horizontal", "slant"])
def test_mf_goes_by_its_own_metric(metric: str) -> None:
    """40 m deep and 40 m aside, 56.6 m of slant range, with 50 m of MF range: decoded where that is
    seen from above, and beyond it else; coverage, limits, prediction and the explanation agree.
    """
    bands = {"hf": {"range_m": 60.0}, "mf": {"range_m": 50.0, "range_metric": metric}}
    held = around((0.0, 0.0), at=40.0, survey={"depth_m": 40.0}, acoustics=bands)
    result, is_told = simulate(held), metric == "horizontal"
    outcomes = set(
        result.tables["fixes"].query("latency_s.notna() or outcome != 'in_flight'").outcome
    )
    assert outcomes == {"delivered" if is_told else "out_of_range"}
    text = chain_of_fix(result, 0).text()
    words = (
        "horizontal range of AUV0 40.0 m <= 50 m"
        if is_told
        else "slant range of AUV0 56.6 m > 50 m"
    )
    assert f"{words} MF range" in text
    assert limits(held).fix_chance.tolist() == [float(is_told)]
    reach = Setup(held).horizontal_mf_reach_m
    assert reach == pytest.approx(50.0 if is_told else 30.0)


def silent(signals: Signals) -> np.ndarray:
    """A channel through which nothing gets."""
    return np.zeros(signals.ranges.shape)


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_a_channel_of_ones_own_decides_and_not_the_disc(ranging: str) -> None:
    """An AUV 20 m from an ASV, well within 50 m: nobody speaks of that range."""
    protocol = {"ranging": ranging, "schedule": "one_per_slot"}
    channel = {"hf": {"channel": silent}}
    run = simulate(around((0.0, 0.0), protocol=protocol, acoustics=channel))
    chain = chain_of_ping(run, 0)
    way = "where the channel test_explain:silent lets no sound through"
    sent = {
        "owtt_sync": f"no fix: every ASV is {way}",
        "twtt": f"no ping: AUV0 is 20.0 m away, {way}",
    }
    assert chain.told == sent[ranging]
    assert chain.outcome == "out_of_range"
    assert "50" not in "".join(it.why for it in chain.steps if it.who == "ASV0")
    assert [it.facts.get("limit_m") for it in chain.steps if it.who == "ASV0"] == [None]


def test_a_lost_ping_tells_its_probability() -> None:
    """Contention of two more AUVs at 0.45 each makes 0.9; the draw is not recorded."""
    loss = {"law": "paper", "combine": "clamp_first", "contention_per_auv": 0.45}
    run = simulate(around((0.0, 0.0), auvs=3, acoustics={"loss": loss}, duration_s=6.0))
    receptions = run.tables["receptions"]
    lost = int(receptions.ping[receptions.outcome == "lost"].iloc[0])
    chain = chain_of_ping(run, lost)
    words = "loss probability 0.900 by range law 'paper' and contention, 0.45 a further AUV"
    assert words in step(chain, "ASV0").why
    assert chain.told == "no fix: lost at 1 of 1 ASVs in range"
    assert step(chain, "ASV0").facts["loss_probability"] == pytest.approx(0.9)
    assert (chain.outcome, chain.fix, chain.parts) == ("lost", None, ())


def test_a_chance_names_its_law() -> None:
    """A scaled law is the paper's at a third of the range here, where that is below zero."""
    far = {"hf": {"range_m": 300.0}, "mf": {"range_m": 600.0}, "loss": {"law": "scaled"}}
    run = simulate(around((299.8, 0.0), survey={"side_m": 800.0}, acoustics=far, duration_s=6.0))
    heard = step(chain_of_ping(run, 0), "ASV0")
    assert "loss probability 0.000 by range law 'scaled'" in heard.why
    assert heard.facts["loss_probability"] == 0.0


def test_collided_pings_name_each_other() -> None:
    """AUVs at 9 m and 9.3 m distance ping at once: all but 0.1 ms of 10 ms overlap."""
    run = simulate(
        scenario(
            duration_s=3.0,
            auvs={"count": 2, "route": {"kind": "hold", "positions_m": [[9, 0], [-9.3, 0]]}},
            asvs={"count": 1, "formation": {"positions_m": [[0, 0]]}},
            protocol={"schedule": "schedules_for_tests:all_at_once"},
        )
    )
    chain = chain_of_ping(run, 0)
    apart = (np.hypot(9.3, 10.0) - np.hypot(9.0, 10.0)) / 1500.0
    assert f"overlaps ping 1 of AUV1 at {np.hypot(9.3, 10.0) / 1500.0:.4f} s" in chain.text()
    assert f"overlap {1e3 * (0.01 - apart):.1f} of 10.0 ms" in chain.text()
    assert chain.told == "no fix: collided at 1 of 1 ASVs in range"
    assert "with AUV1" in chain.text()


def test_groups_tell_whom_they_keep_apart() -> None:
    """AUVs that one ASV hears ping in slots of their own, and the chain says why."""
    chain = chain_of_ping(simulate(around((0.0, 0.0), auvs=2)), 1)
    ping = next(it for it in chain.steps if it.who == "AUV1")
    assert ping.what.startswith("pings at x 20.0, y 0.0, depth 10.0 m")
    assert ping.why.endswith("alone, apart from AUV0 (ASV0): heard by the same ASV")
    assert ping.facts["slot"] == 1


def test_what_the_mission_cuts_short_is_told() -> None:
    """A ping, a fix and a frame under way at the end are told as such."""
    ping = chain_of_ping(simulate(around((0.0, 0.0), duration_s=0.02)), 0)
    assert ping.told == "no fix: the mission ends while the ping is under way"
    assert "the ping ends at 0.0249 s, the mission at 0.02 s" in step(ping, "ASV0").why
    fix = chain_of_ping(simulate(around((0.0, 0.0), duration_s=0.05)), 0)
    assert fix.told == "fix 0, but the mission ends before any ASV broadcasts it"
    frame = chain_of_ping(simulate(around((0.0, 0.0), duration_s=0.2)), 0)
    assert frame.told == "fix 0, but the mission ends while it is on its way down"
    assert {it.outcome for it in (ping, fix, frame)} == {"in_flight"}


def test_a_fix_beyond_mf_range_is_told() -> None:
    """The ASV that broadcasts is 45 m away, beyond an MF range of 30 m."""
    world = around((0.0, 0.0), (65.0, 0.0), acoustics={"mf": {"range_m": 30.0}},
                   protocol={"broadcaster": "rotate"})  # fmt: skip
    run = simulate(world)
    missed = run.tables["fixes"].query("outcome == 'out_of_range'").fix.iloc[0]
    chain = chain_of_fix(run, int(missed))
    assert "never delivered: AUV0 is beyond mf.range_m = 30 m of ASV1" in chain.told
    assert "horizontal range of AUV0 45.0 m > 30 m MF range" in chain.text()
    assert chain.parts == ()


@pytest.mark.parametrize(
    ("ranging", "tick_rate_hz"),
    [
        ("owtt_sync", 30.0),
        ("twtt", None),
        pytest.param("owtt_sync", None, marks=pytest.mark.slow),
        pytest.param("twtt", 30.0, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(
    "downlink", ["sequential", "pipelined_round", "pipelined_group", "direct_reply"]
)
def test_the_parts_of_every_latency_add_up(
    downlink: str, ranging: str, tick_rate_hz: float | None
) -> None:
    """None is negative, their sum is the recorded latency, and what is printed adds up too."""
    protocol = {"downlink": downlink, "ranging": ranging, "tick_rate_hz": tick_rate_hz}
    run = simulate(scenario(duration_s=16.0, protocol=protocol), 1)
    fixes = delivered(run)
    assert len(fixes) > 10
    for fix in fixes[:: len(fixes) // 5]:
        chain = chain_of_fix(run, fix.fix)
        assert min(part.duration_s for part in chain.parts) > -1e-9
        assert sum(p.duration_s for p in chain.parts) == pytest.approx(fix.latency_s, abs=1e-12)
        printed = chain.text().partition("Latency ")[2].splitlines()
        total, parts = float(printed[0].split()[0]), [float(it.split()[0]) for it in printed[1:]]
        assert total == pytest.approx(sum(parts), abs=1e-9)
    if tick_rate_hz is None:
        assert "clock" not in chain.text().partition("Latency ")[2]


@pytest.mark.parametrize(("reply_at", "decoding"), [("ping_front", 0.0), ("ping_end", 0.01)])
def test_a_direct_reply_sets_out_when_it_is_said_to(reply_at: str, decoding: float) -> None:
    """At the front of the ping, 14.9 ms after it began, or at its end: the chain names which."""
    downlink = {"model": "direct_reply", "reply": "instant", "reply_at": reply_at}
    protocol = {"downlink": downlink, "tick_rate_hz": None}
    chain = chain_of_fix(simulate(around((0.0, 0.0), protocol=protocol)), 0)
    way = np.hypot(20.0, 10.0) / 1500.0
    assert f"reply_at {reply_at}" in chain.text()
    parts = {part.name: part.duration_s for part in chain.parts}
    assert parts["way up: the ping is heard by the first ASV"] == pytest.approx(way + decoding)
    assert parts["wait for the broadcast"] == pytest.approx(0.0, abs=1e-12)
    assert parts["way down"] == pytest.approx(way)


def test_the_way_down_is_the_distance() -> None:
    """On the exact clock, 22.36 m take 14.9 ms after the end of the frame."""
    run = simulate(around((0.0, 0.0), protocol={"tick_rate_hz": None}))
    parts = {part.name: part.duration_s for part in chain_of_fix(run, 0).parts}
    assert parts["way down"] == pytest.approx(np.hypot(20.0, 10.0) / 1500.0)
    assert parts["frame on the air"] == pytest.approx(24 * 8 * 2 / 2000)
    assert parts["wait for the broadcast"] == pytest.approx(0.1 - 0.01 - np.hypot(20, 10) / 1500)


@pytest.mark.parametrize("delay_compensation", ["none", "shift"])
def test_a_correction_takes_its_share_of_the_error(delay_compensation: str) -> None:
    """A bias of 1 m/s and nothing else: errors before and after follow from eq. update."""
    bias = {**QUIET_NAVIGATION, "velocity_bias_m_per_s": [1.0, 0.0],
            "filter": {"model": "fixed_gain", "gain": 0.75,
                       "delay_compensation": delay_compensation}}  # fmt: skip
    run = simulate(around((0.0, 0.0), navigation=bias))
    chain = chain_of_fix(run, 0)
    facts = next(it for it in chain.steps if "has it" in it.what).facts
    # A latency L after the ping at 0 the drift is L metres; at the ping it was none.
    drift = facts["latency_s"]
    assert facts["error_before_m"] == pytest.approx(drift, abs=1e-3)
    innovation = drift if delay_compensation == "none" else 0.0
    assert facts["innovation_m"] == pytest.approx(innovation, abs=PLANE_WAVE)
    assert facts["error_after_m"] == pytest.approx(drift - 0.75 * innovation, abs=PLANE_WAVE)


def test_errors_differ_by_what_the_estimate_moved() -> None:
    """In a noisy mission no correction changes the error by more than it moved the estimate."""
    run = simulate(scenario(duration_s=15.0, navigation={"filter": "fixed_gain"}), 3)
    known = 0
    for fix in delivered(run)[::3]:
        facts = next(it for it in chain_of_fix(run, fix.fix).steps if "has it" in it.what).facts
        assert facts["moved_m"] == pytest.approx(0.9 * fix.innovation_m)
        if facts["error_before_m"] is not None:
            known += 1
            change = abs(facts["error_before_m"] - facts["error_after_m"])
            assert change <= facts["moved_m"] + 1e-9
            assert facts["error_after_m"] > 0
    assert known > 5


def test_errors_of_a_filter_that_has_learnt_are_those_of_the_instant() -> None:
    """Its correction changes between fixes; tracks of 2 Hz tell the errors as of 100 Hz do."""
    coarse, fine = (
        simulate(scenario(duration_s=120.0, record={"tracks_hz": rate}), 3) for rate in (2.0, 100.0)
    )
    off = []
    for fix in delivered(coarse)[::3]:
        around, true = (errors_around(run, fix) for run in (coarse, fine))
        if None not in (*around, *true):
            off += [abs(a - b) for a, b in zip(around, true, strict=True)]
    assert len(off) > 60
    assert np.quantile(off, 0.95) < 0.02
    assert "by the covariances it moves the estimate" in chain_of_fix(coarse, 50).text()


class Trusting:
    """A navigator of somebody's own that believes the last fix, to 2 m."""

    def __init__(self, reckoning: Any, auvs: int) -> None:
        self.offsets: list[list[tuple[float, np.ndarray]]] = [[] for _ in range(auvs)]
        self.reckoning = reckoning

    def correct(self, fixes: np.ndarray, due: np.ndarray) -> None:
        for fix in fixes[due]:
            here = np.array(self.reckoning.at(fix.auv, fix.delivered_at_s))
            offset = np.array([fix.x_m, fix.y_m]) - here
            self.offsets[fix.auv].append((fix.delivered_at_s, offset))

    def estimate(self, auv: int, odometry: Odometry) -> np.ndarray:
        out = odometry.position.copy()
        for since, offset in self.offsets[auv]:
            late = odometry.times >= since
            out[late] = odometry.position[late] + offset
        return out

    def covariance(self, auv: int, odometry: Odometry) -> np.ndarray:
        return np.tile([4.0, 4.0, 0.0], (len(odometry.times), 1))


def corrections(run: Result, which: slice) -> list[tuple[Any, Any, str]]:
    """Return some of the delivered fixes with the step that tells what they changed, all its words.

    To tell one takes longer than to fly the mission.
    """
    found = []
    for fix in delivered(run)[which]:
        has = next(it for it in chain_of_fix(run, fix.fix).steps if "has it" in it.what)
        found.append((fix, has, " ".join(has.text().split())))
    return found


def errors_around(run: Result, fix: Any) -> tuple[Any, Any]:
    """Return what an AUV erred by before a fix and after it, as it is told."""
    has = next(it for it in chain_of_fix(run, fix.fix).steps if "has it" in it.what)
    return has.facts["error_before_m"], has.facts["error_after_m"]


def test_a_filter_that_weighs_tells_gain_gate_and_what_it_changed() -> None:
    """The gate is as strict as it says; what passes tells its gain and the ellipse after it."""
    navigation = {"nis_gate": 3.0, "random_walk_m_per_sqrt_s": 0.3}
    run = simulate(scenario(duration_s=40.0, navigation=navigation), 3)
    smaller = refused = 0
    for fix, has, text in corrections(run, slice(0, None, 3)):
        if fix.nis <= 3.0:
            assert f"gate: normalised, its square is {fix.nis:.2f} <= 3 (nis_gate)" in text
            assert f"moves the estimate by {fix.correction_m:.2f} m" in text
            assert f", {has.facts['gain']:.2f} of the innovation" in text
            assert has.facts["gain"] == pytest.approx(fix.correction_m / fix.innovation_m)
        else:
            assert f"gate: normalised, its square is {fix.nis:.2f} > 3 (nis_gate)" in text
            assert np.isnan(fix.correction_m) == ("refused: the estimate stays" in text)
            assert np.isnan(fix.correction_m) != ("yet 5 in a row had been refused" in text)
            assert (has.facts["gain"] is None) == ("refused: the" in text)
            refused += "refused: the" in text
        assert has.facts["gate"] == 3.0
        if has.facts["ellipse_before_m"] is not None:
            before, after = has.facts["ellipse_before_m"], has.facts["ellipse_after_m"]
            smaller += after < before
            verb = "falls" if after < before else "grows"
            assert f"half the length of its 95 % ellipse {verb} from {before:.2f}" in text
    assert refused > 3
    assert smaller > 10


def test_after_five_refused_the_next_is_taken_in() -> None:
    """A gate that lets nearly nothing pass lets each sixth fix pass, and says why."""
    run = simulate(scenario(duration_s=20.0, navigation={"nis_gate": 1e-3}))
    told = [text for _, _, text in corrections(run, slice(21))]
    assert any("> 0.001 (nis_gate), yet 5 in a row had been refused" in text for text in told)
    assert any(text.endswith("refused: the estimate stays") for text in told)


def test_without_a_gate_a_filter_says_so() -> None:
    """`nis_gate: null` takes everything in."""
    run = simulate(scenario(duration_s=20.0, navigation={"nis_gate": None}))
    for fix, has, text in corrections(run, slice(0, None, 6)):
        assert f"normalised, its square is {fix.nis:.2f}; no gate".replace(";", "") in text
        assert has.facts["gate"] is None


def test_every_navigator_tells_what_it_did_with_a_fix() -> None:
    """A fixed gain has no gate, dead reckoning takes nothing in, one's own is named."""
    fixed, alone, own = (
        corrections(
            simulate(scenario(duration_s=12.0, navigation={"filter": name}), 1), slice(0, None, 4)
        )
        for name in ("fixed_gain", "dead_reckoning", "test_explain:Trusting")
    )
    for fix, has, text in fixed:
        assert "no gate: fixed_gain takes every fix in gain 0.9 x" in text
        assert has.facts["gain"] == pytest.approx(0.9)
        assert (has.facts["gate"], has.facts["moved_m"]) == (None, fix.correction_m)
    for _, has, text in alone:
        assert text.endswith("dead reckoning alone takes no fix in")
        assert (has.facts["gain"], has.facts["ellipse_before_m"]) == (0.0, None)
        assert has.facts["error_after_m"] == pytest.approx(has.facts["error_before_m"], abs=1e-9)
    for fix, has, text in own:
        assert f"test_explain:Trusting moves the estimate by {fix.correction_m:.2f} m, " in text
        assert has.facts["gain"] == pytest.approx(fix.correction_m / fix.innovation_m)
        around = [has.facts[f"ellipse_{when}_m"] for when in ("before", "after")]
        assert around == [None, None] or around == pytest.approx([2 * np.sqrt(5.991464547)] * 2)
    assert min(map(len, (fixed, alone, own))) > 5


def test_a_fix_too_late_for_its_place_is_told() -> None:
    """Without an innovation there is no gain and no gate to tell of."""
    run = simulate(scenario(duration_s=20.0))
    late = run.tables["fixes"].query("outcome == 'delivered'").index[-1]
    run.tables["fixes"].loc[late, ["innovation_m", "nis", "correction_m"]] = None
    _, has, text = corrections(run, slice(-1, None))[0]
    assert text.endswith("it comes too late for its place among fixes of later instants, and is "
                         "left out")  # fmt: skip
    assert {has.facts[name] for name in ("innovation_m", "gain", "nis", "moved_m")} == {None}


@pytest.mark.parametrize(
    ("broadcaster", "told"),
    [
        ("rotate", "rotate: frame 1 is that of ASV 1 mod 2 = 1"),
        ("random", "random: drawn at random"),
        ("fixed", "fixed: always ASV0"),
        ("most_fixes", "most_fixes: it measured 1 of the 1, no ASV more"),
        ("nearest", "nearest: mean distance to the fixes ASV0 20.0 m, ASV1 10.0 m"),
        ("parallel", "parallel: ASV1 is the nearest to the fix, "),
    ],
)
def test_the_broadcaster_is_chosen_by_its_rule(broadcaster: str, told: str) -> None:
    """Each rule is told with the numbers that it compared."""
    run = simulate(around((0.0, 0.0), (30.0, 0.0), protocol={"broadcaster": broadcaster}))
    assert told in " ".join(chain_of_fix(run, 1).text().split())


def test_a_call_precedes_the_ping_of_two_way_ranging() -> None:
    """The AUV answers a ping and the turnaround after it has heard the call."""
    run = simulate(
        around((0.0, 0.0), protocol={"ranging": {"model": "twtt", "turnaround_s": 0.04}})
    )
    call, ping = (step(chain_of_ping(run, 0), who) for who in ("ASV0", "AUV0"))
    assert call.time_s == 0.0
    assert call.what == "calls AUV0"
    assert call.facts["call_travel_time_s"] == pytest.approx(np.hypot(20.0, 10.0) / 1500.0)
    assert call.facts["reply_delay_s"] == pytest.approx(0.05)
    assert ping.time_s == pytest.approx(np.hypot(20.0, 10.0) / 1500.0 + 0.05)


@pytest.mark.parametrize(
    ("outcome", "changes", "told"),
    [
        ("out_of_range", {"at": 60.0}, "AUV0 is 60.0 m away, out of HF range (50 m horizontal)"),
        ("lost", {"acoustics": {"loss": {"law": "none", "combine": "clamp_first",
                                          "contention_per_auv": 0.9}}, "auvs": 2},
         "AUV0, 20.0 m away, loses the call by chance"),
        ("in_flight", {"protocol": {"ranging": {"model": "twtt", "turnaround_s": 5.0}}},
         "the mission ends before AUV0 answers"),
    ],
)  # fmt: skip
def test_a_call_without_an_answer_is_told(outcome: str, changes: dict[str, Any], told: str) -> None:
    """No ping, no reception: the chain ends with the call and what became of it."""
    protocol = {"ranging": "twtt", "schedule": "one_per_slot", **changes.pop("protocol", {})}
    run = simulate(around((0.0, 0.0), protocol=protocol, **changes))
    pings = run.tables["pings"]
    chain = chain_of_ping(
        run, int(pings.ping[(pings.call == outcome) & (pings.auv == "AUV0")].iloc[0])
    )
    assert (chain.outcome, chain.fix) == (outcome, None)
    assert chain.told == f"no ping: {told}"
    assert [it.who for it in chain.steps] == ["Round " + str(chain.steps[0].facts["round"]), "ASV0"]
    assert told in " ".join(chain.text().split())


def test_calls_that_collide_are_told() -> None:
    """A call drowns another one at an AUV, and a ping at another ASV."""
    stations = {"positions_m": [[0.0, 0.0], [40.0, 0.0]]}
    route = {"kind": "hold", "positions_m": [[18.0, 0.0], [22.0, 0.0]]}
    everybody = {"schedule": "schedules_for_tests:all_at_once", "ranging": "twtt"}
    run = simulate(scenario(
        duration_s=2.0, auvs={"count": 2, "route": route}, protocol=everybody,
        asvs={"count": 2, "formation": stations},
    ))  # fmt: skip
    assert "no ping: another ASV's call overlaps it at AUV0" in chain_of_ping(run, 0).text()
    route["positions_m"], stations["positions_m"] = [[-20.0, 0.0], [70.0, 0.0]], [[0, 0], [50, 0]]
    run = simulate(scenario(
        duration_s=2.0, survey={"depth_m": 0.0}, auvs={"count": 2, "route": route},
        asvs={"count": 2, "formation": stations}, protocol=everybody,
    ))  # fmt: skip
    text = " ".join(chain_of_ping(run, 0).text().split())
    assert "overlaps the call of ASV1" in text


@pytest.mark.parametrize(
    "protocol",
    [{}, {"downlink": "pipelined_round"}, {"downlink": "direct_reply", "ranging": "twtt"}],
)
def test_every_ping_has_a_chain_of_80_columns(protocol: dict[str, Any]) -> None:
    """Whatever became of it, its chain can be told, and its outcome is that of the tables."""
    loss = {"law": "head", "combine": "clamp_first"}
    run = simulate(scenario(duration_s=8.0, protocol=protocol, acoustics={"loss": loss}), 2)
    fixes = run.tables["fixes"].set_index("ping")
    for number in run.tables["pings"].ping[::2]:
        chain = chain_of_ping(run, number)
        assert max(map(len, chain.text().splitlines())) <= 80
        if number in fixes.index:
            assert chain.outcome == fixes.outcome[number]
            assert chain.fix == fixes.fix[number]


def test_explain_prints_json(tmp_path: Path) -> None:
    """`--json` holds the steps with their numbers."""
    run: Result = simulate(scenario(duration_s=5.0))
    folder = str(run.write(tmp_path / "run"))
    done = call("explain", folder, "--fix", "0", "--json")
    assert done.exit_code == 0, done.output
    data = json.loads(done.stdout)
    fix = run.tables["fixes"].iloc[0]
    assert (data["fix"], data["ping"], data["auv"]) == (0, fix.ping, fix.auv)
    assert sum(part["duration_s"] for part in data["parts"]) == pytest.approx(fix.latency_s)
    assert {"time_s", "who", "what", "why", "facts"} == set(data["steps"][0])
    outcomes = {step["facts"].get("outcome") for step in data["steps"]}
    assert "heard" in outcomes


def test_without_events_there_is_nothing_to_tell() -> None:
    """A summary says so; a number that is none is told with those that are."""
    summary = simulate(scenario(duration_s=3.0, record={"detail": "summary"}))
    with pytest.raises(LookupError, match="recorded no events"):
        chain_of_ping(summary, 0).text()
    run = simulate(scenario(duration_s=3.0))
    with pytest.raises(LookupError, match=r"the run has no ping 99; it has 0\.\.\d"):
        chain_of_ping(run, 99).text()


@pytest.mark.parametrize("ranging", ["owtt_sync", "passive"])
def test_how_slow_errors_moved_a_range_is_told_with_the_fix(ranging: str) -> None:
    """All the range errs by is slow here: what is told is what the fix is too far away."""
    sheet = {"model": "datasheet", "bearing_sd_deg": 0.0001, "range_sd_m": 0.5}
    usbl = {**QUIET_USBL, "model": sheet, "slow_share": 1.0, "correlation_s": 20.0}
    result = simulate(
        around((0.0, 0.0), usbl=usbl, protocol={"ranging": ranging}, duration_s=30.0), 4
    )
    for number in (0, 5, len(result.tables["fixes"]) - 1):
        made = step(chain_of_fix(result, number), f"Fix {number}")
        longer = made.facts["ASV0_slow_range_m"]
        row = result.tables["fixes"].iloc[number]
        ranged = np.sqrt(row.x_m**2 + row.y_m**2 + row.z_m**2)
        assert ranged - np.hypot(20.0, 10.0) == pytest.approx(longer, abs=1e-3)
        assert f"ranges slowly astray (m): ASV0 {longer:+.3f}" in made.why


def test_what_was_wrong_all_the_time_is_told_with_the_fix() -> None:
    """Who was turned and astray, and by how much: that is what the fix is off."""
    result = simulate(
        around((0.0, 0.0), usbl={**QUIET_USBL, "misalignment_sd_deg": 3.0}), 4
    )  # fmt: skip
    made = step(chain_of_fix(result, 0), "Fix 0")
    turn = made.facts["ASV0_misalignment_deg"]
    assert made.facts["error_m"] == pytest.approx(20.0 * abs(np.radians(turn)), rel=0.01)
    assert f"headings misaligned (deg): ASV0 {turn:+.2f}" in made.why
    everything = {
        "usbl": {**QUIET_USBL, "gnss_correlated_sd_m": 1.0, "array": "cross5"},
        "environment": {"assumed_sound_speed_m_per_s": 1470.0},
        "navigation": {**QUIET_NAVIGATION, "clock_offset_sd_s": 1e-3},
    }
    made = step(chain_of_fix(simulate(around((0.0, 0.0), **everything), 4), 0), "Fix 0")
    slant = np.hypot(20.0, 10.0)
    longer = slant * (1470.0 / 1500.0 - 1.0) + made.facts["clock_late_s"] * 1470.0
    off = np.array(
        [made.facts["ASV0_gnss_x_m"] + longer * 20.0 / slant, made.facts["ASV0_gnss_y_m"]]
    )
    assert made.facts["error_m"] == pytest.approx(np.hypot(*off), abs=0.02)
    assert (
        "ranges 2.04 % too short: sound is assumed to travel at 1470, not at 1500 m/s" in made.why
    )


def test_a_modem_hands_a_fix_over_later() -> None:
    """The airtime of the table is told, and the parts of the latency with the delay add up."""
    mf = {"modem": "s2c_instant", "payload_bytes": 24}
    result = simulate(around((0.0, 0.0), (1.0, 0.0), auvs=2, acoustics={"mf": mf}))
    fix = result.tables["fixes"].iloc[1]
    chain = chain_of_fix(result, 1)
    sending = next(
        it for it in chain.steps if it.who == fix.broadcast_by and "broadcasts" in it.what
    )
    assert "24 B by the table of airtimes of s2c_instant = 0.4179 s on the air" in sending.why
    assert "frame 0 is that of ASV 0 mod 2 = 0" in sending.why
    parts = {part.name: part.duration_s for part in chain.parts}
    assert parts["modem hands it over"] == 0.08861
    assert sum(parts.values()) == pytest.approx(fix.latency_s)


def test_what_waited_for_older_fixes_says_so() -> None:
    """A fix that its round's message did not hold."""
    mf = {"modem": "s2c_instant", "payload_bytes": 24, "overfull": "oldest_first"}
    result = simulate(around((0.0, 0.0), auvs=2, acoustics={"mf": mf}))
    told = "\n".join(it.why for it in chain_of_fix(result, 1).steps)
    assert "sequential: older fixes filled the messages before, of 1 each" in told


def test_a_fix_made_after_its_round_waits_for_the_next_frame() -> None:
    """Several ASVs call side by side; a ping passes the last of them after the frame has left."""
    protocol = {"schedule": {"model": "polling", "side_by_side": True}, "ranging": "twtt"}
    data = {"name": "side", "duration_s": 20, "survey": {"side_m": 200}, "protocol": protocol}
    run = simulate(Scenario.model_validate({**data, "auvs": {"count": 6}, "asvs": {"count": 4}}), 7)
    told = [
        "\n".join(it.why for it in chain_of_fix(run, fix).steps)
        for fix in run.tables["fixes"].query("outcome == 'delivered'").index.tolist()
    ]
    assert sum("had ended before the fix was made" in it for it in told) > 1
    assert not any("None" in it for it in told)


def test_a_slot_reckoned_is_told_beside_the_one_begun_last() -> None:
    """Of whom it is, whether they knew it or not."""
    protocol = {"knowledge": {"model": "broadcast", "missed": "last_slot"}}
    data = {"name": "told", "duration_s": 20, "auvs": {"count": 6}, "protocol": protocol}
    run = simulate(Scenario.model_validate({**data, "acoustics": {"mf": {"range_m": 60}}}), 7)
    assigned, found = run.tables["assignments"], 0
    for ping in run.tables["pings"].itertuples():
        text = chain_of_ping(run, ping.ping).text()
        if said := re.search(r"that\s+is\s+slot\s+\d+\s+of\s+round\s+(\d+)\s+by\s+now", text):
            begun = assigned[assigned.starts_at_s <= ping.sent_at_s]
            assert int(said[1]) == begun["round"].max(), text
            found += 1
    assert found > 10


def test_no_error_changes_by_more_than_its_estimate_was_moved() -> None:
    """A filter that has just learnt a bias goes on otherwise than later, by which errors right
    after a fix were told that no correction makes.
    """
    result = simulate(load_scenario("harbour_current", overrides=["duration_s=30"]), 3)
    told = 0
    for fix in result.tables["fixes"].query("outcome == 'delivered'").itertuples():
        before, after = errors_around(result, fix)
        if before is not None and after is not None:
            moved = 0.0 if math.isnan(fix.correction_m) else fix.correction_m
            assert abs(after - before) <= moved + 1e-3
            told += 1
    assert told > 10
