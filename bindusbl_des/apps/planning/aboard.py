"""The sheet of a plan for its skipper, in plain words without keys of the network."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

from ...core.setup import Setup
from ...support.wording import counted, timed
from .answer_text import located, where_texts
from .doubting import by_surprise
from .folder import DrawnTeam
from .plan_page import condition, goal_text, interval, of_goal, parted, verdict, worded

Record = Mapping[str, Any]

# Order of verdicts: conditions that miss the goal come first.
ORDER = {False: 0, None: 1, True: 2}


# Columns of the tables, each with its share of the width
PLACES = (("", 0.13), ("degrees and minutes", 0.36), ("degrees", 0.31), ("north, east (m)", 0.2))
DOUBTS = (("if", 0.42), ("{}", 0.24), ("told", 0.08), ("as planned", 0.12), ("goal", 0.14))
IF_NOT = "If it is not as planned (simulated; told: to the filters of the AUVs)"
KEY = "Stars: vessels; dashed: how far they hear AUVs; coloured: lanes of AUVs."


def plain_words(team: DrawnTeam) -> str:
    """Return the plan's sentence on a team: how many vessels, what they reach, and the goal."""
    count = team.scenario.asvs.count
    vessels = counted(count, "vessel") if count else "AUVs alone"
    return worded(team.told.replace(team.team, vessels), team.goals)


def write_sheet(team: DrawnTeam, path: Path, *, replace: bool = True) -> dict[str, int]:
    """Write the sheet of a plan as PDF: chart, places and doubts; return the number of pages.

    Raises:
        ValueError: when the scenario has no position on Earth.
        FileExistsError: when the file exists and may not be replaced.
        OSError: when the file cannot be written.
    """
    from ..export.chart_files import planned_lanes
    from ..figures.skippers import LETTERS, Sheet, Table, room_for, skippers_sheet
    from ..figures.style import save, styled

    setup = Setup.of(team.scenario)
    [middle] = setup.on_earth([(0.0, 0.0)])
    lanes = planned_lanes(setup)
    goals = [{**goal, **of_goal(goal)} for goal in team.goals]
    paragraphs = [plain_words(team), *_fleet(setup)]
    places, doubts = _places(team, setup, lanes), _doubts(team.doubts, goals)
    room = room_for(paragraphs, 2)

    def width(columns: Sequence[tuple[str, float]]) -> int:
        return int(LETTERS * columns[0][1]) - 2

    doubts = _cut(doubts, max(room - len(places), room // 2), "in plan.html", width(DOUBTS))
    places = _cut(places, room - len(doubts), "in plan.json", width(PLACES))
    begins = f"Where vessels {'begin' if team.ways else 'lie'} and AUVs begin (WGS-84)"
    tables = [Table(begins, PLACES, places)]
    if doubts:
        reached = f"{goals[0]['words']} ({goals[0]['unit']})"
        columns = [(name.format(reached), share) for name, share in DOUBTS]
        tables.append(Table(IF_NOT, columns, doubts))
    [(_, origin)] = where_texts(dict(zip(("lat_deg", "lon_deg"), middle, strict=False)))
    key = KEY if team.scenario.asvs.count else "Coloured: lanes of AUVs."
    foot = f"{key} x = y = 0 of the plan is {origin}. Not for navigation."
    subtitle = "; ".join(map(goal_text, goals))
    sheet = Sheet(team.scenario.name, subtitle, paragraphs, tables, foot)
    with styled():
        save(skippers_sheet(setup, sheet, lanes, team.ways), path, replace=replace)
    return {"page": 1}


def _fleet(setup: Setup) -> list[str]:
    """Describe the AUVs and the mission's end in one sentence."""
    depths = sorted({auv.depth_m for auv in setup.auvs})
    speeds = sorted({auv.speed_m_per_s for auv in setup.auvs})
    deep, fast = (" to ".join(f"{one:g}" for one in dict.fromkeys((ends[0], ends[-1])))
                  for ends in (depths, speeds))  # fmt: skip
    text = f"{counted(len(setup.auvs), 'AUV')}, {deep} m deep, {fast} m/s"
    ends = float(setup.scenario.duration_s)
    try:
        flown = float(setup.survey_end_s)
    except ValueError:  # the survey has no known end
        return [f"{text}. The mission ends after {timed(ends)}."]
    if flown > ends:
        return [f"{text}. The mission ends after {timed(ends)}; all lanes take {timed(flown)}."]
    return [f"{text}. All lanes are flown after {timed(flown)}; the mission takes {timed(ends)}."]


def _places(team: DrawnTeam, setup: Setup, lanes: Mapping[int, Any]) -> list[tuple[str, ...]]:
    stations = [tuple(way[0]) for way in team.ways] or setup.kept_stations_m
    named = [(f"ASV{number}", tuple(place)) for number, place in enumerate(stations)]
    named += [(f"AUV{number}", tuple(lane[0].tolist())) for number, lane in lanes.items()]
    on_earth = located(setup, [place for _, place in named])
    return [
        (name, minutes, degrees, f"{place['x_m']:.1f}, {place['y_m']:.1f}")
        for (name, _), place in zip(named, on_earth, strict=True)
        for degrees, minutes in where_texts(place)
    ]


def _doubts(cases: Sequence[Record], goals: Sequence[Record]) -> list[tuple[str, ...]]:
    """Return a row for each condition: the first goal if filters do not know it, and if they do.

    Conditions that miss the goal come first.
    """
    factor = goals[0]["factor"]
    return [
        (
            condition(case),
            interval(case, 0, factor),
            "" if known is None else parted(known, 0, factor)[0],
            parted(case.get("as_planned"), 0, factor)[0],
            verdict(case),
        )
        for case, known in sorted(by_surprise(cases), key=lambda pair: ORDER[pair[0].get("met")])
    ]


def _cut(rows: list[tuple[str, ...]], most: int, where: str, width: int) -> list[tuple[str, ...]]:
    """Return rows in at most `most` lines, their first cells wrapped to a width (letters); the last
    line says where to find the others.
    """
    nothing = [""] * (len(rows[0]) - 1) if rows else []
    each = [
        [
            (line, *(nothing if number else row[1:]))
            for number, line in enumerate(wrap(row[0], width))
        ]
        for row in rows
    ]
    kept: list[tuple[str, ...]] = []
    if sum(map(len, each)) <= most:
        return [line for lines in each for line in lines]
    while not kept or len(kept) + len(each[0]) < most:
        kept += each.pop(0)
    return [*kept, (f"and {len(each)} more", where, *nothing[1:])]
