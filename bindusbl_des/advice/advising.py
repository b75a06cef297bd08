"""What could be changed about a plan, tried beside it, and what was measured, on seeds that had no
part in choosing.
"""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from ..campaigns.statistics.intervals import intervals
from ..core.arrays import Floats
from ..core.mistakes import ScenarioError
from ..core.wording import counted
from ..results.effects import (
    FILTER,
    GAIN,
    HARMS,
    HELPS,
    NEGLIGIBLE,
    NO_EFFECT,
    Advice,
    Effect,
    Harm,
)
from ..scenario.files.scenario_file import Source
from ..scenario.scenario import Scenario
from .changes import Change, changed, proposals
from .choosing import (
    AS_IT_IS,
    FEWEST,
    WORTHWHILE,
    OutOfMissions,
    Progress,
    Race,
    Trial,
    Trials,
    missions_for,
)

if TYPE_CHECKING:
    from ..results.result import Result


# No more changes than a reader compares, and no more seeds than intervals need to be narrow.
MOST_CHANGES, MOST_SEEDS = 6, 20
# Whether fixes do harm shows at once, or it is little.
SEEDS_OF_NONE = 6
# Rather fewer changes than fewer seeds for each: Student's t is wide for few.
FEWEST_SEEDS, ENOUGH_SEEDS, SEEDS_EACH = 3, {2: 4}, 5


def measured(
    trials: Trials, chosen: Sequence[Change], first_seed: int
) -> tuple[list[Change], list[int]]:
    """Fly the most promising of the chosen changes on fresh seeds; return which, and the seeds.

    How many depends on the missions there are, never on a result, so that none can end the trials.
    """
    count = min(len(chosen), MOST_CHANGES)
    while count > 1 and trials.left // (1 + count) < ENOUGH_SEEDS.get(count, SEEDS_EACH):
        count -= 1
    now, left = list(chosen[:count]), trials.left // (1 + count)
    most = max(FEWEST_SEEDS, min(left, MOST_SEEDS if now else SEEDS_OF_NONE))
    seeds = list(range(first_seed, first_seed + most))
    with suppress(OutOfMissions):
        for seed in seeds:
            for change in (AS_IT_IS, *now):
                with suppress(ValueError):  # it cannot be flown at one of the seeds
                    trials.fly(change, seed)
    return now, seeds


def effect(change: Change, differences: Floats, error: float, together: int) -> Effect:
    """Return what differences (m) of the worst AUV's error, `error` m as it is, say of a change.

    The interval is one of so many that hold `together` with 95 %.
    """
    found = intervals(differences[None], together).at(0)
    if found.high < 0:
        verdict = HELPS if -found.mean >= WORTHWHILE * error else NEGLIGIBLE
    else:
        verdict = HARMS if found.low > 0 else NO_EFFECT
    known = found.mean, found.low, found.high, found.count
    return Effect(change.kind, change.words, change.lines, *known, verdict)


def may_harm(missions: Sequence[Trial]) -> bool:
    """Tell whether fixes raise any AUV's mean error over these missions, be it by chance."""
    with_fixes, without = np.mean([mission.own for mission in missions], axis=0).T
    return bool(np.any(with_fixes > without))


def harms(missions: Sequence[Trial], together: int = 1) -> list[Harm]:
    """Return the AUVs whose error fixes raise, the worst first.

    What is said of the whole fleet is one of so many statements that hold `together` with 95 %.
    """
    if len(missions) < FEWEST_SEEDS:
        return []
    own = np.stack([mission.own for mission in missions])
    found = []
    for auv in range(own.shape[1]):
        with_fixes, without = own[:, auv].T
        worse = intervals((with_fixes - without)[None], own.shape[1] * together).at(0)
        means = float(with_fixes.mean()), float(without.mean())
        if worse.low > 0 and worse.mean > WORTHWHILE * means[1]:
            known = worse.mean, worse.low, worse.high
            found.append(Harm(f"AUV{auv}", *means, *known, worse.count))
    return sorted(found, key=lambda harm: -harm.mean_m)


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
    progress: Progress = lambda flown, left: None,
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
    setup = result.setup
    most = missions_for(setup) if missions is None else missions
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
    chosen = [change for change in race.promising(first) if _can_be_said(change, scenario, reader)]
    finalists, seeds = measured(trials, chosen, result.seed + MEASURING)
    together = len(finalists) + 1  # and whether fixes do harm
    effects = _effects(trials, finalists, seeds, together)
    unchanged = trials.unchanged([*race.seeds, *seeds])
    said = {*_words(race.inert), *(effect.words for effect in effects)}
    unknown = chosen if race.tried else changes  # what might help, had there been missions
    return Advice(
        budget_missions=most,
        budget_s=seconds,
        is_cut=trials.is_cut,
        missions=trials.missions,
        error_m=_mean([trial.error for trial in trials.unchanged(seeds)]),
        effects=tuple(effects),
        harms=tuple(harms(unchanged, together)),
        harm_seeds=len(unchanged) if len(unchanged) >= FEWEST_SEEDS else 0,
        inert=_words(race.inert),
        needless=tuple(needless),
        dropped=tuple(words for words in _words(race.tried) if words not in said),
        untried=_words(race.untried),
        shortage=_short(trials, most) if unknown and not effects else "",
        fixed_gain=setup.navigator.has_gain,
    )


def _as_it_was_run(scenario: Scenario) -> Reader:
    source = Source(scenario.model_dump_json())  # JSON is YAML
    return lambda options: source._replace(overrides=tuple(options)).read()[1]


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
    error = _mean([trial.error for trial in trials.unchanged(seeds)]) or 0.0
    effects = [
        effect(change, differences, error, together)
        for change in finalists
        if len(differences := trials.differences(change, seeds)) >= FEWEST_SEEDS
    ]
    return sorted(effects, key=lambda outcome: outcome.mean_m)


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _words(changes: Iterable[Change]) -> tuple[str, ...]:
    return tuple(change.words for change in changes)


def _short(trials: Trials, most: int) -> str:
    """Return why too few missions were flown, and what would be enough."""
    flown = counted(trials.spent, "mission")
    if trials.is_cut:
        return f"it was cut off after {flown}; give --advice-s more, or leave it out"
    if not most:
        return f"missions this large are not tried unasked; --advice-missions {FEWEST} does it"
    are = "is" if trials.spent == 1 else "are"
    return f"{flown} {are} too few for any change; try --advice-missions {max(4 * most, FEWEST)}"
