"""Benchmarks measure what they say; nothing here asserts how fast anything is."""

import json
import math
import re
import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import call

import bindusbl_des
from bindusbl_des import Scenario, Setup, covered_area, covering_radius, formation, simulate
from bindusbl_des.benchmarks import command_lines
from bindusbl_des.benchmarks.missions import patch_lanes, spread, standard_missions
from bindusbl_des.benchmarks.timing import elsewhere, of_length, part_of_file, profiled, shares

OTHER = "other"
ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "benchmarks" / "peers")]  # programs
ns3_uan, traffic = import_module("ns3_uan"), import_module("traffic")

MISSIONS = standard_missions()
MEASURED = {
    "auvs", "asvs", "vehicle", "duration_s", "mission_ms", "new_configuration_ms", "writing_ms",
    "events", "events_per_s", "sim_seconds_per_s", "us_per_auv_second", "peak_memory_mb", "shares",
}  # fmt: skip


def test_the_standard_fleets_are_there_with_and_without_dynamics() -> None:
    """Each fleet has a kinematic mission, and up to a thousand AUVs one with six degrees of
    freedom, all of 300 s.
    """
    fleets = [tuple(map(int, re.findall(r"\d+", name))) for name in MISSIONS if "kin" in name]
    assert {(3, 1), (3, 3), (1000, 50), (10000, 200)} <= set(fleets)
    for auvs, asvs in fleets:
        for vehicle in ("kinematic", "bluerov2")[: 2 if auvs <= 1000 else 1]:
            mission = MISSIONS[f"({auvs},{asvs}) {vehicle}"]
            assert (mission.auvs.count, mission.asvs.count) == (auvs, asvs)
            assert mission.duration_s == 300.0
            assert mission.auvs.vehicle.has_dynamics == (vehicle == "bluerov2")


def test_large_fleets_are_as_dense_and_as_covered_as_ten_under_three() -> None:
    """Water per AUV is that of ten AUVs in the paper's square, coverage within an eighth of it."""
    small = MISSIONS["(10,3) kinematic"]

    def covered(mission: Scenario) -> float:
        reach = mission.acoustics.hf.range_m
        return covered_area(mission.survey.side_m, Setup(mission).stations_m, reach)

    for name in ("(100,10) kinematic", "(1000,50) kinematic", "(10000,200) kinematic"):
        mission = MISSIONS[name]
        assert mission.survey.side_m**2 / mission.auvs.count == pytest.approx(140**2 / 10)
        assert covered(mission) == pytest.approx(covered(small), abs=0.125)


def test_patches_lie_in_the_square_and_apart() -> None:
    """Every AUV of a large fleet sweeps water that is in the survey and no other's."""
    side = 443.0
    lanes = list(patch_lanes(100, side))
    assert all(max(abs(x), abs(y)) < side / 2 for lane in lanes for x, y in lane)
    steps = {round(math.dist(*leg), 6) for lane in lanes for leg in pairwise(lane)}
    assert steps == {10.0, 30.0}
    boxes = [(min(p), max(p)) for p in lanes]
    centres = list(spread(100, side))
    assert len(set(centres)) == 100
    for (low, high), (x, y) in zip(boxes, centres, strict=True):
        assert (low[0] + high[0]) / 2 == pytest.approx(x)
        assert abs(low[1] - y) == pytest.approx(15.0)


def test_a_large_fleet_has_conflicts_to_colour() -> None:
    """In the large missions some AUVs share ASVs and some do not: neither 1 nor N colours."""
    rounds = simulate(of_length(MISSIONS["(100,10) kinematic"], 2.0), seed=0).tables["rounds"]
    assert 5 < rounds.colours[0] < 30
    assert rounds.conflicts[0] > 100


@pytest.mark.slow
def test_ten_thousand_auvs_are_served_in_rounds() -> None:
    """By the end of its first round nearly all AUVs have a fix, from ASVs that answered at once."""
    mission = of_length(MISSIONS["(10000,200) kinematic"], 80.0)
    assert mission.protocol.broadcaster == "parallel"
    result = simulate(mission, seed=0)
    assert (result.auvs.fixes_delivered > 0).mean() > 0.9
    assert result.tables["mission"].rounds[0] == 2


