"""Whether a team still meets its goals where the world is worse: told as early as it is sure."""

import json
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaigns_for_tests import fly_with
from numpy.typing import NDArray
from pandas.testing import assert_frame_equal
from plans_for_tests import Goal, interval, team_in
from worlds import parse_scenario

from bindusbl_des import Plan, Scenario, load_scenario, plan, simulate
from bindusbl_des.apps.planning import doubting
from bindusbl_des.support.wording import significant, with_ends

Floats = NDArray[np.float64]
SEEDS = 32  # of a condition, at most
FRESH = 200 - SEEDS  # the first of them: by those before teams are chosen
TEAM = team_in(Scenario(name="bay"))
BELOW, ABOVE = Goal("position_error_m", below=1.0), Goal("fix_rate_hz", above=0.1)


def laid_over(scenario: Scenario, keys: dict[str, Any]) -> Scenario:
    """Return a scenario with other values of some keys."""
    changes = [f"{key}={json.dumps(value)}" for key, value in keys.items()]
    return parse_scenario(scenario.model_dump_json(exclude_unset=True), overrides=changes)


def told(values: Floats, goals: Sequence[Goal] = (BELOW,), most: int = 10**6) -> list[Any]:
    """Return what is told of conditions with values (c, seeds, goals), of `most` missions."""
    conditions = [doubting.Doubt("drift", f"condition {n}", {}, TEAM) for n in range(len(values))]
    left = most

    def sample(pairs: Sequence[tuple[int, int]]) -> Floats:
        nonlocal left
        found = [values[pair] for pair in pairs][:left]
        left -= len(found)
        return np.array(found).reshape(-1, len(goals))

    return doubting.doubted(
        conditions, goals, sample, lambda seeds: np.ones((len(seeds), len(goals)))
    )


def around(*means: float, spread: float = 0.1) -> Floats:
    """Return values (c, 32, 1) that scatter evenly about each mean."""
    apart = spread * np.resize([1.0, -1.0, 0.5, -0.5], SEEDS)
    return np.array(means)[:, None, None] + apart[None, :, None]


def test_what_is_clear_takes_few_missions_and_what_is_close_takes_all() -> None:
    """Far from the limit 8 are enough, nearer 16, and at the limit 32 do not tell."""
    found = told(around(0.4, 2.0, 0.92, 1.0))
    assert [it["met"] for it in found] == [True, False, True, None]
    assert [it["missions"] for it in found] == [8, 8, 16, 32]
    assert found[0]["mean"] == [pytest.approx(0.4)]
    as_planned = {"mean": [1.0], "low": [1.0], "high": [1.0], "met": True}
    assert found[0]["as_planned"] == as_planned


def test_what_misses_without_the_condition_as_well_is_said_to() -> None:
    """A condition is not to blame for what half a mission alone misses; old plans do not know."""
    values = around(2.0, 2.0, 2.0)
    lost = [
        doubting.Doubt("lost_halfway", f"ASV{n} lost halfway", {}, TEAM, TEAM) for n in range(2)
    ]
    conditions = [*lost, doubting.Doubt("drift", "drift x 2", {}, TEAM)]
    without = around(1.5, 1.01)

    def sample(pairs: Sequence[tuple[int, int]]) -> Floats:
        return np.array([values[n, k] if n < 3 else without[n - 3, k] for n, k in pairs])

    def answer(seeds: Sequence[int]) -> Floats:
        return np.full((len(seeds), 1), 1.01)  # of all its seeds it is surely met

    found = doubting.doubted(conditions, (BELOW,), sample, answer)
    assert [doubting.became_of(it) for it in found] == [
        "not met, nor without it",
        "not met",
        "not met",
    ]
    assert [it["as_planned"]["met"] for it in found] == [False, None, True]
    del found[0]["as_planned"]
    assert doubting.became_of(found[0]) == "not met"
    assert doubting.became_of({"met": None}) == "undecided"


def test_all_goals_have_to_be_met_and_one_that_is_missed_is_enough() -> None:
    """A goal of more than a limit counts as one of less; a mission without a value misses it."""
    errors, rates = around(0.4, 0.4, 0.4), around(0.2, 0.05, 0.2, spread=0.01)
    rates[2, 5] = np.nan
    found = told(np.concatenate([errors, rates], axis=2), (BELOW, ABOVE))
    assert [it["met"] for it in found] == [True, False, False]
    assert found[2]["mean"] == [pytest.approx(0.4), None]


