"""The page of a plan: the answer, a chart of each team, simulated values, and worse conditions."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from functools import partial
from html import escape
from string import Template
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core.records.metrics import name_of, unit_of
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.wording import LONG_S, amount, counted, number, significant, timed, with_ends
from ..campaigns.statistics.intervals import short_key, written
from ..export.chart_files import planned_lanes
from ..report.page import THEME, assembled, asset, filled, table
from ..report.run_data import seen_data, survey_data
from ..report.run_page import footer
from .answer_text import where_texts
from .doubting import became_of, by_surprise
from .folder import shown_first
from .prediction.forecast import Forecast

Record = Mapping[str, Any]

# The most numbers shown in large type.
MOST_TILES = 4

# Words for the AUVs that a goal judges.
WHOSE = {"worst": "worst AUV", "mean": "mean of the AUVs"}


def units(metric: str) -> dict[str, Any]:
    """Return words, unit and factor (shown number per unit of the metric) of a metric.

    >>> units("hf_coverage")
    {'words': 'pings in HF range', 'unit': '%', 'factor': 100.0}
    """
    try:
        words, unit = name_of(metric), unit_of(metric)
    except KeyError:
        return {"words": metric, "unit": "", "factor": 1.0}
    if unit == "share":
        return {"words": words, "unit": "%", "factor": 100.0}
    return {"words": words, "unit": "" if unit == "count" else unit, "factor": 1.0}


def of_goal(goal: Record) -> dict[str, Any]:
    """Return words, unit and factor of a goal.

    >>> of_goal({"metric": "hf_coverage", "lost": 1})["words"]
    'pings in HF range, with any vessel lost'
    """
    own, lost = units(goal["metric"]), goal.get("lost") or 0
    losing = f", with any {'vessel' if lost == 1 else f'{lost} vessels'} lost" if lost else ""
    return {**own, "words": f"{own['words']}{losing}"}


def goal_text(goal: Record) -> str:
    """Return a goal in words: whose metric, on which side of which limit.

    >>> goal = {"metric": "position_error_p95_m", "below": 1.0, "of": "worst"}
    >>> goal_text({**goal, **units(goal["metric"])})
    'Goal for the worst AUV: position error, 95 % of the time below 1.00 m'
    """
    whose = goal.get("of", "worst")
    who = f"the {WHOSE[whose]}" if whose in WHOSE else f"{100 * float(whose):g} % of the AUVs"
    side = "below" if goal.get("below") is not None else "above"
    bound = f"{side} {significant(goal[side] * goal['factor'])} {goal['unit']}".strip()
    return f"Goal for {who}: {goal['words']} {bound}"


def worded(text: str, goals: Sequence[Record]) -> str:
    """Replace the metrics of goals in a sentence of the plan by their words.

    >>> worded("position_error_m 0.80 m", [{"metric": "position_error_m"}])
    'mean position error 0.80 m'
    """
    for goal in goals:
        text = re.sub(rf"\b{goal['metric']}\b", units(goal["metric"])["words"], text)
    return text


def value_of(part: Record | None, name: str, goal: int) -> float | None:
    """Return one goal's number from a predicted or simulated record; None if missing."""
    values = (part or {}).get(name) or ()
    return values[goal] if goal < len(values) else None


def parted(simulated: Record | None, goal: int, factor: float = 1.0) -> tuple[str, str]:
    """Return a simulated mean and its interval as two texts; "" for an unknown interval.

    >>> parted({"mean": [0.8], "low": [0.75], "high": [0.85]}, 0)
    ('0.800', '(0.750 to 0.850)')
    """
    mean, low, high = (value_of(simulated, name, goal) for name in ("mean", "low", "high"))
    if mean is None:
        return "-", ""
    if low is None or high is None:
        return significant(mean * factor), ""
    told, begin, end = with_ends(mean * factor, low * factor, high * factor)
    return told, f"({begin} to {end})"


def interval(simulated: Record | None, goal: int, factor: float = 1.0) -> str:
    """Return a simulated mean and its interval as one text.

    >>> interval({"mean": [0.8], "low": [None], "high": [None]}, 0)
    '0.800'
    """
    return " ".join(filter(None, parted(simulated, goal, factor)))


def setting(key: str, value: Any) -> str:
    """Return a key and its value as `--set` takes them.

    >>> setting("asvs.formation.positions_m", [[0.0, 40.5]])
    'asvs.formation.positions_m=[[0.0, 40.5]]'
    """
    return f"{key}={value if isinstance(value, str) else json.dumps(value)}"