def test_the_largest_missions_are_measured_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of ten thousand AUVs nobody hears who does not ask for that fleet."""
    measured: list[list[str]] = []

    def note(names: list[str], **_: Any) -> None:
        measured.append(names)
        raise RuntimeError("asked for enough")

    monkeypatch.setattr("bindusbl_des.benchmarks.bench.bench", note)
    for words in ([], ["--only", "kinematic"], ["--only", "(10000,200)"]):
        call("-q", "bench", *words, catch_exceptions=True)
    largest = "(10000,200) kinematic"
    assert [largest in names for names in measured] == [False, False, True]


WORDS = ["-q", "bench", "--quick", "--only", "(3,1) kinematic"]


@pytest.fixture(scope="module")
def printed() -> str:
    """What `bench --json` has measured and printed."""
    return call(*WORDS, "--json").stdout


def test_bench_prints_every_number_as_json(printed: str) -> None:
    """`bench --json` has each mission's times, rates, memory, and shares that add up to 1."""
    found = json.loads(printed)
    assert list(found["missions"]) == ["(3,1) kinematic"]
    row = found["missions"]["(3,1) kinematic"]
    assert set(row) == MEASURED
    assert {"vehicles", "mission", "USBL", "writing", OTHER} <= set(row["shares"])
    assert sum(row["shares"].values()) == pytest.approx(1.0)
    assert min(row["shares"].values()) >= 0.0
    assert row["mission_ms"]["min"] <= row["mission_ms"]["median"] <= row["mission_ms"]["max"]
    assert row["events_per_s"] == pytest.approx(
        1e3 * row["events"] / row["mission_ms"]["processor"]
    )
    assert row["peak_memory_mb"] > 50
    assert found["machine"]["cores"] >= 1


