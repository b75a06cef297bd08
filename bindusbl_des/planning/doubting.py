"""How a team fares where the world is worse than the scenario has it, on the answer's own seeds;
and what more vessels would bring: teams that cost more than the answer, flown a few times.

Nobody tells a crew of a surprise: filters stay as planned, and model the errors of the scenario.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np

from ..campaigns.statistics.intervals import intervals
from ..core.arrays import Floats
from ..core.plain_data import value_at
from ..geometry.formation import ring_radius
from ..preflight.fix_chance import loses_pings
from ..scenario.agreement.instruments import ASSUMED
from ..scenario.files.overrides import put
from ..scenario.sections.navigation import Drift
from .candidates import (
    FORMATION,
    Candidate,
    Predictor,
    candidate,
    excess,
    place_keys,
    placed,
)
from .question import Question
from .selection.evidence import (
    SPENT,
    CutOff,
    Estimate,
    Evidence,
    Sample,
    Selection,
    estimated,
    looks_at_each,
)
from .selection.goals import Goal

# So many missions of each show about where it is: the first so many where these tell the means of
# all goals to this share of them (half of the 95 % interval), else all.
FIRST, ALL = 4, 8
NARROW = 0.1


def with_costlier(
    selection: Selection, candidates: Sequence[Candidate], goals: Sequence[Goal], sample: Sample
) -> Selection:
    """Return a selection with estimates of the first candidate of each cost that was not flown.

    Candidates of one cost are in the order of their predictions, so that it is the best of them.
    Verdicts stay as they are: nothing is decided by so few missions.
    """
    first: dict[float, int] = {}
    for number, team in enumerate(candidates):
        first.setdefault(team.cost, number)
    shown = [n for n in first.values() if selection.verdicts[n] == "not needed"]
    values = {n: np.empty((0, len(goals))) for n in shown if not selection.missions[n]}
    for seeds in (FIRST, ALL):
        wide = [n for n, known in values.items() if not _is_narrow(known)]
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


def _is_narrow(values: Floats) -> bool:
    """Tell whether the means of all goals are known well enough."""
    known = intervals(values.T)
    return bool(np.all(known.half_width <= NARROW * np.abs(known.mean)))


# So much shorter are the ranges, so much is the speed of sound taken too high, so many times drifts
# dead reckoning.
SHORTER, FASTER, DRIFTIER = 0.8, 1.01, 2.0

# So many times longer losses last, or if they come one by one so long (s): some rounds.
LONGER, BURST_S = 3.0, 10.0

# So much sooner errors of scale and heading wander off than a sheet is read, or if not at all.
SOONER, USUAL_LINE_M = 3.0, Drift.model_fields["line_m"].default

# Whether the goals are met in a condition is known with so much confidence, after so many missions
# at most.
CONFIDENCE, SEEDS = 0.95, max(SPENT)

HF, MF = "acoustics.hf", "acoustics.mf"
NAVIGATION = "navigation"
# What dead reckoning drifts by, where no sheet of an inertial system says it
DRIFTS = (
    "velocity_bias_m_per_s",
    "velocity_bias_sd_m_per_s",
    "random_walk_m_per_sqrt_s",
    "scale_factor_sd",
    "heading_sd_deg",
)


@dataclass(frozen=True)
class Doubt:
    """A condition that is worse: what it is, and the team in it.

    `without` is the team without the condition, judged over the same time; None is the answer.
    """

    words: str
    keys: Mapping[str, Any]
    team: Candidate
    without: Candidate | None = None


@dataclass(frozen=True)
class Doubted:
    """What became of the goals in it: an estimate each, and whether they are still met.

    `as_planned` are the estimates without the condition, over the same seeds, and `planned_met`
    whether the goals are met so, which they are by the answer.  None where neither is certain.
    """

    doubt: Doubt
    missions: int
    estimates: tuple[Estimate, ...]
    as_planned: tuple[Estimate, ...]
    met: bool | None
    planned_met: bool | None = True

    def record(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "told": self.doubt.words,
            "keys": dict(self.doubt.keys),
            "known": False,
            "missions": self.missions,
            **plainly(self.estimates),
            "met": self.met,
            "as_planned": {**plainly(self.as_planned), "met": self.planned_met},
        }


def became_of(case: Mapping[str, Any]) -> str:
    """Return what becomes of the goals in a condition, as it is recorded."""
    met = case.get("met")
    if met is False and (case.get("as_planned") or {}).get("met") is False:
        return "not met, nor without it"
    return {True: "still met", False: "not met", None: "undecided"}[met]


def doubts(question: Question, team: Candidate, predictor: Predictor) -> list[Doubt]:
    """Return the conditions in which a team is to be flown; without those that make no scenario."""
    changes = [*_ranges(team), *_bursts(team), *_sound(team), *_drift(team)]
    keys_of = {words: {**keys, **_as_planned(team, keys)} for words, keys in changes}
    worse = {words: candidate(question, {**team.keys, **keys}) for words, keys in keys_of.items()}
    found = [
        Doubt(words, keys_of[words], changed)
        for words, changed in worse.items()
        if changed is not None
    ]
    return [*found[:1], *_lost(question, team, predictor), *found[1:]]


def _as_planned(team: Candidate, changed: Mapping[str, Any]) -> dict[str, Any]:
    """Return the key that leaves a team's filter as it is planned where other keys are changed."""
    chosen = team.scenario.navigation.filter
    if not team.scenario.navigation.weighs:
        return {}
    planned = team.setup.taken.scenario.model_dump(mode="json")
    assumes = deepcopy(dict(chosen.settings.get("assumes", {})))
    for key in changed:
        section, name, *_ = key.split(".")
        if name in ASSUMED.get(section, ()):
            put(assumes, key, value_at(planned, key.split(".")))
    return {f"{NAVIGATION}.filter.assumes": assumes} if assumes else {}


