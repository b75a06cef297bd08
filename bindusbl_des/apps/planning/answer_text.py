"""The answer of a plan in sentences, and the record `plan.json`."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

from ...core.geometry.geodesy import degrees_text, minutes_text
from ...core.results.result import scenario_sha256, versions
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.kept_files import portable
from ...support.wording import amount, counted, filled, significant, timed, with_ends
from ..preflight.whereabouts import idle, tired
from .doubting import became_of, by_surprise, plainly
from .folder import COMPLETE, CUT, shown_first
from .goals import Goal, limits_text, unit_of_goal, value_text
from .prediction.inputs import STATED_ERROR
from .question import UNPRICED, Question
from .relief import Relief
from .selecting import Estimate, Selection
from .teams import Team, band, excess, is_instant

# Added to worse conditions
UNTOLD = "(flown with the filter as planned, since the crew does not know)"

# The most runners-up that `plan.json` names.
MOST_RUNNERS_UP = 3


@dataclass(frozen=True)
class Outcome:
    """All results of a plan.

    `left_out` and `doubted` are rows of `plan.json`; `missions` counts all missions, those of
    doubts included; `cut` is the option that stopped the plan, or ""; `failed` tells how many
    missions failed and why, or "".
    """

    question: Question
    teams: Sequence[Team]
    selection: Selection
    left_out: Sequence[Mapping[str, Any]]
    reliefs: Sequence[Relief]
    further: str
    doubted: Sequence[Mapping[str, Any]]
    missions: int
    cut: str
    failed: str

    @property
    def team(self) -> Team | None:
        """The least team that is shown to meet the goals, or None."""
        answer = self.selection.answer
        return None if answer is None else self.teams[answer]

    @property
    def ranked(self) -> list[int]:
        """The numbers of the simulated teams, the best first: see :func:`ranked`."""
        return ranked(self.question.goals, self.teams, self.selection)

    @property
    def shown(self) -> int | None:
        """The number of the drawn team: the answer, or else the nearest; None without either."""
        if self.selection.answer is not None:
            return self.selection.answer
        return next(iter(self.ranked), None)


def ranked(goals: Sequence[Goal], teams: Sequence[Team], selection: Selection) -> list[int]:
    """Return the numbers of simulated teams, the best first.

    Teams whose means meet the goals are sorted by cost, then by means; the others follow, sorted by
    how much they miss.
    """

    def far(number: int) -> tuple[float, float]:
        """Return the largest logarithmic miss of a goal, and the largest distance from a limit."""
        means = [estimate.mean for estimate in selection.estimates[number]]
        apart = [abs(mean - goal.limit) for goal, mean in zip(goals, means, strict=True)]
        return max(map(excess, goals, means)), max(apart)

    flown = [n for n, missions in enumerate(selection.missions) if missions]
    meets = {n: far(n)[0] < 0 for n in flown}
    return sorted(flown, key=lambda n: (not meets[n], meets[n] * teams[n].cost, far(n)))


def reached(goals: Sequence[Goal], estimates: Sequence[Estimate]) -> str:
    """Return the means over missions in words, one for each goal.

    >>> reached([Goal("position_error_m", below=1.0)], [Estimate(0.39, 0.28, 0.51)])
    'position_error_m 0.390 m (95 % interval 0.280 to 0.510)'
    """
    return ", ".join(
        "{} {} (95 % interval {})".format(goal.name, *_with_ends(goal, estimate))
        for goal, estimate in zip(goals, estimates, strict=True)
    )


def _with_ends(goal: Goal, estimate: Estimate) -> tuple[str, str]:
    """Return a mean with its unit, and the ends of its interval."""
    mean, low, high = with_ends(estimate.mean, estimate.low, estimate.high)
    return f"{mean} {unit_of_goal(goal)}".strip(), f"{low} to {high}"


def best_text(goals: Sequence[Goal], teams: Sequence[Team], selection: Selection) -> str:
    """Return the best simulated team so far in words; "" before any was simulated."""
    for best in ranked(goals, teams, selection)[:1]:
        means = ", ".join(
            f"{f'{goal.name} ' if len(goals) > 1 else ''}{mean}"
            + (f" ({ends})" if estimate.low == estimate.low else "")
            for goal, estimate in zip(goals, selection.estimates[best], strict=True)
            for mean, ends in [_with_ends(goal, estimate)]
        )
        after = counted(selection.missions[best], "mission")
        return f"{counted(teams[best].asvs, 'ASV')}, {means} after {after}"
    return ""


def answer_text(outcome: Outcome) -> str:
    """Return the answer in one sentence."""
    question, selection, answer = outcome.question, outcome.selection, outcome.selection.answer
    goals, flown = limits_text(question.goals), f"{counted(outcome.missions, 'mission')} in all"
    came_to = "" if answer is None else reached(question.goals, selection.estimates[answer])
    if not selection.is_settled:
        open_verdicts = ("met", "needs more missions", "not flown")
        still = sum(verdict in open_verdicts for verdict in selection.verdicts)
        teams = counted(len(outcome.teams), "team")
        best = best_text(question.goals, outcome.teams, selection)
        known = ""
        if answer is not None:
            known = f"{_priced(outcome, answer)} will do, {came_to}; whether less does: "
        so_far = f"; best so far {best}" if best else ""
        return f"Not settled: {known}{still} of {teams} may do{so_far}; {goals} ({flown})."
    if answer is None:
        return f"No team that was flown is shown to keep {goals} ({flown})."
    came_to += f" of {counted(selection.missions[answer], 'mission')}"
    sure = f"{100 * question.confidence:g} % confidence"
    return f"{_priced(outcome, answer)}: {came_to}; {goals}, with {sure} ({flown})."


def _priced(outcome: Outcome, number: int) -> str:
    """Return a team in words, with its cost if anything has a price."""
    team = outcome.teams[number]
    priced = outcome.question.costs != UNPRICED
    return team.words + (f", cost {amount(team.cost)}" if priced else "")


def caveats(outcome: Outcome) -> Iterator[str]:
    """Yield the limits of the answer, and how predictions compare with simulations."""
    question = outcome.question
    if outcome.selection.doubts and outcome.team is not None:
        yield outcome.selection.doubts
    if outcome.failed:
        yield f"{outcome.failed}. Failed missions meet no goal."
    if outcome.cut:
        yield f"Cut off by {outcome.cut}; the same command goes on from here."
    if any(is_instant(question, point) for point in question.experiment.points):
        yield (
            "protocol.downlink.reply: instant costs no time on the air, which no modem can do; all "
            "teams were flown with protocol.downlink.reply: frame."
        )
    shown = question.base if outcome.shown is None else outcome.teams[outcome.shown].scenario
    for longer in (*idle(Setup.of(shown)), *tired(Setup.of(shown))):
        yield f"{longer.key} {longer.message}."
    if outcome.team is not None:
        yield from _risen(outcome.team)
        yield from _unvaried(outcome)
    if outcome.team is not None and not outcome.cut:
        yield from _predicted(outcome, outcome.team)


def _risen(team: Team) -> Iterator[str]:
    """Yield what surfacing costs a team: time, distance, and energy."""
    changed = team.changed({"auvs.route.surface_every_s": None})
    if changed is None or not any(wing.asked.surfacing is not None for wing in team.setup.wings):
        return
    try:
        pairs = list(zip(team.setup.flown_s, changed.setup.flown_s, strict=True))
    except ValueError:  # the lanes have no known end
        return
    longer, auv = max((up - down, auv) for auv, (up, down) in enumerate(pairs))
    if longer <= 0.0:
        return
    up, down = pairs[auv]
    way = longer * team.setup.auvs[auv].speed_m_per_s
    yield (
        f"Coming up to fix takes AUV{auv} {timed(longer)} and {way:,.0f} m of its lanes: they are "
        f"flown after {timed(up)}, not {timed(down)}, for {significant(100 * longer / down, 2)} % "
        "more energy of propulsion, as it goes by the way."
    )


def _unvaried(outcome: Outcome) -> Iterator[str]:
    """Yield which metrics never differed, and how often an unseen event may still happen.

    An event in a share p of missions is not seen in n of them with the probability (1 - p)^n.
    """
    answer, question = outcome.selection.answer, outcome.question
    assert answer is not None
    missions = outcome.selection.missions[answer]
    pairs = zip(question.goals, outcome.selection.estimates[answer], strict=True)
    same = [goal.name for goal, estimate in pairs if estimate.low == estimate.high]
    if same:
        unseen = 100 * (1 - (1 - question.confidence) ** (1 / missions))
        yield (
            f"{' and '.join(same)} did not differ in {missions} missions of the answer, which "
            f"says nothing of what happens in fewer than {unseen:.0f} % of missions."
        )


def _predicted(outcome: Outcome, answer: Team) -> Iterator[str]:
    """Yield the prediction of the answer, its stated error, and its error in this plan."""
    for place, goal in enumerate(outcome.question.goals):
        value = answer.values[place]
        low, high = band(goal, value)
        if not low <= high:
            continue
        pairs = zip(outcome.selection.estimates, outcome.teams, strict=True)
        ratios = [own[place].mean / team.values[place] for own, team in pairs
                  if team.values[place] > 0]  # fmt: skip
        known = [ratio for ratio in ratios if isfinite(ratio)]
        yield (
            f"{goal.name} of the answer was predicted to be {value_text(goal, value)}; "
            f"nine in ten teams so predicted lie from {significant(low)} to "
            f"{value_text(goal, high)}. The missions of this plan gave "
            f"{significant(min(known))} to {significant(max(known))} times what was predicted."
        )


def remedy_text(outcome: Outcome) -> str | None:
    """Return what would meet the goals if no team is shown to, or if the nearest misses them.

    None if the plan has an answer, was cut off, or its nearest team misses no goal by its mean.
    """
    if outcome.team is not None or outcome.cut or not outcome.ranked:
        return None
    nearest, goals = outcome.ranked[0], outcome.question.goals
    estimates = outcome.selection.estimates[nearest]
    pairs = zip(goals, estimates, strict=True)
    missed = [goal for goal, estimate in pairs if excess(goal, estimate.mean) > 0]
    if not missed:
        return None
    first = f"The nearest is {_priced(outcome, nearest)}: {reached(goals, estimates)}."
    # reliefs are predicted for the team without losses
    reliefs = [] if any(goal.lost for goal in missed) else outcome.reliefs
    helping = [relief.told for relief in reliefs if relief.meets]
    if helping:
        return f"{first} It is predicted to meet the goal with: {'; '.join(helping)}."
    most = [f"Most would help {relief.told}." for relief in reliefs[:1]]
    return " ".join(filter(None, [first, outcome.further, *most]))


def where_texts(place: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield a place of `plan.json` in degrees, and in degrees and minutes; nothing without both."""
    lat, lon = place.get("lat_deg"), place.get("lon_deg")
    if lat is not None and lon is not None:
        yield degrees_text(lat, lon), minutes_text(lat, lon)


