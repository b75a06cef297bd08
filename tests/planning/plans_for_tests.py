"""Records of plans from missions that were really flown, as `plan.json` has them."""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from predicted_for_tests import inputs_of, predict
from toy_selections import Choice, Goal

from bindusbl_des import Scenario, Setup, formation, load_scenario, simulate
from bindusbl_des.apps.campaigns.statistics.intervals import interval
from bindusbl_des.apps.planning.plan_page import chart_of, plan_page
from bindusbl_des.apps.planning.prediction.inputs import STATED_ERROR, Inputs
from bindusbl_des.apps.planning.prediction.mapping import error_map
from bindusbl_des.apps.planning.prediction.rounds import Turns
from bindusbl_des.apps.planning.question import Asking, read_plan
from bindusbl_des.apps.planning.selecting import Estimate, Selection, select
from bindusbl_des.apps.planning.teams import Team

# What tests of this room share of it, named once
__all__ = [
    "ATTACK",
    "FIELDS",
    "GOAL",
    "STATED_ERROR",
    "Asking",
    "Choice",
    "Estimate",
    "Goal",
    "Inputs",
    "Record",
    "Selection",
    "Team",
    "Turns",
    "attacked",
    "base",
    "chart_of",
    "drawn",
    "error_map",
    "flown",
    "inputs_of",
    "interval",
    "plan_page",
    "predict",
    "read_plan",
    "record",
    "select",
    "team",
    "team_in",
]  # fmt: skip


GOAL = {"metric": "position_error_p95_m", "below": 1.0, "of": "worst"}
ATTACK = "</code></script><script>window.owned = 1</script><img src=x onerror='window.owned = 2'>"

Record = dict[str, Any]


def base(auvs: int = 3, duration: float = 120.0, changes: Sequence[str] = ()) -> Scenario:
    """Return a survey that vessels are sought for."""
    own = [f"auvs.count={auvs}", "survey.side_m=140", f"duration_s={duration}"]
    return load_scenario("quickstart", overrides=["record.detail=summary", *own, *changes])


def team_in(scenario: Scenario, cost: float = 1.0) -> Team:
    """Return the team of a scenario as it is, at a cost."""
    return Team(
        read_plan(scenario, Asking((Goal("position_error_m", below=1.0),))), {}, scenario, cost
    )


def team(keys: Record) -> list[list[float]]:
    """Return the stations of a candidate with a regular formation."""
    angle = math.radians(keys["asvs.formation.angle_deg"])
    places = formation(keys["asvs.count"], keys["asvs.formation.radius_m"], angle)
    return [[float(x), float(y)] for x, y in places]


def flown(scenario: Scenario, stations: Sequence[Sequence[float]], seeds: int) -> Record:
    """Return the worst AUV's goal metric over missions with each of so many seeds."""
    missions = [simulate(moored(stations, scenario), seed).mission for seed in range(seeds)]
    found = interval([float(it[f"worst_{GOAL['metric']}"].iloc[0]) for it in missions])
    low, high = (None if not math.isfinite(it) else it for it in (found.low, found.high))
    return {"missions": seeds, "mean": [found.mean], "low": [low], "high": [high]}


@cache
def record(seeds: int = 3, auvs: int = 3) -> Record:
    """Return the record of a small plan: formations of two to four, and which is the answer."""
    scenario = base(auvs)
    candidates = []
    for count in (2, 3, 4):
        for radius in (40.0, 55.0):
            for angle in (0.0, 180.0 / count):
                keys = {"asvs.count": count, "asvs.formation.radius_m": radius}
                keys |= {"asvs.formation.angle_deg": angle}
                stations = team(keys)
                candidates.append(
                    {
                        "keys": keys, "cost": float(count), "asvs": count, "stations": stations,
                        "predicted": {"value": [_guess(scenario, stations)]}, "simulated": None,
                        "verdict": "not flown", "told": "predicted to be worse than others",
                    }
                )  # fmt: skip
    candidates.sort(key=lambda it: (it["asvs"], it["predicted"]["value"][0]))
    for count in (2, 3, 4):
        for it in [it for it in candidates if it["asvs"] == count][:2]:
            it["simulated"] = flown(scenario, it["stations"], seeds)
            high = it["simulated"]["high"][0]
            met = high is not None and high < GOAL["below"]
            it["verdict"], it["told"] = ("meets the goal" if met else "not met"), ""
    met = [n for n, it in enumerate(candidates) if it["verdict"] == "meets the goal"]
    chosen = met[0] if met else None
    runners = [n for n, it in enumerate(candidates) if it["simulated"] and n != chosen][:3]
    return {
        "name": "a plan", "scenario": "quick start.yaml", "scenario_sha256": "0" * 64,
        "versions": {"bindusbl-des": "0.1.0"}, "seed": 0, "goal": [GOAL], "confidence": 0.95,
        "budget_s": None, "budget_missions": None, "missions": 6 * seeds, "settled": True,
        "status": "complete",
        "answer": None if chosen is None else candidates[chosen]["keys"], "chosen": chosen,
        "would": None, "told": [], "run": "bindusbl-des run best.yaml", "candidates": candidates,
        "excluded": [], "runners_up": runners,
        "binding": [
            {"what": "coverage", "told": "AUV0 is out of range of every vessel.", "value": 0.4}
        ],
        "sensitivity": [
            {"told": "HF and MF range -20 %", "keys": {}, "met": False,
             "as_planned": flown(scenario, candidates[runners[0]]["stations"], 2)}
            | flown(scenario, candidates[runners[0]]["stations"], 2)
        ],
        "prediction_error": {GOAL["metric"]: {"median": 0.1, "p90": 0.4}},
    }  # fmt: skip


def drawn(scenario: Scenario | None = None) -> Record:
    """Return what the page draws of the teams that were flown; of a scenario in place of all."""
    flown = [n for n, it in enumerate(record()["candidates"]) if it["simulated"]]
    if scenario is not None:
        return chart_of({n: Setup(scenario) for n in flown})
    return chart_of({n: Setup(moored(record()["candidates"][n]["stations"])) for n in flown})


def moored(stations: Sequence[Sequence[float]], scenario: Scenario | None = None) -> Scenario:
    """Return a scenario, or that which vessels are sought for, with vessels at stations."""
    asvs = {"count": len(stations), "formation": {"positions_m": stations}}
    data = (scenario or base()).model_dump(mode="json")
    return Scenario.model_validate(data | {"asvs": asvs})


def _guess(scenario: Scenario, stations: Sequence[Sequence[float]]) -> float:
    """Return a number that orders teams: how far corners are from their vessels, in HF ranges."""
    half = scenario.survey.side_m / 2
    corners = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    away = np.linalg.norm(corners[:, None] - np.array(stations), axis=2).min(axis=1)
    return float(away.max() / scenario.acoustics.hf.range_m)


def attacked(value: Any) -> Any:
    """Return a record in which every text is an attack, metrics and numbers are as they were."""
    if isinstance(value, dict):
        kept = ("metric", "of")
        return {
            (key if key in record() or key in FIELDS else ATTACK): it
            if key in kept
            else attacked(it)
            for key, it in value.items()
        }
    if isinstance(value, list):
        return [attacked(it) for it in value]
    return ATTACK if isinstance(value, str) else value


FIELDS = (
    *("metric", "below", "of", "keys", "cost", "asvs", "stations", "predicted", "simulated"),
    *(
        "value",
        "mean",
        "low",
        "high",
        "missions",
        "verdict",
        "told",
        "what",
        "met",
        "p90",
        "median",
    ),
)