def _ranges(team: Candidate) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield shorter ranges, the ASVs where they are; of a disc only, which they bound."""
    bands = team.scenario.acoustics
    discs = [name for name, band in ((HF, bands.hf), (MF, bands.mf)) if band.traits.ends_at_range]
    lengths = {HF: bands.hf.range_m, MF: bands.mf.range_m}
    if discs:
        keys = {f"{name}.range_m": float(f"{SHORTER * lengths[name]:.6g}") for name in discs}
        which = "ranges" if len(discs) == len(lengths) else f"{discs[0][-2:].upper()} range"
        yield f"{which} {100 * (SHORTER - 1):+.0f} %", {**keys, **_kept(team)}


def _bursts(team: Candidate) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield losses that come together, or last longer, where signals are lost at all."""
    bands = team.scenario.acoustics
    lossy: dict[str, float | None] = {HF: bands.hf.burst_s} if loses_pings(team.setup) else {}
    if team.scenario.protocol.sends_frames and not bands.mf.traits.keeps_frames:
        lossy[MF] = bands.mf.burst_s
    longer = {name: burst * LONGER for name, burst in lossy.items() if burst is not None}
    if longer:
        keys = {f"{name}.channel.burst_s": float(f"{burst:.3g}") for name, burst in longer.items()}
        yield f"losses last {LONGER:g} times as long", keys
    elif lossy:
        yield (
            f"losses last {BURST_S:g} s, not one by one",
            {f"{name}.channel.burst_s": BURST_S for name in lossy},
        )


def _kept(team: Candidate) -> dict[str, Any]:
    """Return what keeps a ring where it is, since by default it grows with the HF range."""
    asked = team.scenario.asvs.formation.moored
    if asked is None or asked.is_placed or asked.radius_m is not None:
        return {}
    if team.asvs == 1:
        return {}
    radius = ring_radius(team.stations)
    cleared = {f"{FORMATION}.clearance_m": 0.0} if asked.clearance_m else {}
    return {**cleared, f"{FORMATION}.radius_m": float(f"{radius:.9g}")}


def _lost(question: Question, team: Candidate, predictor: Predictor) -> list[Doubt]:
    """Return the team without the vessel that is predicted to be missed most, and with that vessel
    until half of the mission is over; of vessels that move, which are told where to go anew, with
    the first until then.
    """
    if team.scenario.asvs.formation.moored is None and not team.moves:
        return []
    vessels = 0 if team.moves or team.asvs == 1 else team.asvs
    rests = [_without(question, team, lost) for lost in range(vessels)]
    missed = [(predictor.rank(rest.team), -n) for n, rest in enumerate(rests) if rest is not None]
    lost = -max(missed)[1] if missed else 0
    failures = [failure.model_dump(mode="json") for failure in team.scenario.asvs.failures]
    fails = {"asv": lost, "at_s": team.scenario.duration_s / 2}
    after = {"record.metrics_from_s": fails["at_s"]}  # or the time before would hide it
    keys = {"asvs.failures": [*failures, fails], **after}
    halfway, without = (candidate(question, {**team.keys, **changes}) for changes in (keys, after))
    if halfway is None or without is None:
        return [rest for rest in rests[lost : lost + 1] if rest is not None]
    later = Doubt(f"ASV{lost} lost halfway, from then on", keys, halfway, without)
    return [doubt for doubt in (*rests[lost : lost + 1], later) if doubt is not None]


