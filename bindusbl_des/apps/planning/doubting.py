"""The answer under worse conditions than the scenario's, and dearer teams in a few missions.

The missions use seeds that did not select the answer, since those flatter it.  A crew does not know
of a worse condition, so filters keep the scenario's errors as their model.  Conditions that a
filter could know of are simulated twice, also with a filter that knows.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np

from ...core.geometry.formation import ring_radius
from ...core.scenario.agreement.instruments import ASSUMED
from ...core.scenario.files.overrides import put
from ...core.scenario.sections.navigation import Drift
from ...core.scenario.sections.usbl import UsblSection
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.plain_data import value_at
from ..campaigns.statistics.intervals import Intervals, intervals
from ..preflight.fix_chance import loses_pings
from .goals import Goal, unit_of_goal
from .selecting import (
    SPENT,
    CutOff,
    Estimate,
    Evidence,
    Sample,
    Selection,
    estimated,
    looks_at_each,
)
from .teams import FORMATION, RADIUS, Keys, Team, excess, place_keys

# Missions of each dearer team: FIRST if half the 95 % interval of each goal's mean is below this
# share of the mean then, else ALL.
FIRST, ALL = 4, 8
NARROW = 0.1


def with_costlier(
    selection: Selection, teams: Sequence[Team], goals: Sequence[Goal], sample: Sample
) -> Selection:
    """Return a selection with estimates of the first team of each cost that was not simulated.

    Teams of one cost are sorted by prediction, so that the first is the best.  Verdicts stay, since
    so few missions decide nothing.
    """
    first: dict[float, int] = {}
    for number, team in enumerate(teams):
        first.setdefault(team.cost, number)
    shown = [n for n in first.values() if selection.verdicts[n] == "not needed"]
    values = {n: np.empty((0, len(goals))) for n in shown if not selection.missions[n]}
    for seeds in (FIRST, ALL):
        wide = [n for n, known in values.items() if not _is_narrow(intervals(known.T))]
        pairs = [(n, seed) for n in wide for seed in range(len(values[n]), seeds)]
        found = sample(pairs)
        if not wide or len(found) < len(pairs):
            break
        for n, own in zip(wide, np.split(found, len(wide)), strict=True):
            values[n] = np.concatenate([values[n], own])
    estimates, missions = list(selection.estimates), list(selection.missions)
    for n, known in values.items():
        if len(known):
            estimates[n], missions[n] = tuple(map(estimated, known.T)), len(known)
    return replace(selection, estimates=tuple(estimates), missions=tuple(missions))


def _is_narrow(means: Intervals) -> bool:
    """Tell whether the intervals of all goals' means are narrow enough."""
    return bool(np.all(means.half_width <= NARROW * np.abs(means.mean)))


# Factors of acoustic ranges, of the assumed speed of sound, and of the drift of dead reckoning.
SHORTER, FASTER, DRIFTIER = 0.8, 1.01, 2.0

# The factor of a burst's duration, and the duration (s) where losses are independent: some rounds.
LONGER, BURST_S = 3.0, 10.0

# The divisor of the length of line over which scale and heading change, and the usual length (m).
SOONER, USUAL_LINE_M = 3.0, Drift.model_fields["line_m"].default

# The slow share of the USBL's error variance, its time constant (s), and the misalignment (deg,
# standard deviation); a scenario that has as much gets a longer time, or twice the misalignment.
SLOW, SLOW_S, ASKEW_DEG = 0.9, 600.0, 1.0

# The confidence of a verdict under a condition, and the most missions for it.
CONFIDENCE, SEEDS = 0.95, max(SPENT)

HF, MF = "acoustics.hf", "acoustics.mf"
NAVIGATION, GROUPS = "navigation", "auvs.groups"
# Keys of drift as data sheets state it, and keys of single sources of drift
STATED = ("percent_of_distance", "m_per_hour")
DRIFTS = (
    "velocity_bias_m_per_s",
    "velocity_bias_sd_m_per_s",
    "random_walk_m_per_sqrt_s",
    "scale_factor_sd",
    "heading_sd_deg",
)


