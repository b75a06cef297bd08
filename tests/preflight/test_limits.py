"""Limits of scenarios whose geometry is simple enough for sums by hand."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from numpy.typing import NDArray
from predicted_for_tests import inputs_of, predict
from worlds import merged

import bindusbl_des
from bindusbl_des import Scenario, Setup, load_scenario, simulate, warnings_of
from bindusbl_des.apps.preflight.bounds import fewest_groups
from bindusbl_des.apps.preflight.limits import instants
from bindusbl_des.apps.preflight.round_lengths import carried_per_s
from bindusbl_des.core.protocol.conflicts import GROUPINGS
from bindusbl_des.core.protocol.cycles import cycle

# Two ASVs 200 m apart, which hear 50 m: two AUVs below the one, one below the other, one too far.
PLACES = [[0.0, 0.0], [10.0, 0.0], [200.0, 0.0], [100.0, 0.0]]
STATIONS = [[0.0, 0.0], [200.0, 0.0]]


def scenario(**changes: dict[str, Any]) -> Scenario:
    data: dict[str, dict[str, Any]] = {
        "survey": {"side_m": 500, "depth_m": 30.0},
        "auvs": {"count": 4, "route": {"kind": "hold", "positions_m": PLACES}},
        "asvs": {"count": 2, "formation": {"positions_m": STATIONS}},
    }
    for section, values in changes.items():
        data[section] = {**data.get(section, {}), **values}
    return Scenario.model_validate({"name": "limits", "duration_s": 100.0, **data})


def rates_flown(asked: Scenario, missions: int) -> NDArray[np.float64]:
    """Return the fixes per second that each AUV gets in missions, which keep nothing else."""
    record = asked.record.model_copy(update={"detail": "summary", "metrics_hz": 0.5})
    short = asked.model_copy(update={"record": record})
    return np.array([simulate(short, seed).auvs.fix_rate_hz for seed in range(missions)])


def limits(**changes: dict[str, Any]) -> Any:
    return bindusbl_des.limits(scenario(**changes))


def test_rounds_of_many_lengths_are_asked_for_some(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 60 AUVs rounds have 47 numbers of groups: 17 of them are run, the others lie between."""
    crowd = Scenario.model_validate(
        {"name": "crowd", "duration_s": 100.0, "auvs": {"count": 60}, "asvs": {"count": 2}}
    )
    asked: list[tuple[Any, ...]] = []

    def noted(*round_: Any) -> Any:
        asked.append(round_)
        return cycle(*round_)

    monkeypatch.setattr("bindusbl_des.apps.preflight.limits.cycle", noted)
    some = bindusbl_des.limits(crowd)
    assert len(asked) == len({*asked}) <= 2 * 17 * 17
    monkeypatch.setattr("bindusbl_des.apps.preflight.limits.MOST_LENGTHS", 10_000)
    every = bindusbl_des.limits(crowd)
    assert len(asked) > 4 * 17 * 17
    for name, rates in every.rates.items():
        assert some.rates[name].mean == pytest.approx(rates.mean, rel=2e-3), name
        assert some.rates[name].lowest == pytest.approx(rates.lowest, rel=2e-3), name


