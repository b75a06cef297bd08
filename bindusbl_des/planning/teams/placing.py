"""The keys that put a team in its places, wherever the scenario or other keys have it."""

from typing import Any

from ..questions.question import Question
from ..selection.goals import Floats
from .candidates import COUNT, FORMATION, Candidate, Keys, candidate


def ring_keys(question: Question, radius: float, angle: float) -> dict[str, Any]:
    """Return the keys of a regular formation of a radius (m) and an angle (deg)."""
    ring = {f"{FORMATION}.radius_m": radius, f"{FORMATION}.angle_deg": angle}
    return {**_taken_back(question, "model", "positions_m", "positions_deg"), **ring}


def place_keys(question: Question, places: Floats) -> dict[str, Any]:
    """Return the keys of ASVs at places (n, 2), m."""
    positions = {COUNT: len(places), f"{FORMATION}.positions_m": places.round(3).tolist()}
    return {**_taken_back(question, "model", "radius_m", "positions_deg"), **positions}


def unplaced(question: Question) -> dict[str, Any]:
    """Return the keys that take back the positions of the scenario, where it gives any."""
    return _taken_back(question, "model", "positions_m", "positions_deg")


def placed(question: Question, keys: Keys, places: dict[str, Any]) -> Candidate | None:
    """Return a team whose keys put it somewhere else; None where that is no scenario."""
    kept = {key: value for key, value in keys.items() if not key.startswith(FORMATION)}
    return candidate(question, {**kept, **places})


def _taken_back(question: Question, *names: str) -> dict[str, Any]:
    """Return the keys that undo what the scenario says of its formation, where it says that."""
    asked = question.base.asvs.formation
    given = [name for name in names if getattr(asked, name, None) is not None]
    keys: dict[str, Any] = {f"{FORMATION}.{name}": None for name in given}
    if getattr(asked, "clearance_m", 0.0):
        keys[f"{FORMATION}.clearance_m"] = 0.0
    return keys