def test_what_is_cut_off_leaves_what_was_told_before() -> None:
    """A look that is not whole tells nothing of the goal; what earlier ones told stays."""
    clear, close = 0.4, 0.97
    found = told(around(clear, close), most=20)
    assert [(it["met"], it["missions"]) for it in found] == [(True, 8), (None, 12)]
    assert [(it["met"], it["missions"]) for it in told(around(clear, close), most=3)] == [(None, 3)]


@pytest.mark.parametrize("shape", [pytest.param(None, marks=pytest.mark.slow), 16.0])
def test_verdicts_at_the_limit_are_wrong_as_seldom_as_was_asked(shape: float | None) -> None:
    """Over all looks one in twenty verdicts at most is given to a mean that is at its limit, half
    of them that it is met; values are normal, or skewed as errors are (gamma, skewness 0.5).
    """
    count, rng = 2000, np.random.default_rng(7)
    noise = (
        rng.standard_normal((count, SEEDS, 1))
        if shape is None
        else (rng.gamma(shape, size=(count, SEEDS, 1)) - shape) / np.sqrt(shape)
    )
    found = [it["met"] for it in told(1.0 + 0.2 * noise)]
    wrong = {met: found.count(met) / count for met in (True, False)}
    assert 0.005 < wrong[True] < 0.03
    assert sum(wrong.values()) < 0.05


def lost(at_s: float, frame: str) -> Any:
    """Return the AUVs' metrics of a recovery in which ASV2 fails at an instant."""
    keys = [f"asvs.failures=[{{asv: 2, at_s: {at_s}}}]", f"navigation.bias_frame={frame}"]
    return simulate(load_scenario("recovery_140m", overrides=keys), 0).auvs


def test_a_vessel_lost_late_is_missed_more_where_lanes_take_a_bias_back() -> None:
    """AUV0, whom ASV2 alone hears, turns about at 120 s: its second lane takes back what a bias in
    the body frame did from the start on, and adds what it does from 150 s on.  In the world frame
    nothing is taken back.
    """
    worst = {
        frame: [lost(at, frame)["position_error_p95_m"].max() for at in (0.0, 150.0)]
        for frame in ("body", "world")
    }
    assert worst["body"][1] > 1.1 * worst["body"][0]
    assert worst["world"][1] < 0.6 * worst["world"][0]
    assert worst["body"][1] == pytest.approx(worst["world"][1], rel=0.05)


def test_a_vessel_that_fails_at_once_was_never_there() -> None:
    """It keeps no turn to broadcast: all metrics are those of the team without it, bit for bit."""
    places = "asvs.formation={positions_m: [[50, 0], [-25, 43.30127018922193]]}"
    rest = load_scenario("recovery_140m", overrides=["asvs.count=2", places])
    assert_frame_equal(lost(0.0, "body"), simulate(rest, 0).auvs)


def test_a_loss_is_judged_after_it_and_beside_the_same_missions_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error of the minutes before a loss does not hide what it costs: over the second half
    AUVs fare worse without the vessel, and all figures are of the same seeds.
    """
    vary = {"asvs.count": [2], "asvs.formation.radius_m": [31], "asvs.formation.angle_deg": [80],
            "protocol.schedule": ["spatial_reuse"],
            "protocol.downlink": ["sequential"]}  # fmt: skip
    goal = {"position_error_max_m": 30.0}
    scenario = load_scenario("recovery_140m", overrides=["record.metrics_hz=2"])
    fly_with(monkeypatch)
    found = plan(scenario, tmp_path / "out", below=goal, vary=vary, workers=1)
    cases = {it["told"].partition(" ")[2]: it for it in found.record["sensitivity"]}
    lost = cases["lost halfway, from then on"]
    assert lost["keys"]["record.metrics_from_s"] == 150
    answer, seeds = found.scenario, range(FRESH, FRESH + lost["missions"])
    assert answer is not None
    for keys, told in ((lost["keys"], lost), ({"record.metrics_from_s": 150}, lost["as_planned"])):
        data = laid_over(answer, {**keys, "record.detail": "summary"})
        worst = [simulate(data, seed).mission.worst_position_error_max_m[0] for seed in seeds]
        assert told["mean"] == [pytest.approx(np.mean(worst))]
    assert lost["mean"][0] > 1.5 * lost["as_planned"]["mean"][0]


@pytest.fixture(scope="module")
def doubtful(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A plan of two ASVs with a filter that weighs, whatever becomes of it."""
    vary = {"asvs.count": [2], "asvs.formation.radius_m": [35], "asvs.formation.angle_deg": [80],
            "protocol.schedule": ["spatial_reuse"],
            "protocol.downlink": ["sequential"]}  # fmt: skip
    options = ["navigation.filter=kalman", "duration_s=120", "record.metrics_hz=2"]
    scenario = load_scenario("recovery_140m", overrides=options)
    with pytest.MonkeyPatch.context() as patch:
        fly_with(patch)
        folder = tmp_path_factory.mktemp("doubtful") / "out"
        return plan(scenario, folder, below={"position_error_m": 30.0}, vary=vary, workers=1)


