"""Goals and teams in words."""

from collections.abc import Sequence

from ..core.wording import counted, plain, significant
from ..records.metrics import unit_of
from .candidates import COUNT, FORMATION, Candidate
from .selection.goals import Goal


def limits(goals: Sequence[Goal]) -> str:
    """Return the goals in words, one after the other.

    >>> limits([Goal("position_error_p95_m", below=1.0)])
    'position_error_p95_m of the worst AUV at most 1 m'
    """
    return " and ".join(f"{goal} {unit(goal)}".strip() for goal in goals)


def unit(goal: Goal) -> str:
    """Return the unit of a goal's metric; empty where it is a share or a count."""
    return "" if unit_of(goal.metric) in ("share", "count") else unit_of(goal.metric)


def said(goal: Goal, value: float) -> str:
    """Return a value of a goal's metric with its unit.

    >>> said(Goal("position_error_p95_m", below=1.0), 0.84123)
    '0.841 m'
    """
    return f"{significant(value)} {unit(goal)}".strip()


def team_told(candidate: Candidate) -> str:
    """Return a team in words: how many vessels, where, and what else is chosen."""
    keys = candidate.keys
    names = ("radius_m", "angle_deg", "positions_m")
    radius, angle, positions = (keys.get(f"{FORMATION}.{name}") for name in names)
    places = " in the scenario's places"
    if candidate.moves:
        places = f" on the move ({candidate.scenario.asvs.formation.choice})"
    elif positions is not None:
        places = " at " + ", ".join(f"({x:g}, {y:g})" for x, y in positions)
    elif candidate.asvs == 1:
        places = " in the middle" if candidate.is_ring else places
    elif radius is not None:
        places = f" on a ring of {radius:g} m, the first at {angle or 0:g} deg"
    others = {
        key: value for key, value in keys.items() if key != COUNT and not key.startswith(FORMATION)
    }
    chosen = ", ".join(f"{key.rpartition('.')[2]} {plain(value)}" for key, value in others.items())
    return f"{counted(candidate.asvs, 'ASV')}{places}{f', {chosen}' if chosen else ''}"
