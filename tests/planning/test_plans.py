"""Plans from question to answer, where what missions come to is known beforehand."""

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaigns_for_tests import auv, hand_made
from plans_for_tests import STATED_ERROR
from shapely import LineString, distance, points

import bindusbl_des
from bindusbl_des import Scenario, ScenarioError, Setup, load_scenario, plan, simulate
from bindusbl_des.apps.export.chart_files import planned
from bindusbl_des.apps.planning.flying import Budget
from bindusbl_des.apps.planning.folder import drawn_team
from bindusbl_des.support.wording import amount

TEAMS = {"asvs.count": [1, 2, 3], "protocol.schedule": ["spatial_reuse"],
         "protocol.downlink": ["sequential"], "asvs.formation.angle_deg": [0, 30]}  # fmt: skip
BASE = Scenario.model_validate(
    {"name": "bay", "duration_s": 60, "survey": {"side_m": 100}, "auvs": {"count": 2}}
)
GOAL = {"position_error_p95_m": 1.0}


def fleet(scenario: Scenario, seed: int) -> list[dict[str, float | None]]:
    """Return errors that fall with the number of ASVs: 2, 1 and 2/3 m, a little less at 30 deg.

    The worst AUV's are 1.2 times those, and so is their p95; two ASVs miss 1 m, three keep it.
    """
    noise = 0.02 * np.random.default_rng(seed).standard_normal()
    turned = 0.9 if getattr(scenario.asvs.formation, "angle_deg", 0.0) == 30 else 1.0
    drift = scenario.navigation.random_walk_m_per_sqrt_s / 0.027
    error = turned * drift * 2.0 / scenario.asvs.count + noise
    return [auv(error, position_error_p95_m=1.2 * error), auv(0.5, position_error_p95_m=0.6)]


@pytest.fixture(autouse=True)
def _in_this_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in an empty folder, its missions in this process, each as `fleet` has it."""
    begin(tmp_path, monkeypatch)


def begin(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Go to a folder, where missions are those of `fleet`."""
    patch.chdir(folder)
    hand_made(patch, fleet)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which `found` is."""
    return tmp_path_factory.mktemp("plan")


@pytest.fixture(scope="module")
def found(home: Path) -> bindusbl_des.Plan:
    """The plan of the teams above."""
    with pytest.MonkeyPatch.context() as patch:
        begin(home, patch)
        return made()


def made(out: str | None = "out", **given: Any) -> bindusbl_des.Plan:
    """Return a plan of the teams above."""
    return plan(BASE, out, **{"below": GOAL, "vary": TEAMS, **given})


def asvs(found: bindusbl_des.Plan) -> int:
    """Return how many ASVs the answer of a plan has."""
    assert found.answer is not None
    count: int = found.answer["asvs.count"]
    return count


def test_the_least_team_that_keeps_the_goal_is_the_answer(
    home: Path, found: bindusbl_des.Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three ASVs at 30 deg: two miss the goal, and three at 0 deg are worse by what matters."""
    monkeypatch.chdir(home)
    assert found.answer == {
        "asvs.count": 3, "protocol.schedule": "spatial_reuse", "protocol.downlink": "sequential",
        "asvs.formation.angle_deg": 30,
    }  # fmt: skip
    record = json.loads(Path("out/plan.json").read_text())
    assert record == found.record
    assert record["goal"] == [{"metric": "position_error_p95_m", "below": 1.0, "of": "worst"}]
    assert record["confidence"] == 0.95
    assert record["status"] == "complete"
    assert record["settled"] is True
    assert len(record["told"]) == 2  # nothing is wanting
    assert "nine in ten teams so predicted lie from" in record["told"][1]
    low, high = (
        record["candidates"][record["chosen"]]["predicted"][it][0] for it in ("low", "high")
    )
    assert high / low == pytest.approx((1 + STATED_ERROR["position_error_p95_m"].p90) ** 2)
    assert record["answer"] == record["candidates"][record["chosen"]]["keys"]
    chosen = record["candidates"][record["chosen"]]
    assert chosen["asvs"] == chosen["cost"] == len(chosen["stations"]) == 3
    assert chosen["verdict"] == "met"
    assert chosen["simulated"]["mean"][0] == pytest.approx(1.2 * 0.6, abs=0.03)
    assert chosen["simulated"]["high"][0] < 1.0
    missed = [it["verdict"] for it in record["candidates"] if it["asvs"] < 3]
    assert set(missed) == {"not met"}
    doubts = record["sensitivity"]  # and the team without the loss, from the same instant on
    rows = len(found.campaign.missions) + doubts[0]["missions"] * (len(doubts) + 1)
    assert record["missions"] == rows
    assert "3 ASVs" in found.summary()