def test_large_fleets_are_looked_at_seldom_and_their_groups_bounded_without_pairs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A hundred thousand AUVs are, at one instant; no pairs of AUVs are compared."""
    looks = [
        len(
            instants(
                Scenario.model_validate(
                    {"name": "many", "duration_s": 60, "auvs": {"count": count}}
                )
            )
        )
        for count in (1000, 3000, 100_000)
    ]
    assert looks == [121, 13, 1]
    heard = np.random.default_rng(1).random((200, 3)) < 0.2
    low, high = fewest_groups(heard)
    monkeypatch.setattr("bindusbl_des.apps.preflight.bounds.MOST_BY_DSATUR", 100)
    monkeypatch.setitem(GROUPINGS, "saturation", None)
    assert fewest_groups(heard)[0] == low
    assert fewest_groups(heard)[1] >= high


def test_rounds_of_a_fleet_that_holds() -> None:
    """Two slots of 2.5 t_C and a downlink slot of 10 t_C, t_C = 1/3 s: 5 s for three fixes.

    The ASVs broadcast in turn, and each AUV is in MF range of one of them.
    """
    found = limits()
    assert found.in_range.tolist() == [1.0, 1.0, 1.0, 0.0]
    assert found.groups is not None
    assert (found.groups.made, found.groups.fewest, found.groups.clique) == (2.0, (2.0, 2.0), 2.0)
    assert (found.groups.most_heard, found.groups.reuse) == (2.0, 1.5)
    assert found.rates["planned"].each == pytest.approx([0.1, 0.1, 0.1, 0.0])
    assert (found.rates["planned"].worst, found.rates["planned"].lowest) == (3, 0.0)
    assert found.rates["pipelined_round"].mean == pytest.approx(0.75 * 0.15)
    assert found.rates["back_to_back"].mean == pytest.approx(0.75 / 0.448)


def test_medium_of_a_fleet_that_holds() -> None:
    """Nearest ASVs are 30, 31.6 and 30 m away; a frame of one fix takes 0.192 s."""
    found = limits(acoustics={"hf": {"ping_s": 0.02}})
    assert (found.decodes_hz, found.cleared_hz) == pytest.approx((50.0, 25.0))
    assert found.records_hz == pytest.approx(4 / 0.576)
    assert found.latency_s == pytest.approx(0.192 + 2 * 30.54 / 1500, abs=1e-4)
    assert found.senders == 1


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"downlink": "pipelined_group"}, {"planned", "sequential", "pipelined_round"}),
        ({"downlink": "pipelined_round"}, {"planned", "sequential"}),
        ({"schedule": "round_robin"}, {"planned"}),
    ],
)
def test_own_rounds_stand_beside_others(changes: dict[str, Any], names: set[str]) -> None:
    assert set(limits(protocol=changes).rates) == names | {"back_to_back"}


def test_one_auv_a_frame() -> None:
    """An AUV in range pings once in four frames of 6 s, and hears every other broadcast; if ASVs
    send in turn, those of AUV0 and AUV2 are all by ASV0.
    """
    frames = {"schedule": "round_robin", "frame_s": 6.0}
    found = limits(protocol={**frames, "broadcaster": "random"})
    assert found.rates["planned"].each == pytest.approx([1 / 48, 1 / 48, 1 / 48, 0.0])
    in_turn = scenario(protocol=frames)
    assert bindusbl_des.limits(in_turn).rates["planned"].each == pytest.approx([1 / 24, 0, 0, 0])
    assert simulate(in_turn, 0).auvs.fixes_delivered.tolist() == [5, 0, 0, 0]


def test_answers_are_frames_of_one_record() -> None:
    """An answer of 24 B takes 0.192 s, its guard 1.25 t_C: slots are so much longer, and an ASV
    answers 1 / 0.192 s times a second at most.
    """
    found = limits(protocol={"downlink": "direct_reply"})
    assert found.records_hz == pytest.approx(1 / 0.192)
    slot = 2.5 / 3 + 0.192 + 1.25 / 3
    assert found.rates["planned"].each[0] == pytest.approx(1 / (2 * slot))
    assert found.latency_s == pytest.approx(0.202 + 2 * 30.54 / 1500, abs=1e-4)


OLDEST = {"overfull": "oldest_first"}
ALOHA = {"schedule": "aloha", "frame_s": 6.0}


@pytest.mark.parametrize(
    ("size", "mf", "protocol", "records_hz", "words"),
    [
        (None, {}, {}, 4 / 0.32, "2 a frame, 2 ASVs at once"),
        (40, {}, {}, 4 / 0.32, "2 a frame, 2 ASVs at once"),
        (24, {}, {}, 2 / 0.192, "1 a frame, 2 ASVs at once"),
        (40, OLDEST, {}, 2 / 0.192, "1 a frame, 2 ASVs at once"),
        (40, {}, {"broadcaster": "rotate"}, 2 / 0.32, "2 a frame"),
        (40, {}, {"downlink": "direct_reply"}, 2 / 0.192, "1 a frame, 2 ASVs at once"),
        (40, {}, {"broadcaster": "rotate", **ALOHA}, 2 / 0.32, "2 a frame"),
        (40, OLDEST, ALOHA, 2 / 0.192, "1 a frame, 2 ASVs at once"),
    ],
)
def test_records_are_those_of_the_frames_that_are_told(
    size: int | None, mf: dict[str, Any], protocol: dict[str, Any], records_hz: float, words: str
) -> None:
    """Four AUVs, of which none hears two ASVs; a message of 40 B holds two fixes: `split` sends
    further ones behind it, of the oldest two each ASV sends its own.
    """
    found = limits(
        acoustics={"mf": {"range_m": 20.0, "payload_bytes": size, **mf}},
        protocol={"broadcaster": "parallel", **protocol},
    )
    assert found.records_hz == pytest.approx(records_hz)
    assert found.frames == words
    assert 3 * found.rates["back_to_back"].each[0] <= records_hz * (1 + 1e-12)


def test_asvs_at_once_share_what_one_message_holds() -> None:
    """Two of the three fixes of a round, by one ASV or each by its own; the third waits."""
    asked = scenario(
        acoustics={"mf": {"range_m": 20.0, "payload_bytes": 40, **OLDEST}},
        protocol={"broadcaster": "parallel", "schedule": "one_per_slot"},
    )
    sent = simulate(asked, 0).tables["broadcasts"].groupby("sent_at_s").fixes.agg(tuple)
    assert set(sent) == {(2,), (1, 1)}
    assert carried_per_s(Setup(asked)) == pytest.approx(2 / Setup(asked).slots.downlink_slot(1))


def test_instant_answers_need_no_records() -> None:
    """One takes ping and way; a round is its two uplink slots."""
    found = limits(protocol={"downlink": {"model": "direct_reply", "reply": "instant"}})
    assert found.records_hz is None
    assert set(found.rates) == {"planned"}
    assert found.rates["planned"].each[0] == pytest.approx(1 / (2 * 2.5 / 3))
    assert found.latency_s == pytest.approx(0.010 + 2 * 30.54 / 1500, abs=1e-4)


def test_passive_auvs_are_fixed_by_each_asv_in_range() -> None:
    """Two slots in turn, of which each AUV hears one."""
    found = limits(protocol={"ranging": "passive"})
    assert (found.groups, found.records_hz) == (None, None)
    assert found.rates["planned"].each == pytest.approx([0.6, 0.6, 0.6, 0.0])
    assert found.latency_s == pytest.approx(0.010 + 30.54 / 1500, abs=1e-4)


def test_an_asv_that_fails_hears_nobody() -> None:
    """ASV0 works for the first quarter of the mission, within half of one of 121 looks."""
    found = limits(asvs={"failures": [{"asv": 0, "at_s": 25.0}]})
    assert found.in_range == pytest.approx([0.25, 0.25, 1.0, 0.0], abs=0.5 / 121)


def timing(data: dict[str, Any], *options: str) -> str:
    Path("m.yaml").write_text(json.dumps(data))
    return call("timing", "m.yaml", *options).stdout


@pytest.mark.usefixtures("in_empty_folder")
def test_timing_tells_limits_and_has_them_as_data() -> None:
    mission = scenario().model_dump(mode="json")
    text, data = timing(mission), json.loads(timing(mission, "--json"))
    assert "in HF range               75.0 % of the time, AUV3 0.0 %" in text
    assert "slots for all, at least   2.00: chromatic number (clique 2.00, one ASV" in text
    assert ["these", "rounds", "0.075", "0.000", "(AUV3)", "4", "%"] in map(
        str.split, text.split("\n")
    )
    assert "rounds with one frame" not in text
    parallel = timing(mission, "--set", "protocol.broadcaster=parallel")
    assert "Rounds are taken to have one frame" in parallel
    assert data["limits"]["groups"]["fewest"] == [2.0, 2.0]
    assert data["limits"]["fix_rates_hz"]["planned"] == pytest.approx([0.1, 0.1, 0.1, 0.0])


@pytest.mark.usefixtures("in_empty_folder")
def test_limits_of_a_plug_in_that_is_not_loaded_are_not_guessed() -> None:
    """Where AUVs go only their own route knows."""
    mission = scenario().model_dump(mode="json")
    mission["auvs"]["route"] = {"kind": "somebodys:route"}
    assert "which only the plug-in knows" in timing(mission)
    assert json.loads(timing(mission, "--json"))["limits"] is None


def test_losses_by_range_are_counted() -> None:
    """Over 282 m the OEM head decodes half the pings: half as many fixes, in shorter frames."""
    one = {
        "auvs": {"count": 1, "route": {"kind": "hold", "positions_m": [[280.35, 0.0]]}},
        "asvs": {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
        "survey": {"side_m": 600},
    }
    far = {"hf": {"range_m": 300.0}, "mf": {"range_m": 600.0}}
    whole = limits(**one, acoustics={**far, "loss": {"law": "scaled"}})
    half = limits(**one, acoustics={**far, "loss": {"law": "head"}})
    assert (whole.in_range.tolist(), whole.fix_chance.tolist()) == ([1.0], [1.0])
    assert half.in_range.tolist() == [1.0]
    assert half.fix_chance == pytest.approx([0.5], abs=1e-3)
    for name in ("planned", "pipelined_round"):
        assert half.rates[name].mean == pytest.approx(0.5 * whole.rates[name].mean, rel=2e-3)


def test_frames_that_are_lost_are_counted() -> None:
    """A sonar's frames of one fix are decoded by half over the MF range."""
    one = {
        "auvs": {"count": 1, "route": {"kind": "hold", "positions_m": [[95.4, 0.0]]}},
        "asvs": {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
    }
    found = limits(**one, acoustics={"hf": {"range_m": 200}, "mf": {"channel": "sonar"}})
    assert found.fix_chance == pytest.approx([0.5], abs=1e-3)


def test_each_auv_is_heard_from_its_own_depth(tmp_path: Path) -> None:
    """A curve knows slant ranges alone: 50 m of one 30 m deep, 10 m of one 10 m deep."""
    (tmp_path / "c.csv").write_text("range_m,delivery_ratio\n0,1\n100,0\n")
    found = limits(
        survey={"depths_m": [30.0, 10.0, 90.0]},
        auvs={"count": 3, "route": {"kind": "hold", "positions_m": [[40, 0], [0, 0], [0, 0]]}},
        asvs={"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
        acoustics={
            "hf": {"range_m": 95, "channel": {"model": "curve", "file": str(tmp_path / "c.csv")}}
        },
    )
    assert found.fix_chance == pytest.approx([0.5, 0.9, 0.1], abs=1e-3)


FAILING = {"failures": [{"asv": 1, "at_s": 100.0}]}


@pytest.mark.parametrize(
    "changes",
    [
        {"protocol": {"broadcaster": "most_fixes"}},
        {"protocol": {"broadcaster": "nearest"}},
        {
            "protocol": {
                "broadcaster": "nearest",
                "schedule": "one_per_slot",
                "downlink": "pipelined_group",
            }
        },
        {"acoustics": {"mf": {"modem": "s2c_instant", "range_m": 600, "overfull": "oldest_first"}}},
        {"asvs": FAILING},
        {"asvs": FAILING, "protocol": {"ranging": "passive"}},
        {"asvs": FAILING, "protocol": {"broadcaster": {"model": "fixed", "asv": 1}}},
        {"asvs": FAILING, "protocol": {"broadcaster": "parallel"}},
        {"asvs": FAILING, "protocol": {"broadcaster": "nearest", "schedule": "round_robin"}},
    ],
    ids=[
        "most_fixes",
        "nearest",
        "a frame each",
        "oldest_first",
        "rotate",
        "passive",
        "fixed",
        "parallel",
        "framed",
    ],
)
def test_rates_are_those_of_missions(changes: dict[str, Any]) -> None:
    """One ASV sends the frame of all, by what it has measured or is near to; and fixes that find no
    place in a frame come late or never.  Those that work take the turn of one that has failed.
    """
    base: dict[str, Any] = {
        "duration_s": 300.0,
        "survey": {"side_m": 300},
        "auvs": {"count": 6},
        "asvs": {"count": 4},
        "acoustics": {"hf": {"range_m": 110}, "mf": {"range_m": 110}, "loss": {"law": "none"}},
        "protocol": {"downlink": "pipelined_round"},
    }
    scenario = Scenario.model_validate({"name": "m", **merged(base, changes)})
    rates = bindusbl_des.limits(scenario).rates["planned"]
    flown = simulate(scenario, 1).auvs.fix_rate_hz
    assert rates.mean == pytest.approx(flown.mean(), rel=0.1)
    assert rates.each == pytest.approx(
        flown.to_numpy(), abs=0.45 * flown.mean()
    )  # the oldest first


# Three ASVs in a row, of which the outer ones reach half of the survey each.
ROW: dict[str, Any] = {
    "duration_s": 300.0,
    "survey": {"side_m": 140},
    "auvs": {"count": 3},
    "asvs": {"count": 3, "formation": {"positions_m": [[0, 60], [0, 0], [0, -60]]}},
    "acoustics": {"hf": {"range_m": 100}, "mf": {"range_m": 70}, "loss": {"law": "none"}},
    "protocol": {"schedule": "one_per_slot", "downlink": "pipelined_group"},
}
FOUR = {"count": 4, "formation": {"positions_m": [[0, 60], [0, 0], [0, -60], [60, 0]]}}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"protocol": {"schedule": "round_robin", "downlink": "sequential"}},
        {
            "protocol": {"schedule": "spatial_reuse"},
            "auvs": {"count": 6},
            "acoustics": {"hf": {"range_m": 200}},
        },
        {"protocol": {"schedule": "dsatur"}, "auvs": {"count": 4}},
        {"auvs": {"count": 6}, "asvs": FOUR},
        {"auvs": {"count": 4}, "asvs": {**FOUR, "failures": [{"asv": 1, "at_s": 150.0}]}},
        {"protocol": {"broadcaster": "random"}},
    ],
    ids=["a slot each", "framed", "groups", "out of step", "every other", "failing", "by lot"],
)
def test_asvs_that_keep_in_step_with_auvs_send_for_the_same_ones(changes: dict[str, Any]) -> None:
    """Of k ASVs in turn only those at j + N i mod k send for AUV j of N, of those that work."""
    asked = Scenario.model_validate({"name": "m", **merged(ROW, changes)})
    told = bindusbl_des.limits(asked).rates["planned"].each
    flown = rates_flown(asked, 3).mean(axis=0)
    assert told == pytest.approx(flown, abs=0.02)
    if not asked.asvs.failures:  # which plans leave out
        planned = predict(inputs_of(Setup(asked)), Setup(asked).stations_m).fix_rate_hz
        assert planned == pytest.approx(flown, abs=0.02)


