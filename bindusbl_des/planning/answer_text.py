"""What a plan says: its answer, its doubts, and what would help; the same as plain data."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from ..core.kept_files import portable
from ..core.wording import amount, counted, filled, significant, with_ends
from ..geometry.geodesy import degrees_text, geodetic_from_ned, minutes_text
from ..preflight.whereabouts import idle
from ..results.result import scenario_sha256, versions
from ..scenario.scenario import Scenario
from ..setup import Setup
from .candidates import Candidate, LeftOut, Predictor, band, excess, team_text
from .doubting import Doubted, became_of, plainly
from .folder import COMPLETE, CUT, shown_first
from .prediction.inputs import STATED_ERROR
from .proposals import is_instant
from .question import UNPRICED, Question
from .relief import Relief
from .selection.evidence import Estimate, Selection
from .selection.goals import Goal, limits_text, unit_of_goal, value_text

# Said of the conditions that are worse
UNTOLD = "(each flown with the filter as planned: nobody tells it)"

# So many candidates beside the answer `plan.json` names.
MOST_RUNNERS_UP = 3


class Ways(NamedTuple):
    """The ways (n, 2), m, of vessels that move, in a mission of some seed."""

    seed: int
    places_m: list[list[list[float]]]

    def record(self) -> dict[str, Any]:
        """Return it as plain data."""
        asvs = [{"asv": f"ASV{n}", "places_m": way} for n, way in enumerate(self.places_m)]
        return {"seed": self.seed, "asvs": asvs}


@dataclass(frozen=True)
class Found:
    """All that was found out for a plan.

    `missions` is how many were flown, those of doubts included; `cut` is the option that cut the
    plan off, empty if none did; `failed` how many missions failed, and why, empty if none did.
    """

    question: Question
    candidates: Sequence[Candidate]
    selection: Selection
    predictor: Predictor
    left_out: Sequence[LeftOut]
    reliefs: Sequence[Relief]
    further: str
    doubted: Sequence[Doubted]
    missions: int
    cut: str
    failed: str

    @property
    def team(self) -> Candidate | None:
        """The least team that is shown to meet the goals."""
        answer = self.selection.answer
        return None if answer is None else self.candidates[answer]

    @property
    def shown(self) -> int | None:
        """The candidate that is drawn: the answer, or else the nearest; None if none was flown."""
        ranked = self.ranked[:1] if self.selection.answer is None else [self.selection.answer]
        return next(iter(ranked), None)

    @property
    def ranked(self) -> list[int]:
        """The candidates that were flown by how good they are: met ones by cost, then the rest."""
        return ranked(self.question.goals, self.candidates, self.selection)


def ranked(
    goals: Sequence[Goal], candidates: Sequence[Candidate], selection: Selection
) -> list[int]:
    """Return the numbers of candidates that were flown: those that meet the goals by their cost and
    then by their means, and after them those that do not, the nearest first.
    """

    def far(number: int) -> tuple[float, float]:
        """By how much its goals are missed, and by how much where the ratio to one is infinite."""
        means = [estimate.mean for estimate in selection.estimates[number]]
        apart = [abs(mean - goal.limit) for goal, mean in zip(goals, means, strict=True)]
        return max(map(excess, goals, means)), max(apart)

    flown = [n for n, missions in enumerate(selection.missions) if missions]
    meets = {n: far(n)[0] < 0 for n in flown}
    return sorted(flown, key=lambda n: (not meets[n], meets[n] * candidates[n].cost, far(n)))


def reached(goals: Sequence[Goal], estimates: Sequence[Estimate]) -> str:
    """Return what missions came to, a goal after the other.

    >>> reached([Goal("position_error_m", below=1.0)], [Estimate(0.39, 0.28, 0.51, float("nan"))])
    'position_error_m 0.390 m (95 % interval 0.280 to 0.510)'
    """
    return ", ".join(
        "{} {} (95 % interval {})".format(goal.metric, *_with_ends(goal, estimate))
        for goal, estimate in zip(goals, estimates, strict=True)
    )


def _with_ends(goal: Goal, estimate: Estimate) -> tuple[str, str]:
    """Return a mean with its unit, and from where to where its interval goes."""
    mean, low, high = with_ends(estimate.mean, estimate.low, estimate.high)
    return f"{mean} {unit_of_goal(goal)}".strip(), f"{low} to {high}"


def best_text(goals: Sequence[Goal], candidates: Sequence[Candidate], found: Selection) -> str:
    """Return which of the teams that were flown is the best so far; empty where none was."""
    flown = ranked(goals, candidates, found)[:1]
    if not flown:
        return ""
    number = flown[0]
    means = ", ".join(
        f"{f'{goal.metric} ' if len(goals) > 1 else ''}{mean}"
        + (f" ({ends})" if estimate.low == estimate.low else "")
        for goal, estimate in zip(goals, found.estimates[number], strict=True)
        for mean, ends in [_with_ends(goal, estimate)]
    )
    after = counted(found.missions[number], "mission")
    return f"{counted(candidates[number].asvs, 'ASV')}, {means} after {after}"


def answer_text(found: Found) -> str:
    """Return the answer in one sentence."""
    question, selection, answer = found.question, found.selection, found.selection.answer
    goals = limits_text(question.goals)
    flown = f"{counted(found.missions, 'mission')} in all"
    if not selection.is_settled:
        known = ""
        if answer is not None:
            came_to = reached(question.goals, selection.estimates[answer])
            known = f"{_priced(found, answer)} will do, {came_to}; whether less does: "
        return f"Not settled: {known}{_open(found)}; {goals} ({flown})."
    if answer is None:
        return f"No team that was flown is shown to keep {goals} ({flown})."
    estimates = selection.estimates[answer]
    came_to = (
        f"{reached(question.goals, estimates)} of {counted(selection.missions[answer], 'mission')}"
    )
    sure = f"{100 * question.confidence:g} % confidence"
    return f"{_priced(found, answer)}: {came_to}; {goals}, with {sure} ({flown})."


def _priced(found: Found, number: int) -> str:
    """Return a team in words, with its cost where anything has a price."""
    team, costs = found.candidates[number], found.question.costs
    price = "" if costs == UNPRICED else f", cost {amount(team.cost)}"
    return f"{team_text(team)}{price}"


def _open(found: Found) -> str:
    """Return how many teams may still be the answer, and which is the best so far."""
    selection = found.selection
    still = sum(
        verdict in ("met", "needs more missions", "not flown") for verdict in selection.verdicts
    )
    best = best_text(found.question.goals, found.candidates, selection)
    return f"{still} of {counted(len(found.candidates), 'team')} may do" + (
        f"; best so far {best}" if best else ""
    )


def _doubt_text(doubted: Mapping[str, Any]) -> str:
    """Return what becomes of the goals in a condition."""
    means, planned = (
        ", ".join("-" if mean is None else significant(mean) for mean in case["mean"])
        for case in (doubted, doubted["as_planned"])
    )
    return f"{doubted['told']}: {means} instead of {planned}, {became_of(doubted)}"


def caveats(found: Found) -> Iterator[str]:
    """Yield what the answer lacks, and how predictions compare with flights."""
    _, _, doubts = found.selection.why.partition(". ")  # its first sentence is the answer
    if doubts and not found.selection.is_settled and found.team is not None:
        yield doubts
    if found.failed:
        yield f"{found.failed}. Failed missions meet no goal."
    if found.cut:
        yield f"Cut off by {found.cut}; the same command goes on from here."
    if any(is_instant(found.question, point) for point in found.question.experiment.points):
        yield (
            "protocol.downlink.reply: instant costs no time on the air, which no modem can do; all "
            "teams were flown with protocol.downlink.reply: frame."
        )
    shown = found.question.base if found.shown is None else found.candidates[found.shown].scenario
    for longer in idle(Setup.of(shown)):
        yield f"{longer.key} {longer.message}."
    yield from _unvaried(found)
    yield from _predicted(found)


def _unvaried(found: Found) -> Iterator[str]:
    """Yield which goals' metrics never differed, and how rare what was not seen may be.

    What happens in a share p of missions is not seen in n of them with a probability (1 - p)^n.
    """
    answer, question = found.selection.answer, found.question
    if answer is None:
        return
    estimates, missions = found.selection.estimates[answer], found.selection.missions[answer]
    pairs = zip(question.goals, estimates, strict=True)
    same = [goal.metric for goal, estimate in pairs if estimate.low == estimate.high]
    if same:
        unseen = 100 * (1 - (1 - question.confidence) ** (1 / missions))
        yield (
            f"{' and '.join(same)} did not differ in {missions} missions of the answer, which "
            f"says nothing of what happens in fewer than {unseen:.0f} % of missions."
        )


def _predicted(found: Found) -> Iterator[str]:
    """Yield what was predicted of the answer, how wrong predictions are, and were in this plan."""
    answer, selection = found.selection.answer, found.selection
    if answer is None or found.cut:
        return
    for place, goal in enumerate(found.question.goals):
        values = [float(found.predictor.values(candidate)[place]) for candidate in found.candidates]
        low, high = band(goal, values[answer])
        means = [estimates[place].mean for estimates in selection.estimates]
        ratios = [mean / value for mean, value in zip(means, values, strict=True) if value > 0]
        if not low <= high:
            continue
        known = [ratio for ratio in ratios if isfinite(ratio)]
        yield (
            f"{goal.metric} of the answer was predicted to be {value_text(goal, values[answer])}; "
            f"nine in ten teams so predicted lie from {significant(low)} to "
            f"{value_text(goal, high)}. The missions of this plan gave "
            f"{significant(min(known))} to {significant(max(known))} times what was predicted."
        )


def remedy_text(found: Found) -> str | None:
    """Return what would meet the goals, where it is settled that no team does, or the nearest does
    not; None otherwise.
    """
    nearest = found.ranked[0] if found.ranked else None
    if found.team is not None or found.cut or nearest is None:
        return None
    estimates = found.selection.estimates[nearest]
    goals = found.question.goals
    if all(
        excess(goal, estimate.mean) <= 0 for goal, estimate in zip(goals, estimates, strict=True)
    ):
        return None
    first = f"The nearest is {_priced(found, nearest)}: {reached(goals, estimates)}."
    helping = [relief.text for relief in found.reliefs if relief.meets]
    if helping:
        return f"{first} It is predicted to meet the goal with: {'; '.join(helping)}."
    rest = f" Most would help {found.reliefs[0].text}." if found.reliefs else ""
    return f"{first} {found.further}{rest}".replace("  ", " ").strip()


def summary(record: Mapping[str, Any], folder: str) -> str:
    """Return a plan as a planner reads it in the terminal, from what `plan.json` holds."""
    lines = [filled(record["told"][0])]
    if record["would"]:
        lines.append(filled(record["would"]))
    shown = shown_first(record)
    places = [] if shown is None else record["candidates"][shown]["places"]
    on_earth = [
        f"{place['asv']} {degrees_text(*where)} ({minutes_text(*where)})"
        for place in places
        if None not in (where := (place["lat_deg"], place["lon_deg"]))
    ]
    lines += _section("begin at" if record["ways"] else "places", on_earth)
    next_best = [record["candidates"][number] for number in record["runners_up"]]
    lines += _section("runners-up", [f"{team['team']}: {team['told']}" for team in next_best])
    lines += _section("what binds", [relief["told"] for relief in record["binding"]][:2])
    doubts = [_doubt_text(doubt) for doubt in record["sensitivity"]]
    lines += _section("and if", [*doubts, UNTOLD] if doubts else [])
    lines += map(filled, record["told"][1:])
    lines += ["", f"Results: {folder}"]
    if record["answer"] is not None:
        lines.append(record["run"])
    return "\n".join(lines)


def _section(name: str, items: Sequence[str]) -> Iterator[str]:
    for number, item in enumerate(items):
        yield filled(f"{name if number == 0 else '':<12}{item}", " " * 12)


def record(found: Found, run: str, ways: Ways | None) -> dict[str, Any]:
    """Return what `plan.json` holds; `run` is the command that flies the answer, and `ways` are
    those of the vessels that are drawn, where they move.
    """
    question, answer = found.question, found.selection.answer
    others = [n for n in found.ranked if n != answer][:MOST_RUNNERS_UP]
    goals = question.goals
    sentences = [answer_text(found), *caveats(found)]
    return {
        "name": question.name,
        "scenario": question.source,
        "scenario_sha256": scenario_sha256(question.base),
        "versions": versions(),
        "seed": question.seed,
        "goal": [goal.record() for goal in goals],
        "duration_s": float(question.base.duration_s),
        "confidence": question.confidence,
        "costs": dict(question.costs),
        "budget_s": question.budget_s,
        "budget_missions": question.budget_missions,
        "settled": found.selection.is_settled,
        "status": CUT if found.cut else COMPLETE,
        "missions": found.missions,
        "answer": None if found.team is None else dict(found.team.keys),
        "chosen": answer,
        "would": remedy_text(found),
        "told": sentences,
        "run": run,
        "candidates": [
            _candidate(found, n, ways if n == found.shown else None)
            for n in range(len(found.candidates))
        ],
        "excluded": [
            {"told": group.words, "count": len(group.candidates)} for group in found.left_out
        ],
        "runners_up": others,
        "binding": [relief.record() for relief in found.reliefs],
        "sensitivity": [doubt.record() for doubt in found.doubted],
        "ways": None if ways is None else ways.record(),
        "prediction_error": {
            goal.metric: STATED_ERROR[goal.metric]._asdict()
            for goal in goals
            if goal.metric in STATED_ERROR
        }
        or None,
    }


def _candidate(found: Found, number: int, ways: Ways | None) -> dict[str, Any]:
    candidate, selection = found.candidates[number], found.selection
    estimates, missions = selection.estimates[number], selection.missions[number]
    values = found.predictor.values(candidate).tolist()
    bands = [band(goal, value) for goal, value in zip(found.question.goals, values, strict=True)]
    predicted = {
        "value": [_known(value) for value in values],
        "low": [_known(low) for low, _ in bands],
        "high": [_known(high) for _, high in bands],
    }
    simulated = {"missions": missions, **plainly(estimates)}
    return {
        "keys": dict(candidate.keys),
        "cost": candidate.cost,
        "asvs": candidate.asvs,
        "stations": candidate.stations.round(3).tolist(),
        "places": _places(candidate, ways),
        "predicted": predicted,
        "simulated": simulated if missions else None,
        "verdict": selection.verdicts[number],
        "team": _priced(found, number),
        "told": reached(found.question.goals, estimates) if missions else "",
    }


def _places(candidate: Candidate, ways: Ways | None) -> list[dict[str, Any]]:
    """Return where each ASV of a team lies, or begins, also on Earth."""
    origin = candidate.setup.origin_deg
    places = candidate.stations.tolist() if ways is None else [way[0] for way in ways.places_m]
    found = []
    for number, (x, y) in enumerate(places):
        lat, lon = (None, None) if origin is None else geodetic_from_ned((x, y, 0.0), *origin)[:2]
        metres = {"x_m": round(x, 3) + 0.0, "y_m": round(y, 3) + 0.0}
        found.append({"asv": f"ASV{number}", **metres, "lat_deg": lat, "lon_deg": lon})
    return found


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def best_yaml(scenario: Scenario, sentence: str) -> str:
    """Return the text of a scenario file: JSON is YAML, and each section has a line."""
    given = portable(scenario.model_dump(mode="json", exclude_unset=True))
    given["record"] = {**given.get("record", {}), "detail": "full"}
    lines = [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in given.items()]
    return "\n".join([f"# {sentence}", *lines, ""])