def cases_of(found: Plan, known: bool) -> dict[str, dict[str, Any]]:
    """Return the rows of a plan's doubts of which filters know, or do not, by what they are."""
    return {it["what"]: it for it in found.record["sensitivity"] if it["known"] == known}


def test_filters_do_not_know_of_doubts_and_know_of_their_twins(doubtful: Plan) -> None:
    """Twice the drift, sound that is taken for 1 % too fast, fixes that err for long, arrays that
    are askew.  With the process noise and the prior of the plan set by hand, and with no slow error
    of its angles believed in, missions err as much; a filter that is told errs less.
    """
    untold, told = cases_of(doubtful, False), cases_of(doubtful, True)
    assert set(told) == {"drift", "sound_speed", "slow", "misalignment"}
    assert set(untold) == {*told, "ranges", "bursts", "lost", "lost_halfway"}
    assert doubtful.scenario is not None
    answer = doubtful.scenario

    def flown(case: dict[str, Any], filter_: Any) -> float:
        keys = {key: it for key, it in case["keys"].items() if "assumes" not in key}
        world = laid_over(answer, {**keys, "navigation.filter": filter_})
        seeds = range(FRESH, FRESH + case["missions"])
        return float(np.mean([simulate(world, it).auvs.position_error_m.max() for it in seeds]))

    ignorant: dict[str, dict[str, Any]] = {
        "drift": {"random_walk_m_per_sqrt_s": 0.027, "velocity_bias_sd_m_per_s": 0.06},
        "slow": {"untold": ["slow"]},
    }
    for what, settings in ignorant.items():
        filter_ = {"model": "kalman", **settings}
        assert untold[what]["mean"] == [pytest.approx(flown(untold[what], filter_), rel=1e-9)]
    for what, case in told.items():
        assert case["mean"] == [pytest.approx(flown(case, "kalman"), rel=1e-9)]
        assert case["told"] == f"{untold[what]['told']}, known to the filter"
    for what in ("drift", "sound_speed", "misalignment"):
        assert untold[what]["mean"][0] > 1.02 * told[what]["mean"][0]
    assert untold["slow"]["keys"] == {
        "usbl.slow_share": 0.9, "usbl.correlation_s": 600.0,
        "navigation.filter.assumes": {"usbl": {"slow_share": 0.0, "correlation_s": 60.0}},
    }  # fmt: skip
    assert untold["misalignment"]["keys"]["usbl.misalignment_sd_deg"] == 1.0
    assert untold["sound_speed"]["keys"]["navigation.filter.assumes"] == {
        "environment": {"assumed_sound_speed_m_per_s": None}
    }


def test_what_a_doubt_costs_is_of_pairs_of_missions(doubtful: Plan) -> None:
    """By how much more AUVs err is the mean of the differences at equal seeds, with an interval
    that is narrower than those of both alone allow; what filters know of is flown eight times.
    """
    answer = doubtful.scenario
    assert answer is not None
    case = cases_of(doubtful, False)["slow"]
    worlds = [laid_over(answer, case["keys"]), answer]
    seeds = range(FRESH, FRESH + case["missions"])
    ends = [[simulate(world, it).auvs.position_error_m.max() for it in seeds] for world in worlds]
    expected = interval(np.subtract(*ends))
    found = [case["difference"][end] for end in ("mean", "low", "high")]
    assert found == [[pytest.approx(it)] for it in (expected.mean, expected.low, expected.high)]
    assert case["unit"] == ["m"]
    assert {it["missions"] for it in cases_of(doubtful, True).values()} == {8}