@dataclass(frozen=True)
class Doubt:
    """A worse condition: its name, its words, the keys that make it, and the team in it.

    `without` is the team without the condition over the same time; None means the answer.  `known`
    tells that filters know of the condition.
    """

    what: str
    words: str
    keys: Keys
    team: Team
    without: Team | None = None
    known: bool = False


def doubts(team: Team) -> list[Doubt]:
    """Return the conditions in which a team is simulated, without those that are no valid scenario.

    If filters can know of a condition, it comes twice: unknown and known to them.
    """
    found = []
    for what, words, keys in worse(team):
        for known, assumed in enumerate(_assumed(team, keys)):
            whole = {**keys, **assumed}
            if changed := team.changed(whole):
                told = f"{words}, known to the filter" if known else words
                found.append(Doubt(what, told, whole, changed, known=bool(known)))
    return [*found[:1], *_lost(team), *found[1:]]


def worse(team: Team) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield the worse conditions of a team: a name, words, and the keys that make them."""
    setup, scenario = team.setup, team.scenario
    is_heard = team.asvs > 0 or scenario.has_peers
    bands = {HF: scenario.acoustics.hf, MF: scenario.acoustics.mf}
    # A range ends reception only with a disc.
    discs = [name for name, band in bands.items() if band.traits.ends_at_range]
    if discs and is_heard:
        ranges = {f"{name}.range_m": _rounded(SHORTER * bands[name].range_m, 6) for name in discs}
        which = "ranges" if len(discs) == len(bands) else f"{discs[0][-2:].upper()} range"
        yield "ranges", f"{which} {100 * (SHORTER - 1):+.0f} %", {**ranges, **_kept(team)}
    lossy = [HF] if is_heard and loses_pings(setup) else []
    if team.asvs and scenario.protocol.sends_frames and not bands[MF].traits.keeps_frames:
        lossy.append(MF)
    bursts = {name: burst for name in lossy if (burst := bands[name].burst_s) is not None}
    if bursts:
        lasts = {name: _rounded(LONGER * burst, 3) for name, burst in bursts.items()}
        words = f"losses last {LONGER:g} times as long"
    else:
        lasts = dict.fromkeys(lossy, BURST_S)
        words = f"losses last {BURST_S:g} s, not one by one"
    if lasts:
        bursts = {f"{name}.channel.burst_s": burst for name, burst in lasts.items()}
        yield "bursts", words, bursts
    if is_heard:
        faster = _rounded(FASTER * setup.assumed_sound_speed_m_per_s, 6)
        words = f"speed of sound taken {100 * (FASTER - 1):.0f} % too high"
        yield "sound_speed", words, {"environment.assumed_sound_speed_m_per_s": faster}
    if team.asvs and not scenario.usbl.model.is_own:
        yield from _worse_fixes(scenario.usbl)
    yield from _worse_drift(setup)


def _worse_drift(setup: Setup) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield worse dead reckoning, of each group of AUVs by the keys that say what theirs is."""
    twice, sooner, words = dict[str, Any](), dict[str, Any](), dict[str, None]()
    for group in setup.groups:
        navigation, key = group.navigation, group.key("drift")
        sheet = {
            f"{key}.{name}": size
            for name in STATED
            if (size := getattr(navigation.drift, name)) is not None
        }
        single = {group.key(name): getattr(navigation, name) for name in DRIFTS}
        for name, size in (sheet or single).items():
            if np.any(size):
                twice[name] = (DRIFTIER * np.array(size)).tolist()
        line = navigation.drift.line_m
        if setup.drift_line_m(group) or (navigation.drift.is_stated and line is None):
            shorter = USUAL_LINE_M if line is None else max(line / SOONER, 1.0)  # the key allows
            sooner[f"{key}.line_m"] = _rounded(shorter, 3)
            words[f"{shorter:.3g} m, not {'at all' if line is None else f'{line:g}'}"] = None
    if twice:
        yield "drift", f"drift x {DRIFTIER:g}", twice
    if sooner:
        yield "drift_line", f"drift wanders over {' and '.join(words)}", sooner