def named(keys: Record) -> str:
    """Return keys and values for reading, keys as short as they stay distinct.

    >>> named({"asvs.count": 3, "asvs.formation.radius_m": 47.5})
    'count=3, radius_m=47.5'
    """
    names = list(keys)
    return ", ".join(f"{short_key(key, names)}={written(value)}" for key, value in keys.items())


def chart_of(
    teams: Mapping[int, Setup], moving: Mapping[int, Record] = MappingProxyType({})
) -> dict[str, Any]:
    """Return the drawings of teams, by their numbers among the candidates, as plain data.

    `moving` maps a team to its recorded tracks if its vessels move.  `first` holds the first team's
    drawing, `teams` how each drawing differs from it, `forecasts` the prediction of each with
    sentences on what that leaves out, or None.
    """
    drawn = {str(n): _scene(setup, moving.get(n)) for n, setup in teams.items()}
    first = next(iter(drawn.values()))
    return {
        "first": first,
        "teams": {
            number: {part: value for part, value in scene.items() if value != first[part]}
            for number, scene in drawn.items()
        },
        "forecasts": {str(number): _forecast(setup) for number, setup in teams.items()},
    }


def _scene(setup: Setup, moving: Record | None) -> dict[str, Any]:
    """Return a team's drawing: survey, lanes of AUVs, vessels with their range, or their tracks."""
    ways = [[place] for place in setup.kept_stations_m]
    if moving is not None:
        ways = [way["places_m"] for way in moving["asvs"]]
    lanes = planned_lanes(setup)
    return {
        "land": [],
        "keepOut": [],
        **survey_data(setup),
        "hf": {"reach": setup.horizontal_reach_m},
        "mf": {"reach": setup.horizontal_mf_reach_m},
        "broadcasting": setup.scenario.protocol.sends_frames,
        "auvs": [_track(f"AUV{number}", lane.round(2)) for number, lane in lanes.items()],
        "asvs": [
            {**_track(f"ASV{number}", np.array(way)), **seen_data(setup, number, _plain)}
            for number, way in enumerate(ways)
        ],
        "seed": None if moving is None else moving["seed"],
    }


def _track(name: str, places: Floats) -> dict[str, Any]:
    return {"name": name, "x": places[:, 0].tolist(), "y": places[:, 1].tolist()}


def _plain(axis: Floats) -> list[float]:
    return [float(value) for value in axis.round(2)]


def _forecast(setup: Setup) -> dict[str, Any] | None:
    try:
        forecast = Forecast(setup)
    except ValueError:  # a user-defined part, or vessels that move
        return None
    found = forecast.errors(setup.kept_stations_m, "lanes")
    return {**found, "left_out": list(forecast.left_out)}


SCRIPTS = ("saving.js", "seamap.js", "planmap.js", "pareto.js", "plan.js")

# Defaults of a record, and of a candidate, that lack a value
PLAN = {
    **{"name": "plan", "settled": True},
    **dict.fromkeys(("goal", "told", "candidates", "runners_up", "binding", "sensitivity"), ()),
    **dict.fromkeys(("duration_s", "confidence", "missions", "scenario_sha256", "ways")),
    **dict.fromkeys(("scenario", "chosen", "answer", "would", "run")),
    **{"excluded": (), "versions": {}, "prediction_error": {}},
}
CANDIDATE = {
    **dict.fromkeys(("asvs", "cost", "predicted", "simulated", "stations")),
    **{"places": (), "keys": {}, "verdict": "", "told": ""},
}


def plan_page(record: Record, chart: Record | None = None) -> str:
    """Return the page of a plan as one HTML file that loads nothing from the network.

    `record` is `plan.json`, `chart` the result of :func:`chart_of`; without it nothing is drawn,
    and the page says so.  The page omits what the record lacks.
    """
    whole = _whole(record, PLAN)
    candidates = whole["candidates"]
    whole["goal"] = [{**goal, **of_goal(goal)} for goal in whole["goal"]]
    whole["candidates"] = [_whole(candidate, CANDIDATE) for candidate in candidates]
    for name in ("chosen", "runners_up"):
        if not candidates:
            whole[name] = PLAN[name]
    data = {
        "goal": _of_whole(whole["goal"]),
        "candidates": list(candidates),
        "chosen": record.get("chosen"),
        "chart": None if chart is None else {**chart, "forecasts": _shades(chart)},
        "first": None if chart is None else _first_drawn(record, chart),
    }
    sections = (_head, _answer, partial(_chart, chart), _candidates, _sensitivity, _origin)
    body = "".join(section(whole) for section in sections)
    return assembled(f"{whole['name']}: plan", body, SCRIPTS, data, "", ("plan.css",))


