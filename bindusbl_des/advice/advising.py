"""A plan's advice: what could be changed is tried beside it, and what was measured is said."""

from collections.abc import Callable, Sequence
from math import isfinite
from typing import TYPE_CHECKING

from ..core.wording import counted
from ..results.effects import FILTER, GAIN, Advice, Effect
from ..scenario.declared import navigator_of
from ..scenario.files.mistakes import ScenarioError
from ..scenario.files.scenario_file import parse_scenario
from ..scenario.scenario import Scenario
from .changes import Change, changed, proposals
from .choosing import Race
from .measuring import FEWEST_SEEDS, effect, harms, may_harm, measured
from .trials import FEWEST, OutOfMissions, Told, Trials, missions_for

if TYPE_CHECKING:
    from ..results.result import Result

# Reads the user's scenario again with further `--set` options laid over it.
Reader = Callable[[Sequence[str]], Scenario]

# A race on these seeds after the mission's own, and measurements on those.
CHOOSING, MEASURING = 1, 1001
# Half of the missions to choose, half to measure what was chosen.
SHARE_TO_CHOOSE = 0.5


def advise(
    result: "Result",
    seconds: float | None = None,
    *,
    missions: int | None = None,
    again: Reader | None = None,
    progress: Told = lambda flown, left: None,
) -> Advice:
    """Return what would change the worst AUV's error of a mission, as measured in other missions.

    Changes are chosen and measured in so many `missions`, with other seeds than its own: by default
    as many as the scenario's size allows in some seconds (20 to 150, or none where one mission is
    too long), so that the same mission has the same advice on any machine.  After `seconds`, in
    which compiling does not count, none is begun any more, and the advice says that it was cut.
    `again` reads the scenario as the user wrote it: what is proposed can be laid over that with
    `--set`, and gives what was measured.  `progress` hears after each mission how many were flown
    and how many are left.  Assign the advice to `result.advice` to have it in its summary, its
    report and its folder.

    Raises:
        ValueError: when `seconds` is no finite number, or `missions` below 0.
    """
    if seconds is not None and not isfinite(seconds):
        raise ValueError(f"advice takes a finite time; met {seconds}; give seconds")
    if missions is not None and missions < 0:
        raise ValueError(f"advice needs 0 missions or more; met {missions}")
    scenario = result.scenario
    most = missions_for(scenario) if missions is None else missions
    trials = Trials(scenario, most, seconds, progress)
    changes, needless = proposals(result)
    race = Race(trials, changes, result.seed + CHOOSING)
    try:
        race.run(int(SHARE_TO_CHOOSE * most))
    except OutOfMissions:
        return Advice(
            most,
            seconds,
            untried=_words(changes),
            needless=tuple(needless),
            shortage=_short(trials, most),
            is_cut=trials.is_cut,
        )
    except ValueError as error:
        return Advice(most, shortage=f"the plan cannot be flown with another seed: {error}")
    reader = again or _as_it_was_run(scenario)
    first = (GAIN, FILTER) if may_harm(trials.unchanged(race.seeds)) else ()
    chosen = [it for it in race.promising(first) if _can_be_said(it, scenario, reader)]
    finalists, seeds = measured(trials, chosen, result.seed + MEASURING)
    together = len(finalists) + 1  # and whether fixes do harm
    effects = _effects(trials, finalists, seeds, together)
    unchanged = trials.unchanged([*race.seeds, *seeds])
    said = {*race.inert, *(it for it in finalists if it.words in {e.words for e in effects})}
    unknown = chosen if race.tried else changes  # what might help, had there been missions
    return Advice(
        budget_missions=most,
        budget_s=seconds,
        is_cut=trials.is_cut,
        missions=trials.missions,
        error_m=_mean([it.error for it in trials.unchanged(seeds)]),
        effects=tuple(effects),
        harms=tuple(harms(unchanged, together)),
        harm_seeds=len(unchanged) if len(unchanged) >= FEWEST_SEEDS else 0,
        inert=_words(race.inert),
        needless=tuple(needless),
        dropped=_words([it for it in race.tried if it not in said]),
        untried=_words(race.untried),
        shortage=_short(trials, most) if unknown and not effects else "",
        fixed_gain=navigator_of(scenario).has_gain,
    )


def _as_it_was_run(scenario: Scenario) -> Reader:
    text = scenario.model_dump_json()  # JSON is YAML
    return lambda options: parse_scenario(text, overrides=options)


def _can_be_said(change: Change, scenario: Scenario, reader: Reader) -> bool:
    """Tell whether the options of a change, laid over the user's scenario, are that change."""
    try:
        return reader(change.lines) == changed(scenario, change.settings)
    except ScenarioError:
        return False


def _effects(
    trials: Trials, finalists: Sequence[Change], seeds: list[int], together: int
) -> list[Effect]:
    """Return the effects of what was measured, the best first."""
    error = _mean([it.error for it in trials.unchanged(seeds)]) or 0.0
    found = [(change, trials.differences(change, seeds)) for change in finalists]
    known = [it for it in found if len(it[1]) >= FEWEST_SEEDS]
    effects = [effect(change, it, error, together) for change, it in known]
    return sorted(effects, key=lambda it: it.mean_m)


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _words(changes: Sequence[Change]) -> tuple[str, ...]:
    return tuple(it.words for it in changes)


def _short(trials: Trials, most: int) -> str:
    """Return why too few missions were flown, and what would be enough."""
    flown = counted(trials.spent, "mission")
    if trials.is_cut:
        return f"it was cut off after {flown}; give --advice-s more, or leave it out"
    if not most:
        return f"missions this large are not tried unasked; --advice-missions {FEWEST} does it"
    are = "is" if trials.spent == 1 else "are"
    return f"{flown} {are} too few for any change; try --advice-missions {max(4 * most, FEWEST)}"