def _worse_fixes(usbl: UsblSection) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield worse conditions of fixes: slow errors, and misaligned arrays."""
    share, lasts, off = max(usbl.slow_share, SLOW), SLOW_S, ASKEW_DEG
    if share == usbl.slow_share and lasts <= usbl.correlation_s:
        lasts = LONGER * usbl.correlation_s
    if off <= usbl.misalignment_sd_deg:
        off = 2.0 * usbl.misalignment_sd_deg
    slow = {"usbl.slow_share": share, "usbl.correlation_s": lasts}
    yield "slow", f"{100 * share:.3g} % of the USBL's errors last {lasts / 60.0:.3g} min", slow
    yield "misalignment", f"misalignment of {off:.3g} deg", {"usbl.misalignment_sd_deg": off}


def _rounded(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _assumed(team: Team, changed: Keys) -> list[dict[str, Any]]:
    """Return the keys that keep a team's filter as planned under `changed` keys, and those by which
    it knows of them; {} alone if the filter models none.
    """
    navigation = team.scenario.navigation
    names = {key: key.split(".") for key in changed}
    modelled = {key: path for key, path in names.items() if path[1] in ASSUMED.get(path[0], ())}
    for key in [key for key in modelled if key.startswith(GROUPS)]:  # as a whole
        del modelled[key]
        modelled[GROUPS] = GROUPS.split(".")
    if not navigation.weighs or not modelled:
        return [{}]
    planned = team.setup.taken.scenario.model_dump(mode="json")
    own = dict(navigation.filter.settings.get("assumes", {}))
    assumes, known = deepcopy(own), deepcopy(own)
    for key, path in modelled.items():
        put(assumes, key, value_at(planned, path))
        known.get(path[0], {}).pop(path[1], None)
    where = f"{NAVIGATION}.filter.assumes"
    return [{where: assumes}, {where: known} if known != own else {}]


def _kept(team: Team) -> dict[str, Any]:
    """Return the keys that keep a ring's radius, which by default grows with the HF range."""
    asked = team.scenario.asvs.formation.moored
    if asked is None or asked.is_placed or asked.radius_m is not None or team.asvs <= 1:
        return {}
    cleared = {f"{FORMATION}.clearance_m": 0.0} if asked.clearance_m else {}
    return {**cleared, RADIUS: _rounded(ring_radius(team.stations), 9)}


def _lost(team: Team) -> list[Doubt]:
    """Return the team without its most important vessel, as predicted, and with it until halfway.

    Of vessels that move, which are not predicted, and of a single one, the first is lost halfway
    only.
    """
    if not team.is_moored and not team.moves:
        return []
    rests: dict[int, Doubt] = {}
    for lost in range(0 if team.moves or team.asvs == 1 else team.asvs):
        keys = place_keys(team.question, np.delete(team.stations, lost, axis=0))
        groups = [
            {**group.model_dump(mode="json", exclude_unset=True), "count": left}
            for group, vessels in zip(team.scenario.asvs.groups, team.setup.vessels, strict=False)
            if (left := group.count - (lost in vessels.members))
        ]
        if groups:
            keys["asvs.groups"] = groups
        if rest := team.placed(keys):
            rests[lost] = Doubt("lost", f"ASV{lost} lost", keys, rest)
    lost = max(rests, key=lambda lost: (rests[lost].team.rank, -lost), default=0)
    found = [rests[lost]] if rests else []
    failures = [failure.model_dump(mode="json") for failure in team.scenario.asvs.failures]
    halfway = team.scenario.duration_s / 2
    after = {"record.metrics_from_s": halfway}  # else the first half would hide the loss
    keys = {"asvs.failures": [*failures, {"asv": lost, "at_s": halfway}], **after}
    fails, without = team.changed(keys), team.changed(after)
    if fails is not None and without is not None:
        words = f"ASV{lost} lost halfway, from then on"
        found.append(Doubt("lost_halfway", words, keys, fails, without))
    return found


def teams_of(conditions: Sequence[Doubt]) -> list[Team]:
    """Return the teams to simulate: those in the conditions, then those without."""
    without = [condition.without for condition in conditions if condition.without is not None]
    return [*(condition.team for condition in conditions), *without]