def test_bench_prints_a_table(printed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without --json the same numbers come as a table, with the shares below."""
    monkeypatch.setattr("bindusbl_des.benchmarks.bench.bench", lambda *_, **__: json.loads(printed))
    outcome = call(*WORDS)
    assert outcome.exit_code == 0
    assert re.search(r"^\(3,1\) kinematic +[0-9.]+ ", outcome.stdout, re.MULTILINE)
    assert "share of time, %" in outcome.stdout


def test_who_made_a_mission_slower_is_named(
    printed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last record of the same kind of machine is compared with, not that of another."""
    now = json.loads(printed)

    def times(factor: float, **machine: Any) -> dict[str, Any]:
        it = json.loads(printed)
        it["machine"] |= machine
        for row in it["missions"].values():
            row["mission_ms"]["processor"] *= factor
        return it

    records = {"old": times(9.0), "last": times(0.8), "elsewhere": times(7.0, cores=999)}
    (tmp_path / "history.json").write_text(json.dumps(records))
    monkeypatch.setattr("bindusbl_des.benchmarks.bench.bench", lambda *_, **__: now)
    told = call(*WORDS, "--against", tmp_path / "history.json").stdout
    assert re.search(r"^\(3,1\) kinematic +mission +1\.25 .*SLOWER$", told, re.MULTILINE)
    (tmp_path / "one.json").write_text(printed)
    told = call(*WORDS, "--against", tmp_path / "one.json").stdout
    assert re.search(r"^\(3,1\) kinematic +mission +1\.00 .*was [0-9.]+\)$", told, re.MULTILINE)
    (tmp_path / "one.json").write_text(json.dumps(times(1.0, processor="abacus")))
    told = call(*WORDS, "--against", tmp_path / "one.json").stdout
    assert "no earlier record of such a machine" in told
    monkeypatch.setattr("bindusbl_des.benchmarks.bench.HISTORY", tmp_path / "none.json")
    assert "no earlier record here" in call(*WORDS).stdout


@pytest.mark.parametrize("content", ["", "[]", "{}x", '{"a": {"missions": {"m": {}}}}', '{"a": 1}'])
def test_what_is_no_record_is_refused(content: str, tmp_path: Path) -> None:
    """Nothing is measured before it is known with what to compare."""
    (tmp_path / "r.json").write_text(content)
    for name, said in (("r.json", "holds no measurement"), ("none.json", "cannot be read")):
        outcome = call("bench", "--against", tmp_path / name)
        assert (outcome.exit_code, outcome.stdout) == (2, "")
        assert said in outcome.stderr


def test_an_unknown_mission_is_refused() -> None:
    """A name that fits no mission is told with those there are."""
    outcome = call("bench", "--only", "(7,7)")
    assert outcome.exit_code == 2
    assert "(3,3) remus100" in outcome.stderr


@pytest.mark.parametrize("name", ["(3,3) kinematic", "(3,3) bluerov2"])
def test_every_module_at_work_belongs_to_a_part(name: str) -> None:
    """A module that takes part in a mission is listed in benchmarks/timing.py."""
    mission = of_length(MISSIONS[name], 10.0)
    ran = {file for file, *_ in profiled(lambda: simulate(mission))}
    assert not [file for file in ran if part_of_file(file) == OTHER]


def test_time_in_libraries_belongs_to_the_parts_that_waited_for_it() -> None:
    """A library that USBL waits 1 s for and the mission 3 s, with all it calls, is split 1 to 3."""
    package = Path(bindusbl_des.__file__).parent
    usbl, metrics = (
        str(package / name) for name in ("core/usbl/measuring.py", "core/mission/metrics.py")
    )
    ours, theirs = (usbl, 1, "locate"), (metrics, 1, "auv_metrics")
    outer, inner = ("~", 0, "outer"), ("~", 0, "inner")
    calls: Any = {
        ours: (1, 1, 0.0, 1.0, {}),
        theirs: (1, 1, 0.0, 3.0, {}),
        outer: (2, 2, 1.0, 4.0, {ours: (1, 1, 0.2, 1.0), theirs: (1, 1, 0.8, 3.0)}),
        inner: (2, 2, 3.0, 3.0, {outer: (2, 2, 3.0, 3.0), inner: (9, 9, 1.0, 1.0)}),
    }
    found = shares(calls)
    assert (found["USBL"], found["mission"]) == pytest.approx((0.25, 0.75))


def test_profiles_see_the_libraries_at_work() -> None:
    """The numpy that coverage calls is that of geometry, which belongs to vehicles."""
    asvs = formation(12, 40.0)
    assert shares(profiled(lambda: covering_radius(60.0, asvs)))["vehicles"] > 0.95


def test_another_configuration_costs_as_much_but_is_another() -> None:
    """Nudged missions differ in speed alone, by less than changes any count of events."""
    mission = MISSIONS["(3,1) kinematic"]
    other = elsewhere(mission, 3)
    assert other != mission
    assert other.auvs.speed_m_per_s == pytest.approx(mission.auvs.speed_m_per_s, rel=1e-5)


def test_the_sweep_has_5760_missions_and_its_sample_all_sizes() -> None:
    """The plan is the paper's 5,760 missions; what is run of it spans every key."""
    points = command_lines.sweep_points()
    assert len(points) * command_lines.SEEDS == command_lines.PLANNED == 5760
    sample = points[:: command_lines.STRIDE]
    for key in points[0]:
        assert {point[key] for point in sample} == {point[key] for point in points}


def test_a_command_that_fails_is_no_measurement() -> None:
    """A command that ends with an error stops the benchmark with what it said."""
    with pytest.raises(RuntimeError, match="No such command"):
        command_lines.call(["sail"])


def test_traffic_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    """What other simulators repeat is the mission's own traffic, to the last digit."""
    mission = of_length(MISSIONS["(10,3) kinematic"], 20.0)
    exported, heard, meant = traffic.traffic_of(mission)
    exported.write(tmp_path / "traffic.txt")
    assert traffic.read_traffic(tmp_path / "traffic.txt") == exported
    result = simulate(mission)
    pings = [sent for sent in exported.transmissions if sent.band == "hf"]
    assert 0 <= len(result.tables["pings"]) - len(pings) <= 10  # those still under way
    decoded = result.tables["receptions"].outcome == "heard"
    assert sum(1 for one in heard if one[0] == "hf") == decoded.sum() > 50
    assert {one for one in heard if one[0] == "mf"} <= meant


def test_traffic_that_the_text_cannot_say_is_refused() -> None:
    """A mission whose pings are lost by chance has no traffic that another simulator could hear."""
    with pytest.raises(ValueError, match=r"loss\.law none"):
        traffic.traffic_of(Scenario(name="lossy"))


def test_ns3_hears_what_we_hear(tmp_path: Path) -> None:
    """ns-3 and we agree on every reception, in both of its modes; skipped where ns-3 is missing."""
    try:
        peer = ns3_uan.Peer(tmp_path)
    except ns3_uan.PeerMissing as missing:
        pytest.skip(str(missing))
    row = ns3_uan.compare(of_length(MISSIONS["(10,3) kinematic"], 30.0), peer, repeats=1)
    assert row["pings_heard"] > 50
    assert row["frames_reached"] > 50


def test_a_missing_ns3_is_told_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without ns-3 the comparison says how to install it."""
    monkeypatch.setattr(ns3_uan, "find_spec", lambda name: None)
    with pytest.raises(ns3_uan.PeerMissing, match=r"pip install 'bindusbl-des\[peers\]'"):
        ns3_uan.ns3_home()


def test_the_page_is_the_one_that_the_measurements_make() -> None:
    """docs/performance.md is what benchmarks/record.py writes; else run it again."""
    history = json.loads((ROOT / "benchmarks" / "history.json").read_text(encoding="utf-8"))
    written = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    assert written == import_module("page").page(history)


def test_targets_are_met_first_and_then_or_not() -> None:
    """What was not measured meets nothing; a value between the two bounds meets the first."""
    targets = import_module("targets")
    sweep = {"peak_memory_mb": 400.0, "planned_processor_s": 100.0}
    commands = {"sweep": sweep, "run_ms": {"processor": 4000.0}}
    found = {"missions": {}, "commands": commands}
    verdicts = {target.what: verdict for target, _, verdict in targets.verdicts(found)}
    assert verdicts["memory of a sweep, its largest process"] == "first met"
    assert verdicts["sweep of 5,760 missions on two cores"] == "met"
    assert verdicts["`run` of the baseline, from command to files"] == "**not met**"
    assert verdicts["(3,3), slower vehicle"] == "not measured"
