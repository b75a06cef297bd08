"""The least team of ASVs that meets the goals: proposed, predicted, simulated, selected, doubted.

The results lie in a folder: `plan.json`, `best.yaml` (a scenario that meets the goals),
`plan.html`, and the campaign `missions/` of all simulated missions.  `plan.json` holds

* ``name``, ``scenario`` (its name or file), ``scenario_sha256``, ``versions``, ``seed``,
* ``goal``: a list of ``{metric, below or above, of}``, where `of` is ``"worst"`` (of each mission's
  AUVs), ``"mean"``, or a share of them; goals with ``lost`` vessels, whichever, come last;
  ``duration_s`` of a mission; ``confidence``; ``costs``, ``budget_s``, ``budget_missions``,
* ``missions``: how many were simulated; ``settled``: whether the answer has that confidence;
  ``status``: ``complete``, or ``cut`` if a budget ended first,
* ``answer``: null, or the keys and values of the least team that is shown to meet the goals;
  ``chosen``: its number among the candidates, or null; ``would``: what would meet them otherwise,
* ``told``: sentences, the first of which is the answer; ``run``: the command that runs it,
* ``candidates``: all plausible answers, each ``{keys, cost, asvs, stations, places, predicted,
  simulated, verdict, team, told}``.  `places` are the stations, or the first positions of drawn
  vessels that move, each ``{asv, x_m, y_m, lat_deg, lon_deg}``.  `predicted` is ``{value, low,
  high}``, an interval that holds nine of ten simulated values; `simulated` is null or
  ``{missions, mean, low, high}``; lists have one number for each goal,
* ``excluded``: ``[{told, count}]``, how many teams were not simulated and why,
* ``runners_up``: numbers of candidates, the best first,
* ``binding``: ``[{what, told, value}]``, what limits the team, the most first: ``coverage``,
  ``uplink``, ``downlink``, ``fix_noise`` or ``drift``; `value` is the predicted metric of the goal
  farthest from being met if that were twice as good,
* ``sensitivity``: ``[{what, told, keys, known, missions, unit, mean, low, high, met, as_planned,
  difference}]``, the team in worse conditions, `known` to its filter or not; `as_planned`,
  ``{mean, low, high, met}``, are the same missions without the condition, `difference`, ``{mean,
  low, high}``, is over pairs of both,
* ``ways``: null, or tracks of the drawn team's vessels in one mission, if they move:
  ``{seed, asvs: [{asv, places_m}]}``,
* ``prediction_error``: ``{metric: {median, p90}}``, the relative error of predictions.

An unknown number is null.
"""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from shlex import quote
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, TypedDict, Unpack
from weakref import finalize

from ...core.mission.simulation import simulate
from ...core.scenario.scenario import Scenario
from ...core.scenario.scenario_keys import Record
from ...core.setup import Setup
from ...support.files import write_text
from ...support.process import in_notebook
from ...support.shipped import located
from ...support.wording import counted, did_you_mean
from ..campaigns.campaign import Campaign, unfinished_campaign
from ..campaigns.experiments.experiment import Experiment
from ..campaigns.experiments.experiment import ExperimentPlan as Missions
from ..campaigns.experiments.options import PythonArguments
from ..campaigns.running import check_plugins, remove_own
from ..export.chart_files import thinned
from .answer_text import Outcome, best_text, best_yaml, ranked, record, summary
from .doubting import SEEDS, cost_of, doubted, doubts, teams_of, with_costlier
from .flying import Budget, Flights, flights, limit_of, local_workers, wanted
from .folder import BEST, DOUBTS, MISSIONS, PAGE, PLAN, begin
from .goals import Goal, Of
from .plan_page import chart_of, plan_page
from .question import Asking, Question, goals_of_arguments, read_plan
from .relief import binding
from .selecting import Choice, Selection, select
from .teams import Team, further, narrowed, proposed

# The most teams that the page draws, the best first.
MOST_DRAWN = 16


class Plan:
    """A finished plan: its `folder`, and its `record` (`plan.json`)."""

    def __init__(self, folder: Path, record: Mapping[str, Any]) -> None:
        self.folder, self.record = folder, record

    def __repr__(self) -> str:
        answer = "no team" if self.answer is None else f"{self.answer['asvs.count']} ASVs"
        return f"<Plan {self.record['name']}: {answer}, in {self.folder}>"

    @property
    def answer(self) -> dict[str, Any] | None:
        """The keys and values of the least team; None if no team is shown to meet the goals."""
        answer: dict[str, Any] | None = self.record["answer"]
        return answer

    @property
    def scenario(self) -> Scenario | None:
        """The scenario of the answer, or None."""
        if self.answer is None:
            return None
        from ...core.scenario.files.scenario_file import load_scenario

        return load_scenario(self.folder / BEST)

    @property
    def campaign(self) -> Campaign:
        """The missions that selected the team."""
        return unfinished_campaign(self.folder / MISSIONS)

    def summary(self) -> str:
        """Return the text that the command prints."""
        return summary(self.record, str(self.folder))


