"""What a plan came to as plain data: `plan.json`, and the scenario that meets the goals."""

import json
from typing import Any

import numpy as np

from ..core.kept_files import portable
from ..results.result import scenario_sha256, versions
from ..scenario.scenario import Scenario
from .doubting import plainly
from .folder import COMPLETE, CUT
from .found import Found
from .prediction.stated_error import STATED_ERROR
from .teams.foresight import band
from .telling import answer_told, caveats, reached, would_told
from .wording import team_told

MOST_RUNNERS_UP = 3


def record(found: Found, run: str) -> dict[str, Any]:
    """Return what `plan.json` holds; `run` is the command that flies the answer."""
    question, answer = found.question, found.selection.answer
    others = [n for n in found.ranked if n != answer][:MOST_RUNNERS_UP]
    goals = question.goals
    told = [answer_told(found), *caveats(found)]
    return {
        "name": question.name,
        "scenario": question.source,
        "scenario_sha256": scenario_sha256(question.base),
        "versions": versions(),
        "seed": question.seed,
        "goal": [goal.record() for goal in goals],
        "confidence": question.confidence,
        "budget_s": question.budget_s,
        "budget_missions": question.budget_missions,
        "settled": found.selection.is_settled,
        "status": CUT if found.cut else COMPLETE,
        "missions": found.missions,
        "answer": None if found.team is None else dict(found.team.keys),
        "chosen": answer,
        "would": would_told(found),
        "told": told,
        "run": run,
        "candidates": [_candidate(found, n) for n in range(len(found.candidates))],
        "excluded": [{"told": it.told, "count": len(it.candidates)} for it in found.left_out],
        "runners_up": others,
        "binding": [it.record() for it in found.reliefs],
        "sensitivity": [it.record() for it in found.doubted],
        "prediction_error": {
            goal.metric: STATED_ERROR[goal.metric]._asdict()
            for goal in goals
            if goal.metric in STATED_ERROR
        }
        or None,
    }


def _candidate(found: Found, number: int) -> dict[str, Any]:
    candidate, selection = found.candidates[number], found.selection
    estimates, missions = selection.estimates[number], selection.missions[number]
    values = found.foresight.values(candidate).tolist()
    bands = [band(goal, it) for goal, it in zip(found.question.goals, values, strict=True)]
    predicted = {
        "value": [_known(it) for it in values],
        "low": [_known(low) for low, _ in bands],
        "high": [_known(high) for _, high in bands],
    }
    simulated = {"missions": missions, **plainly(estimates)}
    return {
        "keys": dict(candidate.keys),
        "cost": candidate.cost,
        "asvs": candidate.asvs,
        "stations": candidate.stations.round(3).tolist(),
        "predicted": predicted,
        "simulated": simulated if missions else None,
        "verdict": selection.verdicts[number],
        "team": team_told(candidate),
        "told": reached(found.question.goals, estimates) if missions else "",
    }


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def best_yaml(scenario: Scenario, told: str) -> str:
    """Return the text of a scenario file: JSON is YAML, and each section has a line."""
    given = portable(scenario.model_dump(mode="json", exclude_unset=True))
    given["record"] = {**given.get("record", {}), "detail": "full"}
    lines = [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in given.items()]
    return "\n".join([f"# {told}", *lines, ""])