def _of_whole(goals: Sequence[Record]) -> list[Record]:
    """Return the goals without lost vessels."""
    return [goal for goal in goals if not goal.get("lost")]


def _whole(given: Record, usual: Record) -> dict[str, Any]:
    return {**usual, **{name: value for name, value in given.items() if value is not None}}


def _head(record: Record) -> str:
    goals = "; ".join(map(goal_text, record["goal"]))
    if record["duration_s"]:
        goals += f"; missions of {timed(record['duration_s'])}"
    head = filled("<h1>{name}</h1><p>{goals}</p>", name=record["name"], goals=goals)
    return f"<header><div>{head}</div>{THEME}</header>"


def _answer(record: Record) -> str:
    """Return the answer: in sentences, in numbers, what binds, and the command that flies it."""
    goals, answer = record["goal"], record["answer"]
    first, *others = [worded(text, goals) for text in record["told"]] or [_plainly(answer)]
    kind = "verdict" if answer else "verdict warning"
    kind = kind if record["settled"] else "verdict open"
    parts = [filled(f'<p class="{kind}">{{text}}</p>', text=first), _tiles(record)]
    if beside := _fragile(record) + _binding(record):
        parts.append(f'<div class="pair">{beside}</div>')
    parts += [filled("<p>{text}</p>", text=text[:1].upper() + text[1:]) for text in others]
    if record["would"]:
        would = worded(record["would"], goals)
        parts.append(filled("<p><b>What would:</b> {text}</p>", text=would))
    if record["run"] and answer:
        fly = '<p class="copied">To fly it: <code id="answer-run">{run}</code></p>'
        parts.append(filled(fly, run=record["run"]))
    parts.append(_places(record))
    return f'<section id="answer"><h2>The answer</h2>{"".join(parts)}</section>'


def _plainly(answer: Record | None) -> str:
    """Return the answer in words if the record has none."""
    if not answer:
        return "No candidate is known to meet the goal."
    return f"Least team that meets the goal: {named(answer)}."


def _places(record: Record) -> str:
    """Return a table of the drawn team's stations; "" if they are not on Earth."""
    if (shown := shown_first(record)) is None:
        return ""
    rows = [
        (
            str(place.get("asv")),
            *(number(place.get(axis), 1) for axis in ("x_m", "y_m")),
            degrees,
            minutes,
        )
        for place in record["candidates"][shown]["places"]
        for degrees, minutes in where_texts(place)
    ]
    if not rows:
        return ""
    whose = "" if record["chosen"] is not None else f" of candidate {shown + 1}"
    headings = [("vessel", ""), ("north", "m"), ("east", "m"), ("in degrees (WGS-84)", ""),
                ("in degrees and minutes", "")]  # fmt: skip
    title = f"Where the vessels{whose} {'begin' if record['ways'] else 'lie'}"
    return f'<h3>{title}</h3><div class="places">{table(headings, rows, title)}</div>'


def _binding(record: Record) -> str:
    """Return a list of what limits the team; "" if unknown."""
    told = [relief["told"] for relief in record["binding"] if relief.get("told")]
    if not told:
        return ""
    shown = shown_first(record)
    of = "" if shown is None or record["chosen"] is not None else f" candidate {shown + 1}"
    items = [filled("<li>{text}</li>", text=worded(text, record["goal"])) for text in told]
    return f"<div><h3>What binds{of}</h3><ul>{''.join(items)}</ul></div>"


def _fragile(record: Record) -> str:
    """Return a list of worse conditions with their verdicts, missed goals first."""
    cases, goals = record["sensitivity"], _of_whole(record["goal"])
    if not cases or not goals:
        return ""
    order, shown = {False: 0, None: 1, True: 2}, goals[0]
    items = ""
    for case, known in sorted(by_surprise(cases), key=lambda pair: order[pair[0].get("met")]):
        told = f"; {parted(known, 0, shown['factor'])[0]} if the filter knows" if known else ""
        items += filled(
            "<li>{what}: <b>{verdict}</b> ({mean} {unit} instead of {planned}{told})</li>",
            what=condition(case),
            verdict=verdict(case),
            mean=parted(case, 0, shown["factor"])[0],
            planned=parted(case.get("as_planned"), 0, shown["factor"])[0],
            unit=shown["unit"],
            told=told,
        )
    untold = f'<p class="note">{escape(UNTOLD)}</p>' if _is_untold(cases) else ""
    return f"<div><h3>If it is not as planned</h3><ul>{items}</ul>{untold}</div>"