def summary(record: Mapping[str, Any], folder: str) -> str:
    """Return the text for the terminal, from the record `plan.json`."""
    lines = [filled(record["told"][0])]
    if record["would"]:
        lines.append(filled(record["would"]))
    shown = shown_first(record)
    places = [] if shown is None else record["candidates"][shown]["places"]
    on_earth = [f"{place['asv']} {where}" for place in places if (where := where_text(place))]
    next_best = [record["candidates"][number] for number in record["runners_up"]]
    doubts = [_doubt_text(*cases) for cases in by_surprise(record["sensitivity"])]
    for name, items in (
        ("begin at" if record["ways"] else "places", on_earth),
        ("runners-up", [f"{team['team']}: {team['told']}" for team in next_best]),
        ("what binds", [relief["told"] for relief in record["binding"]][:2]),
        ("and if", [*doubts, UNTOLD] if doubts else []),
    ):
        for number, item in enumerate(items):
            lines.append(filled(f"{'' if number else name:<12}{item}", " " * 12))
    lines += map(filled, record["told"][1:])
    lines += ["", f"Results: {folder}"]
    if record["answer"] is not None:
        lines.append(record["run"])
    return "\n".join(lines)


def where_text(place: Mapping[str, Any]) -> str:
    """Return a place of `plan.json` in degrees, and in minutes; "" if it is not on Earth."""
    return "".join(f"{degrees} ({minutes})" for degrees, minutes in where_texts(place))