def test_the_answer_is_a_scenario_that_runs(
    home: Path, found: bindusbl_des.Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`best.yaml` is the scenario with the answer's keys; it keeps what the user gave."""
    monkeypatch.chdir(home)
    best = load_scenario("out/best.yaml")
    assert best == found.scenario
    assert (best.asvs.count, best.auvs.count, best.duration_s) == (3, 2, 60.0)
    assert best.record.detail == "full"
    assert found.record["run"] == "bindusbl-des run out/best.yaml"


def test_the_answer_says_how_parts_of_ones_own_are_loaded() -> None:
    own = {"schedule": "schedules_for_tests:all_at_once"}
    base = Scenario.model_validate({**BASE.model_dump(exclude_unset=True), "protocol": own})
    teams = {**TEAMS, "protocol.schedule": ["schedules_for_tests:all_at_once"]}
    found = plan(base, "own", below=GOAL, vary=teams, allow_plugins=True)
    assert found.record["run"] == "bindusbl-des run own/best.yaml --allow-plugins"


def test_sensitivity_is_what_paired_missions_show(found: bindusbl_des.Plan) -> None:
    """Twice the drift is twice the error here, and misses the goal; ranges do nothing."""
    conditions = {it["told"]: it for it in found.record["sensitivity"]}
    assert [it["told"] for it in found.record["sensitivity"] if not it["known"]] == [
        "ranges -20 %", "ASV2 lost", "ASV2 lost halfway, from then on",
        "speed of sound taken 1 % too high", "90 % of the USBL's errors last 10 min",
        "misalignment of 1 deg", "drift x 2",
    ]  # fmt: skip
    assert conditions["drift x 2"]["met"] is False
    assert conditions["drift x 2"]["mean"][0] == pytest.approx(1.44, abs=0.03)
    assert conditions["ranges -20 %"]["met"] is True
    assert conditions["ASV2 lost"]["keys"]["asvs.count"] == 2
    assert conditions["ASV2 lost"]["met"] is False  # 1.2 m: two ASVs, where nobody turned them
    assert {it["missions"] for it in conditions.values()} == {8}  # each is clear at the first look


def test_where_nothing_keeps_the_goal_the_plan_says_what_would() -> None:
    """The answer is null; the nearest team and how far it is are told, and no scenario is left."""
    found = made(below={"position_error_p95_m": 0.3})
    assert found.answer is found.scenario is None
    assert found.record["chosen"] is None
    assert not Path("out/best.yaml").exists()
    assert "The nearest is 3 ASVs" in found.record["would"]
    assert "0.7" in found.record["would"]
    assert found.record["sensitivity"] == []
    assert "No team" in found.summary()


def test_goals_of_the_mean_and_of_a_share_are_easier() -> None:
    """Of two AUVs one keeps 0.6 m whatever is done: half of them, and the mean, ask for less."""
    assert asvs(made("mean", of="mean")) == 2
    half = made("half", of=0.5)
    assert asvs(half) == 1
    # 0.6 m in every mission says little of what is rare: 0.69^8 is 5 %
    assert half.record["told"][1:-1] == [
        "position_error_p95_m did not differ in 8 missions of the answer, which says nothing of "
        "what happens in fewer than 31 % of missions."
    ]


def test_several_goals_are_kept_together() -> None:
    """A second goal that only three ASVs keep decides over an easy first one."""
    easy = {"position_error_p95_m": 5.0}
    one = made("one", below=easy)
    assert asvs(one) == 1
    dear = [it for it in one.record["candidates"] if it["asvs"] > 1]
    shown = [it["simulated"]["missions"] for it in dear if it["simulated"]]
    assert shown == [4, 4]  # one team of two and one of three, to show what more would bring
    assert {it["verdict"] for it in dear} == {"not needed"}
    both = made("two", below={**easy, "position_error_m": 0.8})
    assert asvs(both) == 3
    assert [len(it["simulated"]["mean"]) for it in both.record["candidates"]] == [2] * 6


def test_what_a_key_costs_may_be_worth_a_vessel() -> None:
    """Two ASVs that cost more than three others are not the least team."""
    Path("bay.yaml").write_text(json.dumps(BASE.model_dump(mode="json", exclude_unset=True)))
    teams = [{"asvs.count": 3}, {"asvs.count": 2, "navigation.random_walk_m_per_sqrt_s": 0.009}]
    for price, count in ((0.5, 2), (1.5, 3)):
        cost = {"asv": 1, "navigation.random_walk_m_per_sqrt_s=0.009": price}
        text = {"scenario": "bay.yaml", "goal": {"metric": "position_error_m", "below": 1},
                "candidates": teams, "cost": cost}  # fmt: skip
        Path("plan.yaml").write_text(json.dumps(text))
        found = plan("plan.yaml", f"out{count}")
        assert asvs(found) == count
        total = amount(count + price * (count == 2))
        assert f", cost {total}: " in found.record["told"][0]
        assert f", cost {total}: " in found.summary()
        runner = found.record["candidates"][found.record["runners_up"][0]]
        assert f"{runner['team']}: " in found.summary().replace("\n            ", " ")
        assert runner["team"].endswith(f", cost {amount(runner['cost'])}")
        page = Path(f"out{count}/plan.html").read_text()
        assert f"<dt>cost</dt><dd>{total} <" in page
    assert "cost" not in made("unpriced").record["told"][0]


def test_whole_points_are_placed_where_nobody_says_where() -> None:
    """A team that is listed without places need not keep the default ring; where the point or the
    scenario gives places it is there, and nowhere else.
    """
    given = BASE.model_dump(mode="json", exclude_unset=True)
    teams = [{"asvs.count": 3}, {"asvs.count": 2, "asvs.formation.radius_m": 20}]
    goal = {"metric": "position_error_m", "below": 5}

    def places(scenario: dict[str, Any], out: str) -> list[tuple[int, Any]]:
        Path("bay.yaml").write_text(json.dumps(scenario))
        text = {"scenario": "bay.yaml", "goal": goal, "candidates": teams}
        Path("plan.yaml").write_text(json.dumps(text))
        found = plan("plan.yaml", out).record
        assert found["excluded"] or len(found["candidates"]) >= 2
        return [(it["asvs"], it["keys"].get("asvs.formation.positions_m", "ring"))
                for it in found["candidates"]]  # fmt: skip

    free = places(given, "free")
    assert len([asvs for asvs, _ in free if asvs == 3]) > 1
    assert [places for asvs, places in free if asvs == 2] == ["ring"]
    kept = places({**given, "asvs": {"formation": {"angle_deg": 30}}}, "kept")
    assert sorted(kept) == [(2, "ring"), (3, "ring")]


def killed_after(missions: int) -> Callable[[Budget, Any], None]:
    """Return what stops a plan after so many missions, as a second Ctrl-C does."""

    def note(budget: Budget, rows: Any) -> None:
        budget.flown += len(rows)
        if budget.flown >= missions:
            raise KeyboardInterrupt

    return note


@pytest.mark.parametrize("damaged", [False, True])
def test_a_plan_that_was_cut_short_goes_on(
    damaged: bool, found: bindusbl_des.Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same call goes on, flies nothing twice, and finds what it would have found at once; also
    where the records of its missions have been damaged meanwhile.
    """
    whole = found.record
    with monkeypatch.context() as patched:
        patched.setattr(Budget, "note", killed_after(10))
        with pytest.raises(KeyboardInterrupt):
            made()
    assert sorted(it.name for it in Path("out").iterdir()) == ["missions", "question.json"]
    for path in Path("out/missions").rglob("campaign.json") if damaged else ():
        path.write_text(path.read_text().replace("bay", "bax"))
    flown: list[int] = []
    monkeypatch.setattr(Budget, "note", lambda _, rows: flown.append(len(rows)))
    record = made().record
    assert 0 < sum(flown) <= whole["missions"] - 10
    assert record == whole


@pytest.mark.usefixtures("found")
def test_folders_are_never_mixed_up(home: Path) -> None:
    """A finished plan, another plan and anything else stay as they are unless forced."""
    shutil.copytree(home / "out", "out")
    with pytest.raises(ValueError, match="holds this plan, which is finished; --force"):
        made()
    with pytest.raises(ValueError, match=r"holds another plan; --force \(in Python force=True\)"):
        made(confidence=0.9)
    assert made(confidence=0.9, force=True).record["confidence"] == 0.9
    Path("out/mine.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"holds mine\.txt, which no plan wrote"):
        made(force=True)
    Path("other").mkdir()
    Path("other/file").touch()
    with pytest.raises(ValueError, match="is not empty and no plan"):
        made("other")
    Path("out/question.json").write_text("{}")
    with pytest.raises(ValueError, match=r"question\.json: cannot be used \(it has no 'fing"):
        made()


def test_without_a_folder_a_plan_takes_its_own_along() -> None:
    """It lies in a temporary folder, which goes with the plan."""
    found = made(None)
    folder = found.folder
    assert (folder / "plan.html").is_file()
    del found
    assert not folder.exists()


def test_a_plan_that_is_cut_off_says_what_it_knows_and_goes_on_from_there(
    found: bindusbl_des.Plan,
) -> None:
    """Whatever the cut, nothing is claimed before it is settled, no mission is flown twice, and
    what is found in the end is the same: also where the answer changes on the way.
    """
    answers, calls, record = set(), 0, {"status": "cut"}
    while record["status"] == "cut":
        made_now = made(budget_missions=11)
        record, calls = made_now.record, calls + 1
        assert record["missions"] <= 11 * calls
        if not record["settled"]:
            answers.add(made_now.summary().splitlines()[0])
            assert record["told"][0].startswith("Not settled: ")
            assert "may do; best so far " in record["told"][0]
            assert "confidence" not in " ".join(record["told"])
            assert record["would"] is None
            assert "Cut off by --budget-missions 11; the same" in " ".join(record["told"])
    assert len(answers) > 2
    assert record | {"budget_missions": None} == found.record
    assert calls == -(-found.record["missions"] // 11)


def test_what_will_do_is_named_where_it_is_not_settled_whether_less_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two ASVs are at the limit, give or take 0.3 m a mission; three keep it."""

    def at_the_limit(scenario: Scenario, seed: int) -> list[dict[str, float | None]]:
        noise = np.random.default_rng(seed).standard_normal()
        return [auv(1.0 + 0.3 * noise if scenario.asvs.count == 2 else 0.5), auv(0.4)]

    hand_made(monkeypatch, at_the_limit)
    vary = {**TEAMS, "asvs.count": [2, 3], "asvs.formation.angle_deg": [0]}
    record = plan(BASE, "out", below={"position_error_m": 1.0}, vary=vary).record
    assert (record["settled"], record["answer"]["asvs.count"]) == (False, 3)
    told = record["told"][0]
    assert told.startswith("Not settled: 3 ASVs in the scenario's places")
    assert "will do, position_error_m 0.500 m" in told
    assert "whether less does: " in told


def test_missions_that_failed_are_told_with_their_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """Be it all of them, or those of some teams."""

    def leaky(scenario: Scenario, seed: int) -> list[dict[str, float | None]]:
        if scenario.asvs.count < 3:
            raise RuntimeError("no water")
        return fleet(scenario, seed)

    hand_made(monkeypatch, leaky)
    vary = {**TEAMS, "asvs.count": [1, 2], "asvs.formation.angle_deg": [0]}
    none = plan(BASE, "none", below=GOAL, vary=vary).record
    said = f"{none['missions']} missions failed: RuntimeError: no water. Failed missions meet no"
    assert any(text.startswith(said) for text in none["told"])
    some = plan(BASE, "some", below=GOAL, vary=TEAMS).record
    assert some["answer"]["asvs.count"] == 3
    failed = [text for text in some["told"] if "failed: RuntimeError: no water" in text]
    assert len(failed) == 1
    assert 0 < int(failed[0].split()[0]) < some["missions"]
    hand_made(monkeypatch, fleet)
    assert not [text for text in made("well").record["told"] if "failed" in text]


def test_time_that_is_up_is_no_failure() -> None:
    """A net of one second stops at a whole mission; no exception, no red."""
    record = plan(BASE, "out", below=GOAL, vary=TEAMS, budget_s=1.0).record
    assert record["budget_s"] == 1.0
    assert record["settled"] or record["told"][0].startswith("Not settled")


def refusals() -> Iterator[tuple[dict[str, Any], type[Exception], str]]:
    """Yield wrong arguments and what is said of them."""
    yield {"below": {}}, ScenarioError, "goal: missing; add it"
    yield {"below": {"positon_error_m": 1}}, ScenarioError, "did you mean 'position_error_m'"
    yield {"below": {"hf_coverage": 0.5}}, ScenarioError, "more of it is better"
    yield {"below": "position_error_m=1"}, TypeError, "below needs a mapping"
    yield {"vary": {"asvs.cout": [1]}}, ScenarioError, "did you mean 'count'"
    yield {"confidence": 95}, ScenarioError, "confidence: needs a number >= 0.5 and <= 0.9999"
    yield {"budget": 3}, TypeError, "plan has no argument 'budget'; did you mean 'budget_s'"


@pytest.mark.parametrize(("given", "kind", "said"), list(refusals()))
def test_wrong_arguments_are_refused(
    given: dict[str, Any], kind: type[Exception], said: str
) -> None:
    """Each is named with its value and a remedy, and no folder is made."""
    with pytest.raises(kind) as refused:
        made(**given)
    assert said in str(refused.value)
    assert not Path("out").exists()


def test_a_plan_never_has_answers_without_airtime_and_says_so() -> None:
    """Neither the scenario's own nor those that are asked for: the answer is flown with frames."""
    reply = {"model": "direct_reply", "reply": "instant"}
    instant = {**BASE.model_dump(mode="json"), "protocol": {"downlink": reply}}
    base = Scenario.model_validate(instant)
    vary = {"asvs.count": [3], "protocol.downlink": ["direct_reply"]}
    own = plan(base, "own", below=GOAL, vary=vary).record
    asked = plan(
        BASE, "asked", below=GOAL, vary={**vary, "protocol.downlink.reply": ["instant", "frame"]}
    ).record
    for record in (own, asked):
        keys = [it["keys"] for it in record["candidates"]]
        assert {it.get("protocol.downlink.reply") for it in keys} == {"frame"}
        assert any("flown with protocol.downlink.reply: frame" in it for it in record["told"])


def test_the_team_of_a_plan_can_be_drawn(
    found: bindusbl_des.Plan, home: Path, tmp_path: Path
) -> None:
    """The answer; without one the nearest, laid over the scenario that was asked about."""
    assert found.folder is not None
    assert found.answer is not None
    team = drawn_team(home / found.folder)
    assert (team.scenario.asvs.count, team.whose) == (found.answer["asvs.count"], "the answer")
    assert team.told == found.record["told"][0]
    folder = shutil.copytree(home / found.folder, tmp_path / "open")
    (folder / "best.yaml").unlink()
    assert drawn_team(folder).scenario.asvs == team.scenario.asvs
    record = json.loads((folder / "plan.json").read_text()) | {"answer": None, "chosen": None}
    (folder / "plan.json").write_text(json.dumps(record))
    nearest, team = found.record["runners_up"][0], drawn_team(folder)
    assert team.scenario.asvs.count == found.record["candidates"][nearest]["asvs"]
    assert team.whose == f"candidate {nearest + 1}, the nearest so far"
    (folder / "plan.json").unlink()
    with pytest.raises(ValueError, match="no team was flown yet"):
        drawn_team(folder)


def test_missions_that_miss_the_goal_are_a_share(found: bindusbl_des.Plan) -> None:
    """Two ASVs miss 1 m in each mission, three in none."""
    for it in found.record["candidates"]:
        if it["simulated"]:
            errors = [fleet_error(it["asvs"], it["keys"], seed) for seed in range(40)]
            flown = errors[: it["simulated"]["missions"]]
            missed = sum(not error <= 1.0 for error in flown) / len(flown)
            assert it["simulated"]["missed"] == [pytest.approx(missed, abs=1e-12)]


def fleet_error(asvs: int, keys: dict[str, Any], seed: int) -> float:
    """Return the worst AUV's p95 of a mission of `fleet`."""
    formation = {"angle_deg": keys.get("asvs.formation.angle_deg", 0.0)}
    data = {**BASE.model_dump(mode="json"), "asvs": {"count": asvs, "formation": formation}}
    return max(
        float(it["position_error_p95_m"] or 0) for it in fleet(Scenario.model_validate(data), seed)
    )


def test_vessels_that_follow_are_candidates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the user allows it, vessels that move are tried in each number beside those at rest;
    they are not predicted but flown, and the page says so.
    """

    def followed(scenario: Scenario, seed: int) -> list[dict[str, float | None]]:
        share = 0.3 if scenario.asvs.formation.moves else 1.0
        return [
            {key: share * (it or 0.0) for key, it in row.items()} for row in fleet(scenario, seed)
        ]

    hand_made(monkeypatch, followed)
    vary = {**TEAMS, "asvs.formation.model": ["ring", "follow"]}
    del vary["asvs.count"], vary["asvs.formation.angle_deg"]
    found = plan(BASE, "team", below=GOAL, vary=vary)
    assert found.answer is not None
    assert found.answer["asvs.count"] == 1
    assert found.answer["asvs.formation.model"] == "follow"
    assert found.record["told"][0].startswith("1 ASV on the move (follow)")
    moving = [it for it in found.record["candidates"] if not it["stations"]]
    assert {it["asvs"] for it in moving} == {1, 2, 3, 4, 5, 6}
    at_rest = [it["keys"] for it in found.record["candidates"] if it["stations"]]
    assert any("asvs.formation.positions_m" in keys for keys in at_rest), "placed as well as can be"
    assert {it["predicted"]["value"][0] for it in moving} == {None}
    assert load_scenario("team/best.yaml").asvs.formation.moves
    lost = [it["told"] for it in found.record["sensitivity"] if "lost" in it["told"]]
    assert lost == ["ASV0 lost halfway, from then on"]
    page = Path("team/plan.html").read_text()
    assert "Nothing is predicted of this team. Drawn are its ways in the mission of seed" in page
    on_earth = ("environment.origin={lat_deg: 43.9, lon_deg: 15.4}",)
    moving = load_scenario("team/best.yaml", overrides=on_earth)
    assert not any(it.name.startswith("ASV") for it in planned(Setup(moving)))
    tracks = simulate(load_scenario("team/best.yaml"), found.record["ways"]["seed"]).tables[
        "tracks"
    ]
    [way] = drawn_team(Path("team")).ways
    gone = tracks.loc[tracks.vehicle == "ASV0", ["x_m", "y_m"]].to_numpy()
    assert distance(LineString(way), points(gone)).max() < 0.3
    assert np.hypot(*np.diff(way, axis=0).T).sum() > 10.0
    [begin] = found.record["candidates"][found.record["chosen"]]["places"]
    assert [begin["x_m"], begin["y_m"]] == way[0]
    drawn = {it.name: it for it in planned(Setup(moving), ways=[way])}
    assert (drawn["ASV0"].kind, drawn["ASV0 (way)"].kind) == ("Point", "LineString")
    assert "It moves; here it begins" in drawn["ASV0"].about


def test_missions_that_are_longer_than_their_survey_are_told() -> None:
    """With the answer, and on its page, which says how long missions take."""
    long = BASE.model_copy(update={"duration_s": 3000.0})
    found = plan(long, "long", below=GOAL, vary=TEAMS)
    [said] = [it for it in found.record["told"] if it.startswith("duration_s is 0:50 h, and")]
    assert "all means have that time in them" in said
    assert found.record["duration_s"] == 3000.0
    page = Path("long/plan.html").read_text()
    assert "missions of 0:50 h" in page
    assert said[:60] in page.replace("Duration_s", "duration_s")


def test_the_missions_of_a_plan_are_judged_by_its_goal() -> None:
    """Its campaign says how many teams keep that, and not how many keep a metre."""
    found = plan(BASE, "two", below={"position_error_m": 2.5}, vary=TEAMS)
    assert "keep every AUV surely below 2.5 m" in " ".join(found.campaign.summary().split())
    other = plan(BASE, "age", below={"position_error_p95_m": 2.5}, vary=TEAMS)
    assert "surely below 1 m" in " ".join(other.campaign.summary().split())