class HowToPlan(TypedDict, total=False):
    """Settings of :func:`plan`, which explains them."""

    confidence: float
    budget_s: float
    budget_missions: int
    seed: int
    survive: int
    workers: int | None
    force: bool
    quiet: bool


def plan(
    scenario: str | Path | Scenario,
    out: str | Path | None = None,
    *,
    below: Mapping[str, float] | None = None,
    above: Mapping[str, float] | None = None,
    of: Of | None = None,
    vary: Mapping[str, Iterable[Any]] | None = None,
    allow_plugins: bool = False,
    **how: Unpack[HowToPlan],
) -> Plan:
    """Return the least team of ASVs that meets the goals, with the stated confidence.

    `scenario` is a scenario, the path of one or of a plan's file, or the name of one that ships.
    `below` and `above` map metrics to limits; they judge each mission's worst AUV, or `of` the
    "mean", or a share of the AUVs (0.8).  `vary` maps dotted keys to the values that may be chosen;
    for other numbers of ASVs, formations, schedules and downlinks the plan proposes values.  The
    folder `out` keeps the plan, and continues one of the same question that was cut short; without
    it the plan lies in a temporary folder, which is removed with the plan.

    The plan stops when the answer is settled, which only its missions decide; `budget_missions` and
    `budget_s` (seconds of simulation) may stop it earlier, which the record says (`settled`).

    Settings: `survive` (0; goals hold with any so many vessels lost, from the start or halfway),
    `confidence` (0.95), `budget_missions` and `budget_s` (None), `seed` (0), `workers` (processes,
    by default one for each CPU), `force` (False) and `quiet` (True but in notebooks).

    Raises:
        ScenarioError: when a file, a key, a value or a goal is wrong, listing every mistake.
        TypeError: when an argument has another type, or a name that does not exist.
        PluginError: when a user-defined part is not allowed.
        CampaignError: when the folder holds something else.
        NotWritten: when the disk is full or the folder gone; finished missions count.
    """
    for name in how:
        if name not in HowToPlan.__annotations__:
            hint = did_you_mean(name, (*HowToPlan.__annotations__, "below", "above", "of", "vary"))
            raise TypeError(f"plan has no argument {name!r}{hint}")
    asking = Asking(
        goals_of_arguments(below, above, of),
        of,
        PythonArguments(vary),
        how,
        allow_plugins,
    )
    question = read_plan(located(scenario) if isinstance(scenario, str) else scenario, asking)
    admitted(question, allow_plugins)
    budget = Budget(question, quiet=how.get("quiet", not in_notebook()))
    if out is not None:
        begun = begin(question, Path(out), force=how.get("force", False))
        return planned(begun, Path(out), budget, how.get("workers"))
    folder = Path(mkdtemp(prefix="bindusbl-plan-"))
    try:
        made = planned(begin(question, folder), folder, budget, how.get("workers"))
    except BaseException:
        rmtree(folder, ignore_errors=True)
        raise
    finalize(made, remove_own, folder, os.getpid())
    return made


def admitted(question: Question, allow_plugins: bool) -> None:
    """Load a question's user-defined parts and compute its stations.

    Raises:
        PluginError: when a part is not allowed.
    """
    check_plugins(Missions(question.experiment), allow_plugins)
    for point in range(len(question.experiment.points)):
        _ = Setup.of(question.experiment.scenario(point)).kept_stations_m


