"""Answers of several plans side by side, as tenders: team, positions, price, hours, error, and the
error after a loss.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...support.files import read_json
from ...support.wording import aligned, amount, lettered, timed, with_ends
from .answer_text import where_text
from .doubting import became_of
from .folder import PLAN, DrawnTeam, PlanError, drawn_team
from .goals import Goal, goals_in, limits_text, unit_of_goal
from .question import UNPRICED
from .teams import excess

Row = Mapping[str, Any]

# Conditions with a lost vessel
LOSSES = ("lost", "lost_halfway")


def tender(folders: Sequence[Path]) -> list[dict[str, Any]]:
    """Return a row for the answer, or the nearest team, of each plan's folder.

    Each is ``{plan, whose, team, asvs, places, price, duration_s, goal, settled, met, unit, mean,
    low, high, after_loss}``: `places` as in `plan.json`; `price` is None without prices; `unit`,
    `mean` and its 95 % interval have one value for each goal without losses.  `after_loss` is
    ``{told, mean, low, high, met}``, of any lost vessels if the plan asked for that, else the worst
    condition with a loss; None if none was simulated.

    Raises:
        PlanError: when no team was simulated yet, a file cannot be used, or goals differ.
    """
    rows, asked = [], list[list[Goal]]()
    for folder in folders:
        team, record = drawn_team(folder), read_json(folder / PLAN)
        asked.append([goal for goal in goals_in(list(team.goals)) if not goal.lost])
        if asked[-1] != asked[0]:
            raise PlanError(
                f"{folder}: its goal is {limits_text(asked[-1])}, and that of {folders[0]} "
                f"{limits_text(asked[0])}; compare plans of one goal (make one anew with --below), "
                f"or the missions of these: {folders[0] / 'missions'} {folder / 'missions'}"
            )
        rows.append(_row(folder, team, record, asked[0]))
    return rows


def _row(folder: Path, team: DrawnTeam, record: Row, goals: Sequence[Goal]) -> dict[str, Any]:
    candidate = record["candidates"][team.number]
    simulated = candidate.get("simulated") or {}
    is_priced = (record.get("costs") or UNPRICED) != UNPRICED
    return {
        "plan": str(folder),
        "whose": team.whose,
        "team": team.team,
        "asvs": team.scenario.asvs.count,
        "places": candidate.get("places") or [],
        "price": candidate["cost"] if is_priced else None,
        "duration_s": float(team.scenario.duration_s),
        "goal": [goal.record() for goal in goals],
        "settled": bool(record.get("settled")),
        "met": candidate.get("verdict") == "met",
        "unit": [unit_of_goal(goal) for goal in goals],
        **{name: list(simulated.get(name) or ())[: len(goals)] for name in ENDS},
        "after_loss": _after_loss(record, simulated, len(goals)),
    }


ENDS = ("mean", "low", "high")


def _after_loss(record: Row, simulated: Row, goals: int) -> dict[str, Any] | None:
    """Return a team's values with vessels lost, as the plan simulated them."""
    asked = goals_in(record["goal"])
    if lost := [goal for goal in asked if goal.lost]:
        own = {name: list(simulated.get(name) or ())[goals:] for name in ENDS}
        told = lost[0].name.removeprefix(f"{lost[0].metric} with ")
        return {"told": told, **own, "met": True if record.get("answer") else None}
    cases = [case for case in record.get("sensitivity") or () if case.get("what") in LOSSES]
    if not cases:
        return None
    worst = max(cases, key=lambda case: _missing(asked[0], case["mean"][0]))
    return {"told": worst["told"], **{name: worst[name] for name in ENDS}, "met": worst["met"]}


def _missing(goal: Goal, mean: float | None) -> float:
    return excess(goal, float("nan") if mean is None else mean)


def tender_table(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of a tender: a table of numbers, then where the vessels of each team lie."""
    yield from aligned(tender_cells(rows))
    yield from tender_places(rows)


def tender_cells(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return the heading and the rows of the table of a tender, in which plans have letters."""
    metrics = [goal["metric"] for goal in rows[0]["goal"]]
    units = [f" ({unit})" if unit else "" for unit in rows[0]["unit"]]
    errors = [f"{metric}{unit}" for metric, unit in zip(metrics, units, strict=True)]
    return [
        ("plan", "ASVs", "price", "hours", *errors, "goal", "after a loss"),
        *((lettered(number), *_cells(row)) for number, row in enumerate(rows)),
    ]


def tender_places(rows: Sequence[Row]) -> Iterator[str]:
    """Yield in a line each where a vessel of each team lies, and what is left after a loss."""
    for number, row in enumerate(rows):
        for place in row["places"]:
            where = where_text(place) or f"({place['x_m']:g}, {place['y_m']:g}) m"
            yield f"{lettered(number)}, {place['asv']}: {where}"
        loss = row["after_loss"]
        if loss is not None:
            yield f"{lettered(number)}, after a loss: {loss['told']}; {became_of(loss)}"


def _cells(row: Row) -> Iterator[str]:
    yield str(row["asvs"])
    yield "-" if row["price"] is None else amount(row["price"])
    yield timed(row["duration_s"])
    for number in range(len(row["unit"])):
        yield _shown(row, number)
    yield ("met" if row["met"] else "not met") if row["settled"] else "open"
    yield "-" if row["after_loss"] is None else _shown(row["after_loss"], 0)


def _shown(case: Row, number: int) -> str:
    ends = [case[name][number] for name in ENDS if number < len(case[name])]
    if len(ends) < len(ENDS) or None in ends:
        return "-"
    mean, low, high = with_ends(*map(float, ends))
    return f"{mean} [{low}, {high}]"