def _doubt_text(doubted: Mapping[str, Any], known: Mapping[str, Any] | None) -> str:
    """Return the goals' means under a condition, with the means if the filter knows of it."""

    def means(case: Mapping[str, Any]) -> str:
        pairs = zip(case["mean"], doubted["unit"], strict=True)
        known = [("-" if mean is None else significant(mean), unit) for mean, unit in pairs]
        return ", ".join(" ".join(pair).strip() for pair in known)

    planned, became = means(doubted["as_planned"]), became_of(doubted)
    text = f"{doubted['told']}: {means(doubted)} instead of {planned}, {became}"
    return text if known is None else f"{text} ({means(known)} if the filter knows)"


def record(outcome: Outcome, run: str, ways: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the record `plan.json`.

    `run` is the command that flies the answer; `ways` are the tracks of the drawn team's vessels,
    if these move.
    """
    question, answer = outcome.question, outcome.selection.answer
    metrics = [goal.metric for goal in question.goals if goal.metric in STATED_ERROR]
    return {
        "name": question.name,
        "scenario": question.source,
        "scenario_sha256": scenario_sha256(question.base),
        "versions": versions(),
        "seed": question.seed,
        "goal": [goal.record() for goal in question.goals],
        "duration_s": float(question.base.duration_s),
        "confidence": question.confidence,
        "costs": dict(question.costs),
        "budget_s": question.budget_s,
        "budget_missions": question.budget_missions,
        "settled": outcome.selection.is_settled,
        "status": CUT if outcome.cut else COMPLETE,
        "missions": outcome.missions,
        "answer": None if outcome.team is None else dict(outcome.team.keys),
        "chosen": answer,
        "would": remedy_text(outcome),
        "told": [answer_text(outcome), *caveats(outcome)],
        "run": run,
        "candidates": [
            _candidate(outcome, n, ways if n == outcome.shown else None)
            for n in range(len(outcome.teams))
        ],
        "excluded": list(outcome.left_out),
        "runners_up": [n for n in outcome.ranked if n != answer][:MOST_RUNNERS_UP],
        "binding": [
            {"what": relief.what, "told": relief.told, "value": relief.value}
            for relief in outcome.reliefs
        ],
        "sensitivity": list(outcome.doubted),
        "ways": ways,
        "prediction_error": {name: STATED_ERROR[name]._asdict() for name in metrics} or None,
    }


def _candidate(outcome: Outcome, number: int, ways: Mapping[str, Any] | None) -> dict[str, Any]:
    team, selection = outcome.teams[number], outcome.selection
    estimates, missions = selection.estimates[number], selection.missions[number]
    bands = [band(*pair) for pair in zip(outcome.question.goals, team.values, strict=True)]
    low, high = zip(*bands, strict=True)
    predicted = {"value": team.values, "low": low, "high": high}
    return {
        "keys": dict(team.keys),
        "cost": team.cost,
        "asvs": team.asvs,
        "stations": team.stations.round(3).tolist(),
        "places": _places(team, ways),
        "predicted": {
            name: [value if isfinite(value) else None for value in own]
            for name, own in predicted.items()
        },
        "simulated": {"missions": missions, **plainly(estimates)} if missions else None,
        "verdict": selection.verdicts[number],
        "team": _priced(outcome, number),
        "told": reached(outcome.question.goals, estimates) if missions else "",
    }


def _places(team: Team, ways: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """Return the stations of a team's ASVs, or where their tracks begin, also on Earth."""
    places = team.stations.tolist()
    if ways is not None:
        places = [asv["places_m"][0] for asv in ways["asvs"]]
    on_earth = located(team.setup, places)
    return [{"asv": f"ASV{number}", **place} for number, place in enumerate(on_earth)]


def located(setup: Setup, places: Sequence[Sequence[float]]) -> list[dict[str, float | None]]:
    """Return places (n, 2; m) as in `plan.json`, with degrees if the scenario is on Earth."""
    nowhere = [(None, None)] * len(places)
    on_earth = nowhere if setup.origin_deg is None else setup.on_earth(places)
    return [
        {"x_m": round(x, 3) + 0.0, "y_m": round(y, 3) + 0.0, "lat_deg": lat, "lon_deg": lon}
        for (x, y), (lat, lon, *_) in zip(places, on_earth, strict=True)
    ]


def best_yaml(scenario: Scenario, sentence: str) -> str:
    """Return the text of a scenario file: a comment, then one line of JSON for each section."""
    given = portable(scenario.model_dump(mode="json", exclude_unset=True))
    given["record"] = {**given.get("record", {}), "detail": "full"}
    lines = [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in given.items()]
    return "\n".join([f"# {sentence}", *lines, ""])
