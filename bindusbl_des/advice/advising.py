"""A plan's advice: what could be changed is tried beside it, and what was measured is said."""

from collections.abc import Callable, Sequence
from math import ceil, isfinite
from typing import TYPE_CHECKING

from ..results.effects import FILTER, GAIN, Advice, Effect
from ..scenario.files.mistakes import ScenarioError
from ..scenario.files.scenario_file import parse_scenario
from ..scenario.scenario import Scenario
from .changes import Change, changed, proposals
from .choosing import Race
from .measuring import FEWEST_SEEDS, effect, harms, may_harm, measured
from .trials import OutOfTime, Told, Trials

if TYPE_CHECKING:
    from ..results.result import Result

# Reads the user's scenario again with further `--set` options laid over it.
Reader = Callable[[Sequence[str]], Scenario]

# A race on these seeds after the mission's own, and measurements on those.
CHOOSING, MEASURING = 1, 1001
# Half of the time to choose, half to measure what was chosen.
SHARE_TO_CHOOSE = 0.5
# So many missions are enough to choose well and to measure what was chosen.
MANY_MISSIONS = 150


def advise(
    result: "Result",
    seconds: float = 3.0,
    *,
    again: Reader | None = None,
    progress: Told | None = None,
) -> Advice:
    """Return what would change the worst AUV's error of a mission, as measured in so many seconds.

    Changes are chosen and measured in missions with other seeds than its own, which take `seconds`
    of wall time together, besides up to 10 s of compiling where code is used for the first time.
    `again` reads the scenario as the user wrote it: what is proposed can be laid over that with
    `--set`, and gives what was measured.  `progress` hears now and then how many missions were
    flown and how much time (s) is left.  Assign the advice to `result.advice` to have it in its
    summary, its report and its folder.

    Raises:
        ValueError: when `seconds` is no finite number.
    """
    if not isfinite(seconds):
        raise ValueError(f"advice takes a finite time; met {seconds}; give seconds")
    scenario = result.scenario
    trials = Trials(scenario, seconds, progress)
    changes, needless = proposals(result)
    race = Race(trials, changes, result.seed + CHOOSING)
    try:
        race.run(SHARE_TO_CHOOSE * seconds)
    except OutOfTime:
        short = _short(trials.quickest or result.wall_time_s)
        return Advice(seconds, untried=_words(changes), needless=tuple(needless), shortage=short)
    except ValueError as error:
        return Advice(seconds, shortage=f"the plan cannot be flown with another seed: {error}")
    reader = again or _as_it_was_run(scenario)
    first = (GAIN, FILTER) if may_harm(trials.unchanged(race.seeds)) else ()
    chosen = [it for it in race.promising(first) if _can_be_said(it, scenario, reader)]
    finalists, seeds = measured(trials, chosen, result.seed + MEASURING)
    together = len(finalists) + 1  # and whether fixes do harm
    effects = _effects(trials, finalists, seeds, together)
    unchanged = trials.unchanged([*race.seeds, *seeds])
    said = {*race.inert, *(it for it in finalists if it.words in {e.words for e in effects})}
    unknown = chosen if race.tried else changes  # what might help, had there been time
    return Advice(
        budget_s=seconds,
        missions=trials.missions,
        error_m=_mean([it.error for it in trials.unchanged(seeds)]),
        effects=tuple(effects),
        harms=tuple(harms(unchanged, together)),
        harm_seeds=len(unchanged) if len(unchanged) >= FEWEST_SEEDS else 0,
        inert=_words(race.inert),
        needless=tuple(needless),
        dropped=_words([it for it in race.tried if it not in said]),
        untried=_words(race.untried),
        shortage=_short(trials.quickest or result.wall_time_s) if unknown and not effects else "",
        fixed_gain=scenario.navigation.filter == "fixed_gain",
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


def _short(mission_s: float) -> str:
    """Return that the time was too short, and how much would be enough."""
    enough = ceil(MANY_MISSIONS * mission_s)
    return (
        f"one mission takes {mission_s:.2g} s, too long to measure any change in the time given; "
        f"try --advice-s {enough}"
    )
