"""The folder of a plan: its question, and whether to begin, continue or replace the plan."""

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from ...core.scenario.files.scenario_file import load_scenario
from ...core.scenario.scenario import Scenario
from ...support.files import read_json, sync, write_text
from ...support.kept_files import FOLDERS, copies_of, keep, placed, renamed_point
from ..campaigns.experiments.experiment import Experiment, laid_over
from ..campaigns.failures import check_name
from ..campaigns.storage.folder import CampaignError, is_locked
from .goals import goals_in
from .question import Question

QUESTION, PLAN, BEST, PAGE = "question.json", "plan.json", "best.yaml", "plan.html"
MISSIONS, DOUBTS = "missions", "sensitivity"
CHARTS = ("plan.geojson", "plan.kml", "plan.kmz", "plan.gpx", "plan.pdf", "qgc")
OURS = {QUESTION, PLAN, BEST, PAGE, MISSIONS, DOUBTS, *CHARTS, *FOLDERS}

COMPLETE, CUT = "complete", "cut"


class PlanError(CampaignError):
    """A plan's folder cannot be begun, continued or read; the message says why, and the remedy."""


def begin(question: Question, folder: Path, *, force: bool = False) -> Question:
    """Create the folder of a plan, or open one to continue; return the question as kept there.

    Raises:
        CampaignError: when no folder can have this name.
        PlanError: when it holds something else, or a finished plan.
        OSError: when it cannot be written.
    """
    check_name(folder)
    record = _record(folder)
    if folder.exists() and record is None and any(folder.iterdir()):
        raise PlanError(f"{folder}: is not empty and no plan; name another folder")
    if is_locked(folder / MISSIONS):
        raise PlanError(f"{folder}: another process is working on this plan; wait for it")
    if record is not None:
        same = record["fingerprint"] == question.fingerprint()
        if same and not force and _status(folder) != COMPLETE:
            seconds, missions = question.budget_s, question.budget_missions
            return replace(resumed(folder), budget_s=seconds, budget_missions=missions)
        if not force:
            which = "this plan, which is finished" if same else "another plan"
            raise PlanError(
                f"{folder}: holds {which}; --force (in Python force=True) makes it anew, or name "
                "another folder"
            )
        _remove(folder)
    folder.mkdir(parents=True, exist_ok=True)
    sync(folder.absolute().parent)
    for number in range(len(question.experiment.points)):
        keep(copies_of(question.experiment.scenario(number).model_dump(mode="json")), folder)
    budget = {"budget_s": question.budget_s, "budget_missions": question.budget_missions}
    asked = {**question.record(), "source": question.source, **budget}
    text = json.dumps({**asked, "fingerprint": question.fingerprint()}, indent=2)
    write_text(folder / QUESTION, f"{text}\n")
    return resumed(folder)


def is_plan_folder(folder: Path) -> bool:
    """Tell whether a folder is a plan's."""
    return (folder / QUESTION).is_file()


def shown_first(record: Mapping[str, Any]) -> int | None:
    """Return the number of the candidate that a plan draws: the answer, or else the nearest."""
    runners = record.get("runners_up") or []
    if record.get("chosen") is not None:
        return int(record["chosen"])
    return int(runners[0]) if runners else None


class DrawnTeam(NamedTuple):
    """The team that a plan's page draws.

    `whose` tells whether it is the answer, `number` its place among the candidates, `team` its
    words, `told` the plan's sentence on it, `goals` and `doubts` the recorded ones, and `ways` the
    tracks (n, 2; m) of ASVs that move.
    """

    scenario: Scenario
    whose: str
    number: int
    team: str
    told: str
    goals: Sequence[Mapping[str, Any]]
    doubts: Sequence[Mapping[str, Any]]
    ways: tuple[list[list[float]], ...]


def drawn_team(folder: Path) -> DrawnTeam:
    """Return the team that a plan's page draws.

    Raises:
        PlanError: when no team was simulated yet, or a file cannot be used.
    """
    shown = None
    with _undamaged(folder):
        if (folder / PLAN).exists():
            record = read_json(folder / PLAN)
            shown = shown_first(record)
        if shown is not None:
            candidate = record["candidates"][shown]
            moving = record.get("ways") or {"asvs": []}
            ways = tuple([list(place) for place in way["places_m"]] for way in moving["asvs"])
            told, goal, doubts = record["told"][0], record["goal"], record["sensitivity"]
            about = shown, candidate["team"], told, goal, doubts, ways
            is_met, keys = record["answer"] is not None, candidate["keys"]
    if shown is None:
        raise PlanError(f"{folder}: no team was flown yet; `bindusbl-des resume` goes on")
    whose = "the answer" if is_met else f"candidate {shown + 1}, the nearest so far"
    if is_met and (folder / BEST).is_file():
        return DrawnTeam(load_scenario(folder / BEST), whose, *about)
    return DrawnTeam(laid_over(resumed(folder).experiment.given, keys), whose, *about)


def resumed(folder: Path) -> Question:
    """Return the question of a plan's folder.

    Raises:
        PlanError: when there is none, it was edited, or another version wrote it.
    """
    record = _record(folder)
    if record is None:
        raise PlanError(f"{folder}: is no folder of a plan (it has no {QUESTION})")
    with _undamaged(folder):
        question = _question(record, folder)
        if question.fingerprint() != record["fingerprint"]:
            raise ValueError("it was edited, or another version of bindusbl-des wrote it")
    return question


def _question(record: dict[str, Any], folder: Path) -> Question:
    points = tuple(
        renamed_point(point, lambda name, _: str((folder / name).resolve()))
        for point in record["varied"]
    )
    given = placed(record["scenario"], folder)
    return Question(
        experiment=Experiment(record["name"], given, points, (0,)),
        goals=goals_in(record["goal"]),
        source=record["source"],
        listed=record["listed"],
        confidence=record["confidence"],
        budget_s=record["budget_s"],
        budget_missions=record["budget_missions"],
        costs=record["costs"],
        seed=record["seed"],
    )


def _record(folder: Path) -> dict[str, Any] | None:
    """Return the recorded question of a folder; None if it is no plan's folder."""
    if not is_plan_folder(folder):
        return None
    with _undamaged(folder):
        record = dict(read_json(folder / QUESTION))
        record["fingerprint"]
    return record


@contextmanager
def _undamaged(folder: Path) -> Iterator[None]:
    """Raise PlanError for a file that lacks a value or holds a wrong one."""
    try:
        yield
    except (AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        why = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        said = (why.splitlines() or [""])[0][:200]
        remedy = "plan anew into another folder"
        raise PlanError(f"{folder / QUESTION}: cannot be used ({said}); {remedy}") from None


def _status(folder: Path) -> str:
    """Return the recorded status of a plan; "" if there is none yet."""
    try:
        return str(read_json(folder / PLAN)["status"])
    except (OSError, ValueError, LookupError, TypeError):
        return ""


def _remove(folder: Path) -> None:
    """Remove a plan, if its folder holds nothing else.

    Raises:
        PlanError: naming other files in it.
    """
    foreign = sorted(
        path.name for path in folder.iterdir() if path.name not in OURS or path.is_symlink()
    )
    if foreign:
        named = ", ".join(foreign[:3])
        raise PlanError(f"{folder}: holds {named}, which no plan wrote, so it is not replaced")
    (folder / QUESTION).unlink()  # first, since without it the rest is no plan
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