SLOW, AHOI = {"bit_rate_bps": 200}, {"modem": "ahoi", "channel": "disc", "range_m": 200}


@pytest.mark.parametrize(
    ("auvs", "asvs", "heard", "mf", "protocol"),
    [
        (1, 1, 0.3, AHOI, {}),
        (1, 1, 0.8, AHOI, {}),
        (2, 1, 0.3, AHOI, {}),
        (3, 2, 0.3, SLOW, {"downlink": "pipelined_round"}),
        (2, 2, 0.8, SLOW, {"downlink": "pipelined_round"}),
        (4, 1, 0.5, SLOW, {"downlink": "pipelined_group"}),
        (2, 1, 0.3, SLOW, {"schedule": "round_robin", "frame_s": 1.5}),
        (1, 2, 0.3, {}, {"schedule": "aloha", "frame_s": 0.1}),
    ],
)
def test_no_mission_exceeds_frame_behind_frame(
    auvs: int, asvs: int, heard: float, mf: dict[str, Any], protocol: dict[str, Any], tmp_path: Path
) -> None:
    """However many fixes a broadcast holds; and rounds are as long as such broadcasts make them."""
    (tmp_path / "c.csv").write_text(f"range_m,delivery_ratio\n0,{heard}\n400,{heard}\n")
    curve = {"model": "curve", "file": str(tmp_path / "c.csv")}
    asked = scenario(
        survey={"side_m": 80},
        auvs={"count": auvs, "route": {"kind": "hold", "positions_m": [[9.0, 0.0]] * auvs}},
        asvs={"count": asvs, "formation": {"positions_m": [[-30.0, 0.0], [30.0, 5.0]][:asvs]}},
        acoustics={"hf": {"range_m": 100, "channel": curve}, "mf": mf},
        protocol=protocol,
    ).model_copy(update={"duration_s": 400.0})
    rates = bindusbl_des.limits(asked).rates
    flown = rates_flown(asked, 6).mean(axis=1)
    sure = 3.0 * flown.std() / np.sqrt(len(flown))
    assert flown.mean() - sure <= rates["back_to_back"].mean
    assert max(found.mean for found in rates.values()) == rates["back_to_back"].mean
    if "planned" in rates:
        assert rates["planned"].mean == pytest.approx(flown.mean(), abs=sure + 0.01 * flown.mean())