def test_sentence_page_and_record_agree_on_doubts(doubtful: Plan) -> None:
    """Each doubt stands in all three, with the same means, unit and verdict."""
    said = " ".join(doubtful.summary().split())
    page = (doubtful.folder / "plan.html").read_text(encoding="utf-8")
    assert json.loads((doubtful.folder / "plan.json").read_text()) == doubtful.record
    told = cases_of(doubtful, True)
    for what, case in cases_of(doubtful, False).items():
        mean, planned = (significant(it["mean"][0]) for it in (case, case["as_planned"]))
        became = doubting.became_of(case)
        text = f"{case['told']}: {mean} m instead of {planned} m, {became}"
        row = f"{escape(case['told'])}: <b>✓ {became}</b> ({mean} m instead of {planned}"
        if what in told:
            known = significant(told[what]["mean"][0])
            text += f" ({known} m if the filter knows)"
            row += f"; {known} if the filter knows"
        assert text in said
        assert f"{row})" in page
    for case in doubtful.record["sensitivity"]:
        cells = page[page.index(f">{escape(case['told'])}<", page.index('id="sensitivity"')) :]
        cells = re.sub(r"<[^>]*>", " ", cells[: cells.index("</tr>")])
        for it in (case, case["difference"]):
            ends = (it[end][0] for end in ("mean", "low", "high"))
            assert "{} ({} to {})".format(*with_ends(*ends)) in cells
        assert f" {case['missions']} " in cells
    assert "as planned, since the crew does not know" in said


def test_what_a_scenario_says_already_is_doubted_further() -> None:
    """Errors that last as long last three times so, arrays are turned twice as far; of a filter
    that models nothing, and of an instrument of one's own, there is less to doubt.
    """
    usbl = {"slow_share": 0.95, "correlation_s": 900.0, "misalignment_sd_deg": 1.5}
    weighs = {"navigation": {"filter": "kalman"}}

    def keys(data: dict[str, Any]) -> dict[str, dict[str, Any]]:
        scenario = Scenario.model_validate({"name": "bay", **data})
        return {what: it for what, _, it in doubting.worse(team_in(scenario))}

    found = keys({**weighs, "usbl": usbl})
    assert found["slow"] == {"usbl.slow_share": 0.95, "usbl.correlation_s": 2700.0}
    assert found["misalignment"] == {"usbl.misalignment_sd_deg": 3.0}
    assert not {"slow", "misalignment"} & keys({"usbl": {"model": "own:instrument"}}).keys()
    deaf = team_in(Scenario.model_validate({"name": "bay", "navigation": {"filter": "fixed_gain"}}))
    assert not any(it.known for it in doubting.doubts(deaf))


def test_a_filter_that_assumes_something_else_is_told_of_the_doubt_alone() -> None:
    """What a scenario's filter takes its errors for stays so, but for what is doubted."""
    assumes = {"navigation": {"scale_factor_sd": 0.5}, "usbl": {"misalignment_sd_deg": 0.2}}
    filter_ = {"model": "kalman", "assumes": assumes}
    team = team_in(Scenario.model_validate({"name": "bay", "navigation": {"filter": filter_}}))
    found = {
        it.known: it.team.scenario.navigation.filter.settings["assumes"]
        for it in doubting.doubts(team)
        if it.what == "misalignment"
    }
    assert found[False] == assumes
    assert found[True] == {"navigation": {"scale_factor_sd": 0.5}, "usbl": {}}


@pytest.mark.parametrize(("line", "tried"), [(1000.0, 333.0), (2.0, 1.0), (None, 1000.0)])
def test_how_the_drift_of_a_sheet_is_drawn_is_doubted(line: float | None, tried: float) -> None:
    """Errors wander over a third of the way, or at all where they were constant."""
    drift = {"percent_of_distance": 0.3, "line_m": line}
    own = Scenario.model_validate({"name": "m", "navigation": {"drift": drift}})
    keys = [keys for _, words, keys in doubting.worse(team_in(own)) if words.startswith("drift")]
    assert keys == [
        {"navigation.drift.percent_of_distance": 0.6}, {"navigation.drift.line_m": tried},
    ]  # fmt: skip