UNTOLD = (
    "Simulated with the filter as planned, since the crew does not know; of what it could know of, "
    "it was simulated a few times with a filter that does."
)


def _is_untold(cases: Sequence[Record]) -> bool:
    """Tell whether filters were left as planned; plans of older versions did not record it."""
    return all("known" in case for case in cases)


def condition(case: Record) -> str:
    """Return the words of a worse condition."""
    return case.get("told") or named(case.get("keys") or {})


def verdict(case: Record) -> str:
    """Return the verdict on the goals under a condition."""
    marks = {True: "✓ ", False: "✗ ", None: ""}
    return marks[case.get("met")] + became_of(case)


def _tiles(record: Record) -> str:
    """Return the numbers in large type: those of the answer, and what was simulated."""
    found = [("missions simulated", number(record["missions"], 0), "", "")]
    if record["confidence"] is not None and record["settled"]:
        found.append(("confidence", number(record["confidence"], 0, 100), "%", ""))
    if record["chosen"] is not None:
        chosen = record["candidates"][record["chosen"]]
        first = [("vessels", number(chosen["asvs"], 0), "", "")]
        if _is_priced(record):
            first.append(("cost", amount(chosen["cost"]), "", ""))
        for place, goal in enumerate(record["goal"]):
            mean, span = parted(chosen["simulated"], place, goal["factor"])
            first.append((f"{goal['words']}, simulated", mean, goal["unit"], span))
            if (missed := _missed(chosen, place)) is not None:
                flown = int(chosen["simulated"].get("missions") or 0)
                first.append(("missions that miss the goal", f"{missed:.0f}", f"of {flown}", ""))
        found = [*first, *found][:MOST_TILES]
    tiles = ""
    for words, value, unit, span in found:
        more = filled("<dd><small>{span}</small></dd>", span=span) if span else ""
        tile = "<dt>{words}</dt><dd>{value} <small>{unit}</small></dd>"
        tiles += f"<div>{filled(tile, words=words, value=value, unit=unit)}{more}</div>"
    return f'<dl class="tiles">{tiles}</dl>'


def _is_priced(record: Record) -> bool:
    """Tell whether costs differ from the number of vessels."""
    return any(team["cost"] not in (None, team["asvs"]) for team in record["candidates"])


def _missed(candidate: Record, goal: int) -> float | None:
    """Return how many missions of a candidate missed a goal; None if unknown."""
    simulated = candidate["simulated"]
    share = value_of(simulated, "missed", goal)
    return None if share is None else share * int(simulated.get("missions") or 0)


def _first_drawn(record: Record, chart: Record) -> int:
    """Return the number of the team that the map shows first."""
    shown = shown_first(record)
    drawn = [int(n) for n in chart["forecasts"]]
    return shown if shown in drawn else drawn[0]


def _shades(chart: Record) -> dict[str, Any]:
    """Return the prediction that shades each team's map, or None."""
    return {n: told and told["shade"] for n, told in chart["forecasts"].items()}


def _chart(chart: Record | None, record: Record) -> str:
    """Return the section with the map, and each team's predicted and simulated values."""
    teams = [] if chart is None else [n for n in chart["forecasts"] if _knows(record, n)]
    if chart is None or not teams:
        return (
            '<section id="chart"><h2>The chart</h2><p class="note">No team is drawn here, since '
            "none was simulated yet. What is known is below.</p></section>"
        )
    words = {goal["metric"]: goal["words"] for goal in record["goal"]}
    said = [
        f"{words[metric]}: of half of the teams by less than "
        f"{number(error.get('median'), 0, 100)} %, of nine in ten by less than "
        f"{number(error.get('p90'), 0, 100)} %"
        for metric, error in record["prediction_error"].items()
        if metric in words
    ]
    precision = f"Beside simulations they are off ({'; '.join(said)})." if said else ""
    shown = _first_drawn(record, chart)
    drawn = [_drawn(int(n), chart, record, hidden=int(n) != shown) for n in teams]
    option = '<option value="{team}">{words}</option>'
    options = "".join(filled(option, team=n, words=_named(int(n), record)) for n in teams)
    return Template(asset("plan.html")).substitute(
        stated=escape(precision), teams=options, drawn="".join(drawn)
    )