HOLD = {"count": 2, "route": {"kind": "hold", "positions_m": [[-26.26, -23.4], [51.9, 53.6]]}}
APART = {"count": 3, "route": {"kind": "hold", "positions_m": [[-60, 0], [0, 0], [60, 0]]}}
BESIDE = {"count": 3, "formation": {"positions_m": [[-60, 20], [0, 20], [60, 20]]}}


@pytest.mark.parametrize(
    ("auvs", "asvs", "protocol"),
    [
        (HOLD, {"formation": {"radius_m": 40.0}}, {"broadcaster": "nearest"}),
        (HOLD, {"formation": {"radius_m": 40.0}}, {"broadcaster": "most_fixes"}),
        (HOLD, {"count": 2, "formation": {"radius_m": 40.0}}, {"schedule": "one_per_slot"}),
        (APART, BESIDE, {"knowledge": "broadcast"}),
        (APART, BESIDE, {"knowledge": "broadcast", "broadcaster": "random"}),
    ],
    ids=["nearest", "most fixes", "in step", "told by the one, fixed by the other", "by lot"],
)
def test_each_downlink_is_judged_by_who_sends_its_frames(
    auvs: dict[str, Any], asvs: dict[str, Any], protocol: dict[str, Any]
) -> None:
    """Each row of the table is what missions with that downlink have."""
    downlinks = ["sequential", "pipelined_round"]
    if "knowledge" not in protocol:
        downlinks.append("pipelined_group")

    def asked(downlink: str) -> Scenario:
        return Scenario.model_validate({
            "name": "rows", "duration_s": 400.0, "survey": {"side_m": 140.0}, "auvs": auvs,
            "acoustics": {"hf": {"range_m": 120}, "mf": {"range_m": 60}, "loss": {"law": "none"}},
            "asvs": {"count": 3, **asvs}, "protocol": {**protocol, "downlink": downlink},
        })  # fmt: skip

    flown = {name: rates_flown(asked(name), 3).mean(axis=0) for name in downlinks}
    for own in downlinks:
        rates = bindusbl_des.limits(asked(own)).rates
        for name in {own, "sequential", "pipelined_round"}:
            told = rates["planned" if name == own else name].each
            assert told == pytest.approx(flown[name], rel=0.15, abs=0.01), (own, name)