def cost_of(conditions: Sequence[Doubt]) -> str:
    """Return in words how many missions the conditions take, with their comparisons."""
    without = 1 + len(teams_of(conditions)) - len(conditions)  # including the answer
    least = (len(conditions) + without) * min(SPENT)
    most = sum(min(SPENT) if condition.known else SEEDS for condition in conditions)
    most += without * SEEDS
    return f"{least} to {most} missions"


def doubted(
    conditions: Sequence[Doubt],
    goals: Sequence[Goal],
    sample: Sample,
    answer: Callable[[Sequence[int]], Floats],
) -> list[dict[str, Any]]:
    """Simulate a team in each condition, and without it on the same seeds, until it has a verdict.

    Returns the rows `sensitivity` of `plan.json`.  Conditions that the filter knows of, which no
    crew can rely on, get the fewest seeds.  `sample` simulates :func:`teams_of` the conditions,
    `answer` the answer at seeds (numbers); if they return too few missions, rows are missing.
    `met` is None if undecided; the answer itself meets the goals.
    """
    looks = looks_at_each(CONFIDENCE, len(goals))
    evidence = Evidence(len(conditions), goals, looks, 0.0, sample)
    numbers = range(len(conditions))
    with suppress(CutOff):
        for look in range(len(looks)):
            unknown = [
                number
                for number in numbers
                if evidence.verdicts[number] is None and not (look and conditions[number].known)
            ]
            evidence.fly(unknown, look)
            for number in unknown:
                evidence.judge(number, look)
    is_met = {"met": True, "not met": False}
    rows, extra = [], len(conditions)
    for number, condition in enumerate(conditions):
        seeds = range(evidence.missions(number))
        if condition.without is None:
            as_planned = answer(seeds)
        else:
            as_planned = sample([(extra, seed) for seed in seeds])
            extra += 1
        if len(seeds) and len(as_planned) == len(seeds):
            planned = tuple(map(estimated, as_planned.T))
            kept = True if condition.without is None else _surely_met(goals, planned)
            apart = evidence.values(number) - as_planned
            rows.append(
                {
                    "what": condition.what,
                    "told": condition.words,
                    "keys": dict(condition.keys),
                    "known": condition.known,
                    "missions": len(seeds),
                    "unit": [unit_of_goal(goal) for goal in goals],
                    **plainly(evidence.estimates(number)),
                    "met": is_met.get(evidence.verdicts[number] or ""),
                    "as_planned": {**plainly(planned), "met": kept},
                    "difference": plainly(tuple(map(estimated, apart.T))),
                }
            )
    return rows


def _surely_met(goals: Sequence[Goal], estimates: Sequence[Estimate]) -> bool | None:
    """Tell whether goals are met over the whole intervals of their means; None if undecided."""
    pairs = zip(goals, estimates, strict=True)
    ends = [[excess(goal, end) for end in (mean.low, mean.high)] for goal, mean in pairs]
    if any(min(both) > 0.0 for both in ends):
        return False
    return True if all(max(both) <= 0.0 for both in ends) else None


def became_of(case: Mapping[str, Any]) -> str:
    """Return the verdict of a recorded condition in words."""
    met = case.get("met")
    if met is False and (case.get("as_planned") or {}).get("met") is False:
        return "not met, nor without it"
    return {True: "still met", False: "not met", None: "undecided"}[met]


def by_surprise(
    cases: Sequence[Mapping[str, Any]],
) -> list[tuple[Mapping[str, Any], Mapping[str, Any] | None]]:
    """Return each recorded condition unknown to filters, with its known case if simulated."""
    known = {case.get("what"): case for case in cases if case.get("known")}
    return [(case, known.get(case.get("what"))) for case in cases if not case.get("known")]


def plainly(estimates: Sequence[Estimate]) -> dict[str, list[float | None]]:
    """Return means, interval ends and shares of missed missions as lists over goals.

    Shares are left out if none was counted.
    """
    counted = any(isfinite(estimate.missed) for estimate in estimates)
    return {
        name: [value if isfinite(value := getattr(own, name)) else None for own in estimates]
        for name in ("mean", "low", "high", *(["missed"] * counted))
    }