def _without(question: Question, team: Candidate, lost: int) -> Doubt | None:
    """Return a team without one of its vessels; None where that is no scenario."""
    keys = place_keys(question, np.delete(team.stations, lost, axis=0))
    rest = placed(question, team.keys, keys)
    return None if rest is None else Doubt(f"ASV{lost} lost", keys, rest)


def _sound(team: Candidate) -> Iterator[tuple[str, dict[str, Any]]]:
    speed = float(f"{FASTER * team.setup.assumed_sound_speed_m_per_s:.6g}")
    yield (
        f"speed of sound taken {100 * (FASTER - 1):.0f} % too high",
        {"environment.assumed_sound_speed_m_per_s": speed},
    )


def _drift(team: Candidate) -> Iterator[tuple[str, dict[str, Any]]]:
    navigation = team.scenario.navigation
    keys: dict[str, Any] = {}
    for name in ("percent_of_distance", "m_per_hour"):
        if (stated := getattr(navigation.drift, name)) is not None:
            keys[f"{NAVIGATION}.drift.{name}"] = DRIFTIER * stated
    for name in () if keys else DRIFTS:
        value = getattr(navigation, name)
        doubled = (
            [DRIFTIER * number for number in value]
            if isinstance(value, tuple)
            else DRIFTIER * value
        )
        if np.any(value):
            keys[f"{NAVIGATION}.{name}"] = doubled
    if keys:
        yield f"drift x {DRIFTIER:g}", keys
    line = navigation.drift.line_m
    if team.setup.drift_line_m or (navigation.drift.is_stated and line is None):
        sooner = USUAL_LINE_M if line is None else max(line / SOONER, 1.0)  # what the key allows
        words = (
            f"drift wanders over {sooner:.3g} m, not {'at all' if line is None else f'{line:g}'}"
        )
        yield words, {f"{NAVIGATION}.drift.line_m": float(f"{sooner:.3g}")}


def teams_of(conditions: Sequence[Doubt]) -> list[Candidate]:
    """Return the teams that are flown: those in the conditions, and after them those without."""
    without = [condition.without for condition in conditions if condition.without is not None]
    return [*(condition.team for condition in conditions), *without]


def doubted(
    conditions: Sequence[Doubt],
    goals: Sequence[Goal],
    sample: Sample,
    answer: Callable[[Sequence[int]], Floats],
) -> list[Doubted]:
    """Fly a team in each condition until it is known whether the goals are still met, and at the
    same seeds without it.

    `sample` flies :func:`teams_of` the conditions, `answer` the answer at some seeds (numbers).
    Returned are those that were flown, which are all unless these return too few missions.
    """
    looks = looks_at_each(CONFIDENCE, len(goals))
    evidence = Evidence(len(conditions), goals, looks, 0.0, sample)
    numbers = range(len(conditions))
    with suppress(CutOff):
        for look in range(len(looks)):
            unknown = [number for number in numbers if evidence.verdicts[number] is None]
            evidence.fly(unknown, look)
            for number in unknown:
                evidence.judge(number, look)
    is_met = {"met": True, "not met": False}
    found, extra = [], len(conditions)
    for number in numbers:
        seeds = range(evidence.missions(number))
        if conditions[number].without is None:
            as_planned = answer(seeds)
        else:
            as_planned = sample([(extra, seed) for seed in seeds])
            extra += 1
        if len(seeds) and len(as_planned) == len(seeds):
            estimates = evidence.estimates(number), tuple(map(estimated, as_planned.T))
            met = is_met.get(evidence.verdicts[number] or "")
            kept = True if conditions[number].without is None else _surely_met(goals, estimates[1])
            found.append(Doubted(conditions[number], len(seeds), *estimates, met, kept))
    return found


def _surely_met(goals: Sequence[Goal], estimates: Sequence[Estimate]) -> bool | None:
    """Tell whether goals are met wherever in their intervals means lie; None where it depends."""
    pairs = zip(goals, estimates, strict=True)
    ends = [[excess(goal, end) for end in (mean.low, mean.high)] for goal, mean in pairs]
    if any(min(both) > 0.0 for both in ends):
        return False
    return True if all(max(both) <= 0.0 for both in ends) else None


def plainly(estimates: Sequence[Estimate]) -> dict[str, list[float | None]]:
    """Return means, the ends of their intervals and shares of missions that miss the goal as plain
    data, one for each goal; no shares where they were not counted.
    """
    counted = any(isfinite(estimate.missed) for estimate in estimates)
    names = ("mean", "low", "high", *(("missed",) if counted else ()))
    ends = {name: [getattr(estimate, name) for estimate in estimates] for name in names}
    return {
        name: [value if isfinite(value) else None for value in own] for name, own in ends.items()
    }