def planned(question: Question, folder: Path, budget: Budget, workers: int | None = None) -> Plan:
    """Find the least team that meets the goals, and write the plan's files.

    Raises:
        CampaignError: when another process works in the folder, or it holds other missions.
        KeyboardInterrupt: when interrupted; finished missions are kept and not repeated.
        NotWritten: when the folder cannot be written; finished missions are kept.
    """
    goals = question.goals
    try:
        with local_workers(workers) as pool:

            def fly(
                flown: Sequence[Team], seeds: range, name: str, losing: bool = False
            ) -> AbstractContextManager[Flights]:
                points = [team.keys for team in flown]
                losses: dict[int, Sequence[int]] = {}
                for number, team in enumerate(flown if losing else ()):
                    before = len(points)
                    points += team.losses()
                    losses[number] = range(before, len(points))
                given, asked = question.experiment.given, wanted(goals)
                missions = Experiment(question.name, given, tuple(points), tuple(seeds))
                return flights(
                    missions, folder / name, asked, pool, budget.note, limit_of(goals), losses
                )

            teams, left_out = narrowed(proposed(question, budget.begin))
            budget.begin(f"choosing among {counted(len(teams), 'team')}{_each_seed(teams)}")
            with fly(teams, question.seeds(), MISSIONS, losing=True) as missions:
                sample = partial(budget.sample, missions, goals)

                def note(selection: Selection) -> None:
                    budget.best = best_text(goals, teams, selection)

                selection = select(
                    [Choice(team.cost, team.values) for team in teams],
                    sample,
                    goals,
                    confidence=question.confidence,
                    most_seeds=len(question.seeds()),
                    note=note,
                )
                selection = with_costlier(selection, teams, goals, sample)
                number = _looked_at(teams, goals, selection)
                is_found = selection.answer is not None and not budget.cut_by
                conditions = doubts(teams[number]) if is_found else []
                rows, flown_in_doubt, failed_in_doubt = list[dict[str, Any]](), 0, ""
                if conditions:
                    budget.begin(f"doubting the answer, {cost_of(conditions)}")
                    fresh = range(len(question.seeds()))[-SEEDS:]  # which selected no team
                    seeds = question.seeds()[-SEEDS:]
                    with fly(teams_of(conditions), seeds, DOUBTS) as doubtful:
                        whole = question.whole_goals
                        planned = partial(budget.sample, missions, whole)
                        rows = doubted(
                            conditions,
                            whole,
                            partial(budget.sample, doubtful, whole),
                            lambda seeds: planned([(number, fresh[seed]) for seed in seeds]),
                        )
                        flown_in_doubt, failed_in_doubt = len(doubtful), doubtful.failed
    finally:
        budget.end()
    outcome = Outcome(
        question=question,
        teams=teams,
        selection=selection,
        left_out=left_out,
        reliefs=[] if budget.cut_by else binding(teams[number]),
        further="" if is_found else further(teams),
        doubted=rows,
        missions=len(missions) + flown_in_doubt,
        cut=budget.cut_by,
        failed=missions.failed or failed_in_doubt,
    )
    return _written(outcome, folder)


def _each_seed(teams: Sequence[Team]) -> str:
    """Return how many missions a seed takes with all losses of vessels; "" without losses."""
    most = max((len(team.lost) for team in teams), default=0)
    return f", each seed in up to {1 + 2 * most} missions" if most else ""


def _looked_at(teams: Sequence[Team], goals: Sequence[Goal], selection: Selection) -> int:
    """Return the number of the answer, or else of the nearest team."""
    if selection.answer is not None:
        return selection.answer
    flown = ranked(goals, teams, selection)
    return flown[0] if flown else min(range(len(teams)), key=lambda n: teams[n].rank)


def _written(outcome: Outcome, folder: Path) -> Plan:
    """Write the files of a plan, `plan.json` last; return the plan.

    Raises:
        OSError: when a file cannot be written.
    """
    question, team = outcome.question, outcome.team
    scenario = question.source or str(folder / MISSIONS / "scenario.yaml")
    file, flown = (str(folder / BEST), team.scenario) if team else (scenario, question.base)
    ways = _ways(outcome)
    plan_record = record(outcome, f"bindusbl-des run {quote(file)}{flown.leave}", ways)
    plan_record["scenario"] = scenario
    if team is None:
        (folder / BEST).unlink(missing_ok=True)
    else:
        write_text(folder / BEST, best_yaml(team.scenario, plan_record["told"][0]))
    drawn = {number: outcome.teams[number].setup for number in outcome.ranked[:MOST_DRAWN]}
    moving = {} if ways is None or outcome.shown is None else {outcome.shown: ways}
    chart = chart_of(drawn, moving) if drawn else None
    write_text(folder / PAGE, plan_page(plan_record, chart))
    text = json.dumps(plan_record, indent=2, allow_nan=False, ensure_ascii=False)
    write_text(folder / PLAN, f"{text}\n")
    return Plan(folder, plan_record)


def _ways(outcome: Outcome) -> dict[str, Any] | None:
    """Return the tracks of the drawn team's vessels in the plan's first mission, if they move."""
    if outcome.shown is None or not outcome.teams[outcome.shown].moves:
        return None
    team, seed = outcome.teams[outcome.shown].scenario, outcome.question.seeds()[0]
    full = Record(detail="full", metrics_from_s=team.record.metrics_from_s)
    tracks = simulate(team.model_copy(update={"record": full}), seed).tables["tracks"]
    asvs = []
    for asv in (f"ASV{number}" for number in range(team.asvs.count)):
        rows = tracks.loc[tracks.vehicle == asv, ["x_m", "y_m"]].to_numpy()
        asvs.append({"asv": asv, "places_m": thinned(rows).round(2).tolist()})
    return {"seed": seed, "asvs": asvs}