def _knows(record: Record, team: str) -> bool:
    return int(team) < len(record["candidates"])


def _named(team: int, record: Record) -> str:
    """Return a candidate in words."""
    asvs = record["candidates"][team]["asvs"]
    which = f"candidate {team + 1}: {counted(asvs, 'vessel')}"
    return f"the answer, {which}" if team == record["chosen"] else which


# Metrics shown of each AUV, whatever the goal; and the error shown if no goal is one
ALWAYS, ERROR = ("hf_coverage", "fix_rate_hz", "fix_age_max_s"), "position_error_p95_m"
SHORT = {
    "hf_coverage": ("in HF range", "%", 100.0),
    "fix_rate_hz": ("fixes", "/min", 60.0),
    "fix_age_max_s": ("oldest fix", "s", 1.0),
    "fix_age_mean_s": ("mean age", "s", 1.0),
    "fix_age_p95_s": ("95 % age", "s", 1.0),
    "position_error_m": ("mean error", "m", 1.0),
    "position_error_rms_m": ("RMS error", "m", 1.0),
    "position_error_p95_m": ("95 % error", "m", 1.0),
}


def _drawn(team: int, chart: Record, record: Record, *, hidden: bool) -> str:
    """Return a team's text beside the map: verdict, predictions of AUVs, what they leave out."""
    forecast, candidate = chart["forecasts"][str(team)], record["candidates"][team]
    goals = _of_whole(record["goal"])
    kind = "verdict warning" if candidate["verdict"] == "not met" else "verdict"
    reached = "; ".join(_reached(candidate, *goal) for goal in enumerate(goals))
    told = ": ".join(filter(None, (candidate["verdict"], reached)))
    parts = [filled(f'<p class="{kind}">{{text}}.</p>', text=told[:1].upper() + told[1:])]
    if forecast is None:
        seed = chart["teams"][str(team)].get("seed", chart["first"]["seed"])
        ways = "" if seed is None else f" Drawn are its ways in the mission of seed {seed}."
        parts.append(f'<p class="note">Nothing is predicted of this team.{ways}</p>')
    else:
        parts.append(_auvs(forecast, goals))
        parts += [filled('<p class="note">{text}</p>', text=text) for text in forecast["left_out"]]
    attribute = " hidden" if hidden else ""
    return f'<div class="drawn" data-team="{team}"{attribute}>{"".join(parts)}</div>'


def _reached(candidate: Record, place: int, goal: Record) -> str:
    """Return a goal's simulated and predicted value, and its limit."""
    side = "below" if goal.get("below") is not None else "above"
    asked = f"{side} {significant(goal[side] * goal['factor'])} {goal['unit']}".strip()
    flown = int((candidate["simulated"] or {}).get("missions") or 0)
    reached = f"{interval(candidate['simulated'], place, goal['factor'])} {goal['unit']}".strip()
    simulated = f"{reached} in {counted(flown, 'mission')}" if flown else "not simulated"
    value = value_of(candidate["predicted"], "value", place)
    predicted = "" if value is None else f", predicted {significant(value * goal['factor'])}"
    return f"{goal['words']} {simulated}{predicted}, asked for {asked}"


def _auvs(forecast: Record, goals: Sequence[Record]) -> str:
    """Return a table of the predicted metrics of each AUV, and of a mission's worst."""
    asked = [goal["metric"] for goal in goals if goal["metric"] in SHORT]
    error = next((metric for metric in asked if metric.startswith("position_error")), ERROR)
    names = [name for name in SHORT if name in (*ALWAYS, *asked[:1], error)]
    headings = [("predicted", ""), *(SHORT[name][:2] for name in names)]
    rows = [(f"AUV{n}", auv) for n, auv in enumerate(forecast["auvs"])]
    rows.append(("worst of a mission", forecast["worst"]))
    cells = [[who, *(_cell(name, values[name]) for name in names)] for who, values in rows]
    return table(headings, cells, "Each AUV, predicted")


def _cell(name: str, value: float | None) -> str:
    _, unit, factor = SHORT[name]
    if value is None or not math.isfinite(value):
        return "-"
    return timed(value) if unit == "s" and value >= LONG_S else significant(value * factor)