@pytest.mark.parametrize("reach", [60.0, 200.0])
def test_the_first_asv_that_hears_a_ping_replies(reach: float, tmp_path: Path) -> None:
    """The nearest misses half of the pings, which the next answers, in reach or not."""
    (tmp_path / "c.csv").write_text("range_m,delivery_ratio\n0,0.5\n400,0.5\n")
    curve = {"model": "curve", "file": str(tmp_path / "c.csv")}
    places = [[-50.0, 5.0], [0.0, 0.0], [45.0, -20.0]]
    asked = scenario(
        auvs={"count": 3, "route": {"kind": "hold", "positions_m": places}},
        asvs={"count": 2, "formation": {"positions_m": [[-30.0, 0.0], [40.0, 0.0]]}},
        acoustics={"hf": {"range_m": 200, "channel": curve}, "mf": {"range_m": reach}},
        protocol={"schedule": "one_per_slot", "downlink": "direct_reply"},
    ).model_copy(update={"duration_s": 300.0})
    told = bindusbl_des.limits(asked).rates["planned"].each
    predicted = predict(inputs_of(Setup(asked)), Setup(asked).stations_m).fix_rate_hz
    flown = rates_flown(asked, 16).mean(axis=0)
    assert told == pytest.approx(flown, rel=0.06)
    assert predicted == pytest.approx(flown, rel=0.06)