def test_the_range_of_one_band_is_not_called_that_of_both() -> None:
    """A channel that goes by levels knows no range that could be less."""
    acoustics = {"mf": {"channel": "sonar"}}
    team = team_in(Scenario.model_validate({"name": "bay", "acoustics": acoustics}))
    for one, told in ((team, "HF range -20 %"), (TEAM, "ranges -20 %")):
        assert [words for what, words, _ in doubting.worse(one) if what == "ranges"] == [told]


@pytest.mark.parametrize(
    ("acoustics", "what", "keys"),
    [
        ({}, "", {}),  # of the disc nothing is lost
        ({"loss": {"law": "head"}}, "losses last 10 s, not one by one", {"hf": 10.0}),
        ({"loss": {"combine": "clamp_first"}}, "losses last 10 s, not one by one", {"hf": 10.0}),
        (
            {"hf": {"channel": "sonar"}, "mf": {"channel": "sonar"}},
            "losses last 10 s, not one by one",
            {"hf": 10.0, "mf": 10.0},
        ),
        (
            {"hf": {"channel": {"model": "sonar", "burst_s": 2.0}}, "mf": {"channel": "sonar"}},
            "losses last 3 times as long",
            {"hf": 6.0},
        ),
    ],
)
def test_losses_that_last_are_a_doubt_where_anything_is_lost(
    acoustics: dict[str, Any], what: str, keys: dict[str, float]
) -> None:
    given = Scenario.model_validate({"name": "bay", "acoustics": acoustics})
    found = {words: it for what, words, it in doubting.worse(team_in(given)) if what == "bursts"}
    expected = {f"acoustics.{band}.channel.burst_s": it for band, it in keys.items()}
    assert found == ({what: expected} if keys else {})
    for name, value in expected.items():
        band = getattr(laid_over(given, expected).acoustics, name.split(".")[1])
        assert band.channel.settings["burst_s"] == value


def test_the_drift_of_each_group_is_doubted_and_kept_from_its_filter() -> None:
    """Groups with a sheet, a single error, or nothing of their own drift twice as far, and filters
    that are not told go by what was planned.
    """
    groups = [{"count": 1, "drift": {"percent_of_distance": 0.5}}, {"count": 1}]
    navigation = {"filter": "kalman", "drift": {"percent_of_distance": 2.0}}
    data = {"name": "m", "auvs": {"groups": groups}, "navigation": navigation}
    found = {
        (it.what, it.known): it for it in doubting.doubts(team_in(Scenario.model_validate(data)))
    }
    unknown, known = found["drift", False].team, found["drift", True].team
    for team in (unknown, known):
        shares = [group.navigation.drift.percent_of_distance for group in team.setup.groups]
        assert shares == [1.0, 4.0]
    taken = [group.navigation.drift.percent_of_distance for group in unknown.setup.taken.groups]
    assert taken == [0.5, 2.0]
    assert known.setup.taken.groups[0].navigation.drift.percent_of_distance == 1.0
    assert found["drift", False].words == "drift x 2"
    lines = {"auvs.groups.0.drift.line_m", "navigation.drift.line_m"}
    assert lines <= set(found["drift_line", False].keys)


def test_a_lost_vessel_takes_its_own_usbl_along() -> None:
    """Of one sure and one unsure vessel it is the sure one whose loss is felt."""
    groups: list[dict[str, Any]] = [{"count": 1, "usbl": {"gnss_sd_m": 20.0}}, {"count": 1}]
    places = {"model": "positions", "positions_m": [[0, -5], [0, 5]]}
    asvs = {"groups": groups, "formation": places}
    data = {"name": "m", "survey": {"side_m": 60.0}, "asvs": asvs,
            "acoustics": {"hf": {"range_m": 80.0}}}  # fmt: skip
    found = {it.what: it for it in doubting.doubts(team_in(Scenario.model_validate(data)))}
    assert (found["ranges"].team.asvs, found["lost"].team.asvs) == (2, 1)
    assert found["lost"].words == "ASV1 lost"
    [left] = found["lost"].team.setup.usbls
    assert left.gnss_sd == 20.0