def _candidates(record: Record) -> str:
    """Return the plot of candidates, and tables of the simulated ones."""
    candidates = record["candidates"]
    if not candidates:
        return ""
    chosen = [] if record["chosen"] is None else [record["chosen"]]
    first = [*chosen, *record["runners_up"]]
    flown = [place for place, candidate in enumerate(candidates) if candidate["simulated"]]
    rest = [place for place in flown if place not in first]
    tables = ""
    if first:
        title = "The answer and its runners-up" if chosen else "What came nearest"
        tables += f"<h3>{title}</h3>" + _table(record, first, title)
    if rest:
        tables += (
            f"<details><summary>The other {len(rest)} that were simulated</summary>"
            + _table(record, rest, "Other simulated candidates")
            + "</details>"
        )
    return asset("pareto.html") + tables + "</section>"


def _table(record: Record, places: Sequence[int], caption: str) -> str:
    """Return candidates as a table; a script turns each row's name into a button that draws it."""
    goals, priced = record["goal"], _is_priced(record)
    headings = [("candidate", ""), ("vessels", ""), *([("cost", "")] * priced)]
    for goal in goals:
        headings += [(f"{goal['words']}, predicted", goal["unit"]), ("simulated", goal["unit"])]
    headings += [("missions", ""), ("verdict", ""), ("settings", "")]
    rows = []
    for place in places:
        candidate = record["candidates"][place]
        row = [f"{place + 1}", number(candidate["asvs"], 0)]
        row += [amount(candidate["cost"])] * priced
        for which, goal in enumerate(goals):
            predicted = value_of(candidate["predicted"], "value", which)
            row.append(number(predicted, 2, goal["factor"]))
            row.append(interval(candidate["simulated"], which, goal["factor"]))
        missions = number((candidate["simulated"] or {}).get("missions", 0), 0)
        missed = max((_missed(candidate, which) or 0.0 for which in range(len(goals))), default=0.0)
        if missed:
            missions += f", {missed:.0f} miss"
        verdict = candidate["verdict"] or candidate["told"]
        rows.append([*row, missions, verdict, named(candidate["keys"])])
    return f'<div class="candidates">{table(headings, rows, caption)}</div>'


def _sensitivity(record: Record) -> str:
    """Return the table of the answer's values under worse conditions."""
    cases, goals = record["sensitivity"], _of_whole(record["goal"])
    if not cases:
        return ""
    headings = [("if", "")]
    for goal in goals:
        headings += [(words, goal["unit"]) for words in (goal["words"], "as planned", "more by")]
    headings += [("missions", ""), ("goal", "")]
    untold = f" {UNTOLD}" if _is_untold(cases) else ""
    rows = []
    for case in cases:
        numbers = []
        for place, goal in enumerate(goals):
            numbers.append(interval(case, place, goal["factor"]))
            numbers.append(parted(case.get("as_planned"), place, goal["factor"])[0])
            numbers.append(interval(case.get("difference"), place, goal["factor"]))
        rows.append([condition(case), *numbers, number(case.get("missions"), 0), verdict(case)])
    return (
        '<section id="sensitivity"><h2>If it is not as planned, in numbers</h2>'
        '<p class="note">The answer, '
        "simulated again with one thing changed, and beside it as planned with the same seeds, "
        "and by how much it is more in pairs of missions; in brackets the interval of 95 %."
        f"{untold}</p>"
        f"{table(headings, rows, 'Sensitivity of the answer')}</section>"
    )


def _origin(record: Record) -> str:
    versions = record["versions"].items()
    parts = {
        "Scenario": record["scenario"],
        "sha256": record["scenario_sha256"],
        "Versions": ", ".join(f"{name} {version}" for name, version in versions),
        "Not simulated": "; ".join(str(group.get("told")) for group in record["excluded"]),
    }
    items = "".join(
        f"<dt>{name}</dt><dd><code>{escape(str(value))}</code></dd>"
        for name, value in parts.items()
        if value
    )
    if record["answer"]:
        keys = "".join(f"{setting(key, value)}\n" for key, value in record["answer"].items())
        items += f"<dt>The answer's keys</dt><dd><pre>{escape(keys)}</pre></dd>"
    return (
        '<section id="origin"><h2>What made this plan</h2>'
        f'<dl class="origin">{items}</dl></section>{footer()}'
    )