def test_an_asv_that_fails_brings_no_more_fixes(tmp_path: Path) -> None:
    """Fewer pings are heard: of as many frames each AUV still has its share."""
    (tmp_path / "c.csv").write_text("range_m,delivery_ratio\n0,0.9\n40,0.7\n120,0.4\n")
    curve = {"model": "curve", "file": str(tmp_path / "c.csv")}
    asked: dict[str, Any] = {
        "name": "m",
        "survey": {"side_m": 80},
        "auvs": {"count": 3},
        "asvs": {"count": 2, "formation": {"positions_m": [[-30, 0], [30, 5]]}},
        "acoustics": {"hf": {"range_m": 100, "channel": curve}, "mf": {"channel": curve}},
    }
    fails = merged(asked, {"asvs": {"failures": [{"asv": 0, "at_s": 100.0}]}})
    both, one = (bindusbl_des.limits(Scenario.model_validate(keys)) for keys in (asked, fails))
    assert (one.rates["back_to_back"].each <= both.rates["back_to_back"].each).all()


@pytest.mark.parametrize(
    ("downlink", "failing"), [("sequential", [1]), ("pipelined_round", [1, 2])]
)
def test_an_asv_that_has_failed_tells_no_slots(downlink: str, failing: list[int]) -> None:
    """Those that work take turns: of three two, or one alone, reach all, and nothing is missed."""
    asked = Scenario.model_validate({
        "name": "rows", "duration_s": 400.0, "survey": {"side_m": 60.0},
        "auvs": {"count": 2, "route": {"kind": "hold", "positions_m": [[-20, 0], [20, 0]]}},
        "acoustics": {"hf": {"range_m": 120}, "mf": {"range_m": 100}, "loss": {"law": "none"}},
        "asvs": {
            "count": 3, "formation": {"positions_m": [[-20, 10], [0, 10], [20, 10]]},
            "failures": [{"asv": asv, "at_s": 0.0} for asv in failing],
        },
        "protocol": {"knowledge": "broadcast", "downlink": downlink},
    })  # fmt: skip
    flown = rates_flown(asked, 3).mean(axis=0)
    assert bindusbl_des.limits(asked).rates["planned"].each == pytest.approx(flown, rel=0.03)
    assert not [found for found in warnings_of(asked) if "hardly ever fixed" in found.message]


def test_frames_behind_frames_carry_no_more_than_the_downlink() -> None:
    """However few AUVs ping because few are told of their slots."""
    asked = load_scenario("recovery_140m", overrides=["protocol.knowledge=broadcast"])
    found = bindusbl_des.limits(asked)
    assert found.records_hz is not None
    assert found.rates["back_to_back"].each.sum() <= found.records_hz * (1 + 1e-9)


@pytest.mark.usefixtures("in_empty_folder")
def test_timing_says_what_its_rates_leave_out() -> None:
    """That who sends is deaf, and that answers meet."""
    mission = {"name": "m", "auvs": {"count": 3}, "asvs": {"count": 2}}
    assert "are taken" not in timing(mission)
    deaf = timing(mission, "--set", "protocol.duplex=per_node")
    assert "taken to hear while they send" in " ".join(deaf.split())
    assert "taken not to meet" in timing(mission, "--set", "protocol.downlink=direct_reply")
