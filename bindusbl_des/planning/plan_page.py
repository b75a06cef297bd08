"""The page of a plan: the answer, a chart to move vessels on, what was simulated, and what if."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from html import escape
from string import Template
from types import MappingProxyType
from typing import Any

from ..campaigns.statistics.intervals import short_key, written
from ..core.wording import amount, number, significant, timed, with_ends
from ..geometry.geodesy import degrees_text, minutes_text
from ..records.metrics import SHARES, name_of, unit_of
from ..report.page import THEME, assembled, asset, filled, table
from ..report.run_data import survey_data
from ..report.run_page import footer
from ..scenario import declared
from ..scenario.scenario import Scenario
from ..setup import Setup
from .doubting import became_of
from .folder import shown_first
from .prediction.gathering import inputs_of
from .prediction.inputs import Inputs

Record = Mapping[str, Any]

# A reader takes in so many numbers at a glance.
MOST_TILES = 4

# Where one asks for a share of the AUVs, and where for a statistic of all of them.
WHOSE = {"worst": "worst AUV", "mean": "mean of the AUVs"}


def units(metric: str) -> dict[str, Any]:
    """Return words, unit and factor (what is shown of a unit of the metric) of a metric.

    >>> units("hf_coverage")
    {'words': 'pings in HF range', 'unit': '%', 'factor': 100.0}
    """
    try:
        words, unit = name_of(metric), unit_of(metric)
    except KeyError:
        return {"words": metric, "unit": "", "factor": 1.0}
    if metric in SHARES:
        return {"words": words, "unit": "%", "factor": 100.0}
    return {"words": words, "unit": "" if unit == "count" else unit, "factor": 1.0}


def bound(goal: Record) -> str:
    """Return the bound of a goal with its unit.

    >>> bound({"metric": "position_error_p95_m", "below": 1.0})
    'below 1.00 m'
    """
    shown = units(goal["metric"])
    side = "below" if goal.get("below") is not None else "above"
    return f"{side} {significant(goal[side] * shown['factor'])} {shown['unit']}".strip()


def goal_text(goal: Record) -> str:
    """Return a goal in words: what, of whom, below what.

    >>> goal_text({"metric": "position_error_p95_m", "below": 1.0, "of": "worst"})
    'Goal for the worst AUV: position error, 95 % of the time below 1.00 m'
    """
    whose = goal.get("of", "worst")
    who = f"the {WHOSE[whose]}" if whose in WHOSE else f"{100 * float(whose):g} % of the AUVs"
    return f"Goal for {who}: {units(goal['metric'])['words']} {bound(goal)}"


def worded(text: str, goals: Sequence[Record]) -> str:
    """Return what a plan says with the metrics of its goals in words.

    >>> worded("position_error_m 0.80 m", [{"metric": "position_error_m"}])
    'mean position error 0.80 m'
    """
    for goal in goals:
        text = re.sub(rf"\b{goal['metric']}\b", units(goal["metric"])["words"], text)
    return text


def value_of(candidate: Record, part: str, name: str, goal: int) -> float | None:
    """Return one number of a candidate for a goal, None where it has none."""
    values = (candidate.get(part) or {}).get(name) or ()
    return values[goal] if goal < len(values) else None


def parted(candidate: Record, goal: int, factor: float = 1.0) -> tuple[str, str]:
    """Return a simulated mean, and the interval that holds it: "" where it is not known.

    >>> parted({"simulated": {"mean": [0.8], "low": [0.75], "high": [0.85]}}, 0)
    ('0.800', '(0.750 to 0.850)')
    """
    mean, low, high = (
        value_of(candidate, "simulated", name, goal) for name in ("mean", "low", "high")
    )
    if mean is None:
        return "-", ""
    if low is None or high is None:
        return significant(mean * factor), ""
    told, begin, end = with_ends(mean * factor, low * factor, high * factor)
    return told, f"({begin} to {end})"


def interval(candidate: Record, goal: int, factor: float = 1.0) -> str:
    """Return a simulated mean with the interval that holds it, in one text.

    >>> interval({"simulated": {"mean": [0.8], "low": [None], "high": [None]}}, 0)
    '0.800'
    """
    return " ".join(filter(None, parted(candidate, goal, factor)))


def setting(key: str, value: Any) -> str:
    """Return a key and its value as `--set` takes them.

    >>> setting("asvs.formation.positions_m", [[0.0, 40.5]])
    'asvs.formation.positions_m=[[0.0, 40.5]]'
    """
    return f"{key}={value if isinstance(value, str) else json.dumps(value)}"


def named(keys: Record) -> str:
    """Return keys and values for the eye, keys as short as they can be told apart.

    >>> named({"asvs.count": 3, "asvs.formation.radius_m": 47.5})
    'count=3, radius_m=47.5'
    """
    names = list(keys)
    return ", ".join(f"{short_key(key, names)}={written(value)}" for key, value in keys.items())


def chart_of(
    setup: Setup,
    inputs: Inputs,
    candidates: Sequence[Inputs | None] = (),
    moving: Mapping[int, Record] = MappingProxyType({}),
) -> dict[str, Any]:
    """Return what a page needs to move the vessels of a scenario about, as plain data.

    `inputs` are those of the scenario, `candidates` those of each candidate of the plan, in its
    order.  Most candidates differ in their stations alone: `variants` holds each way in which
    some differ in more, as the parts that are not the scenario's, and `variant_of` the number of
    each candidate's (-1: none).  `filters` holds the same of each filter that AUVs could have, and
    `moving` the ways of a candidate's vessels that move, as its record has them.
    """
    own = inputs.plain()
    variants: list[dict[str, Any]] = []
    numbers = []
    for candidate in candidates:
        other = {} if candidate is None else _differing(candidate.plain(), own)
        if other and other not in variants:
            variants.append(other)
        numbers.append(variants.index(other) if other else -1)
    return {
        **survey_data(setup),
        "centre": list(setup.area.centroid),
        "stations": [list(place) for place in setup.kept_stations_m],
        "moving": {number: _ways(ways) for number, ways in moving.items()},
        "inputs": own,
        "variants": variants,
        "variant_of": numbers,
        "filters": dict(_filters(setup.scenario, own)),
    }


def _ways(ways: Record) -> dict[str, Any]:
    asvs = [zip(*way["places_m"], strict=True) for way in ways["asvs"]]
    return {"seed": ways["seed"], "asvs": [dict(zip("xy", way, strict=True)) for way in asvs]}


def _differing(plain: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    return {part: value for part, value in plain.items() if value != own[part]}


def _filters(scenario: Scenario, own: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield each filter that the scenario can have beside its own settings, and what it changes."""
    data = scenario.model_dump()
    for name in declared.NAVIGATORS:
        own_filter = scenario.navigation.filter
        filtered = own_filter if own_filter == name else name  # with its settings
        changed = {**data, "navigation": {**data["navigation"], "filter": filtered}}
        with suppress(ValueError):
            plain = inputs_of(Setup.of(Scenario.model_validate(changed))).plain()
            yield name, {"navigator": plain["navigator"], **_differing(plain, own)}


PREDICTOR = (
    *("predict_sights.js", "predict_rounds.js", "predict_errors.js", "predict_waiting.js"),
    *("predict_afterwards.js", "predictor.js", "predict_map.js"),
)
CHART = ("saving.js", "seamap.js", *PREDICTOR, "team.js", "planmap.js", "sliders.js")
SCRIPTS = (*CHART, "pareto.js", "plan.js")


def plan_page(record: Record, inputs: Mapping[str, Any] | None = None) -> str:
    """Return the page of a plan as HTML, one file that asks the network for nothing.

    `record` is what `plan.json` holds, `inputs` what the chart needs to know
    (:func:`chart_of`); without it no vessel can be moved, and the page says so.  What the
    record lacks, the page leaves out.
    """
    goals = record.get("goal") or []
    data = {
        "scenario": record.get("scenario", "SCENARIO.yaml"),
        "goal": [{**goal, **units(goal["metric"])} for goal in goals],
        "candidates": record.get("candidates") or [],
        "chosen": record.get("chosen"),
        "first": shown_first(record),
        "chart": inputs,
    }
    body = (
        _head(record)
        + _answer(record)
        + _chart(record, inputs)
        + _candidates(record)
        + _sensitivity(record)
        + _origin(record)
    )
    title = f"{record.get('name', 'plan')}: plan"
    return assembled(title, body, SCRIPTS, data, "", ("plan.css",))


def _head(record: Record) -> str:
    goals = "; ".join(map(goal_text, record.get("goal") or []))
    if record.get("duration_s"):
        goals += f"; missions of {timed(record['duration_s'])}"
    head = filled("<h1>{name}</h1><p>{goals}</p>", name=record.get("name", "plan"), goals=goals)
    return f"<header><div>{head}</div>{THEME}</header>"


def _answer(record: Record) -> str:
    """Return the answer: in sentences, in numbers, what binds, and the command that flies it."""
    goals = record.get("goal") or []
    sentences = [worded(text, goals) for text in record.get("told") or []]
    is_open, none = not record.get("settled", True), not record.get("answer")
    kind = "verdict open" if is_open else "verdict warning" if none else "verdict"
    first = sentences[0] if sentences else _plainly(record)
    beside = _fragile(record) + _binding(record)
    parts = [filled(f'<p class="{kind}">{{text}}</p>', text=first), _tiles(record)]
    parts += [f'<div class="pair">{beside}</div>'] if beside else []
    parts += [
        filled("<p>{text}</p>", text=sentence[:1].upper() + sentence[1:])
        for sentence in sentences[1:]
    ]
    if record.get("would"):
        would = worded(record["would"], goals)
        parts.append(filled("<p><b>What would:</b> {text}</p>", text=would))
    if record.get("run") and record.get("answer"):
        fly = '<p class="copied">To fly it: <code id="answer-run">{run}</code></p>'
        parts.append(filled(fly, run=record["run"]))
    parts.append(_places(record))
    return f'<section id="answer"><h2>The answer</h2>{"".join(parts)}</section>'


def _places(record: Record) -> str:
    """Return where the vessels of the team that is drawn lie, "" where that is nowhere on Earth."""
    if (shown := shown_first(record)) is None:
        return ""
    candidates = record.get("candidates") or []
    places = (candidates[shown].get("places") if shown < len(candidates) else None) or []
    rows = [
        (
            str(place.get("asv")),
            *(number(place.get(axis), 1) for axis in ("x_m", "y_m")),
            degrees_text(*where),
            minutes_text(*where),
        )
        for place in places
        if None not in (where := (place.get("lat_deg"), place.get("lon_deg")))
    ]
    if not rows:
        return ""
    whose = "" if record.get("chosen") is not None else f" of candidate {shown + 1}"
    headings = [("vessel", ""), ("north", "m"), ("east", "m"), ("in degrees (WGS-84)", ""),
                ("in degrees and minutes", "")]  # fmt: skip
    title = f"Where the vessels{whose} {'begin' if record.get('ways') else 'lie'}"
    return f'<h3>{title}</h3><div class="places">{table(headings, rows, title)}</div>'


def _binding(record: Record) -> str:
    """Return in a list what keeps the team from being better, "" where it is not known."""
    binding = [relief for relief in record.get("binding") or [] if relief.get("told")]
    if not binding:
        return ""
    goals, team = record.get("goal") or [], shown_first(record)
    of = "" if team is None or record.get("chosen") is not None else f" candidate {team + 1}"
    items = "".join(
        filled("<li>{text}</li>", text=worded(relief["told"], goals)) for relief in binding
    )
    return f"<div><h3>What binds{of}</h3><ul>{items}</ul></div>"


def _fragile(record: Record) -> str:
    """Return in a list what becomes of the goals if it is not as planned, the worst first."""
    cases, goals = record.get("sensitivity") or [], record.get("goal") or []
    if not cases or not goals:
        return ""
    order = {False: 0, None: 1, True: 2}
    shown = units(goals[0]["metric"])
    items = ""
    for case in sorted(cases, key=lambda case: order[case.get("met")]):
        mean = parted({"simulated": case}, 0, shown["factor"])[0]
        planned = parted({"simulated": case.get("as_planned")}, 0, shown["factor"])[0]
        items += filled(
            "<li>{what}: <b>{verdict}</b> ({mean} {unit} instead of {planned})</li>",
            what=case.get("told") or named(case.get("keys") or {}),
            verdict=_verdict(case),
            mean=mean,
            planned=planned,
            unit=shown["unit"],
        )
    untold = f'<p class="note">{escape(UNTOLD)}</p>' if _is_untold(cases) else ""
    return f"<div><h3>If it is not as planned</h3><ul>{items}</ul>{untold}</div>"


UNTOLD = "Each was simulated with the filter as planned: nobody tells it."


def _is_untold(cases: Sequence[Record]) -> bool:
    """Tell whether filters were left as planned, which older plans did not do."""
    return all(case.get("known") is False for case in cases)


def _verdict(case: Record) -> str:
    marks = {True: "✓ ", False: "✗ ", None: ""}
    return marks[case.get("met")] + became_of(case)


def _plainly(record: Record) -> str:
    """Return the answer where the record has no words for it."""
    if not record.get("answer"):
        return "No candidate is known to meet the goal."
    return "Least team that meets the goal: " + named(record["answer"]) + "."


def _tiles(record: Record) -> str:
    """Return the numbers of the answer; of a null answer what was flown, and how sure one asked."""
    found = [("missions simulated", number(record.get("missions"), 0), "", "")]
    if record.get("confidence") is not None and record.get("settled", True):
        found.append(("confidence", number(record["confidence"], 0, 100), "%", ""))
    chosen = _chosen(record)
    if chosen is not None:
        first = [("vessels", number(chosen.get("asvs"), 0), "", "")]
        if _is_priced(record):
            first.append(("cost", amount(chosen["cost"]), "", ""))
        for place, goal in enumerate(record.get("goal") or []):
            shown = units(goal["metric"])
            mean, span = parted(chosen, place, shown["factor"])
            first.append((f"{shown['words']}, simulated", mean, shown["unit"], span))
            missed, flown = _missed(chosen, place)
            if missed is not None:
                first.append(("missions that miss the goal", f"{missed:.0f}", f"of {flown}", ""))
        found = [*first, *found][:MOST_TILES]
    tiles = ""
    for words, value, unit, span in found:
        more = filled("<dd><small>{span}</small></dd>", span=span) if span else ""
        tile = "<dt>{words}</dt><dd>{value} <small>{unit}</small></dd>"
        tiles += f"<div>{filled(tile, words=words, value=value, unit=unit)}{more}</div>"
    return f'<dl class="tiles">{tiles}</dl>'


def _is_priced(record: Record) -> bool:
    """Tell whether teams cost anything else than one for each vessel."""
    teams = record.get("candidates") or []
    return any(team.get("cost") not in (None, team.get("asvs")) for team in teams)


def _missed(candidate: Record, goal: int) -> tuple[float | None, int]:
    """Return how many missions of a candidate missed a goal, None where it is not known, of how
    many.
    """
    share = value_of(candidate, "simulated", "missed", goal)
    flown = int((candidate.get("simulated") or {}).get("missions") or 0)
    return None if share is None else share * flown, flown


def _chart(record: Record, inputs: Mapping[str, Any] | None) -> str:
    """Return the section in which vessels are moved; what its numbers are worth, and leave out."""
    if inputs is None:
        return (
            '<section id="chart"><h2>The chart</h2><p class="note">No vessels can be moved here: '
            "what the predictor needs to know of this scenario is not in the plan. What was "
            "simulated is below.</p></section>"
        )
    stated = record.get("prediction_error") or {}
    said = [
        f"{units(metric)['words']}: of half of the teams by less than "
        f"{number(error.get('median'), 0, 100)} %, of nine in ten by less than "
        f"{number(error.get('p90'), 0, 100)} %"
        for metric, error in stated.items()
        if any(metric == goal["metric"] for goal in record.get("goal") or [])
    ]
    precision = f"Beside simulations they are off ({'; '.join(said)})." if said else ""
    left_out = " ".join(inputs["inputs"].get("approximations") or ())
    if any(candidate.get("stations") == [] for candidate in record.get("candidates") or []):
        precision += " Vessels that move are not predicted: they were simulated."
    return Template(asset("plan.html")).substitute(
        stated=escape(precision), left_out=escape(left_out)
    )


def _chosen(record: Record) -> Record | None:
    """Return the candidate that is the answer, None where nothing is."""
    place, candidates = record.get("chosen"), record.get("candidates") or []
    return candidates[place] if place is not None and place < len(candidates) else None


def _candidates(record: Record) -> str:
    """Return the plot of candidates and the tables of those that were simulated."""
    candidates = record.get("candidates") or []
    flown = [place for place, candidate in enumerate(candidates) if candidate.get("simulated")]
    if not candidates:
        return ""
    runners = record.get("runners_up") or []
    chosen = [] if record.get("chosen") is None else [record["chosen"]]
    first = [place for place in (*chosen, *runners) if 0 <= place < len(candidates)]
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
    """Return candidates as a table; a script makes of each row's name a button that shows it."""
    goals, candidates = record.get("goal") or [], record["candidates"]
    priced = _is_priced(record)
    headings = [("candidate", ""), ("vessels", ""), *([("cost", "")] * priced)]
    for goal in goals:
        shown = units(goal["metric"])
        headings += [(f"{shown['words']}, predicted", shown["unit"]), ("simulated", shown["unit"])]
    headings += [("missions", ""), ("verdict", ""), ("settings", "")]
    rows = []
    for place in places:
        candidate = candidates[place]
        row = [
            f"{place + 1}",
            number(candidate.get("asvs"), 0),
            *([amount(candidate["cost"])] * priced),
        ]
        for which, goal in enumerate(goals):
            factor = units(goal["metric"])["factor"]
            row += [number(value_of(candidate, "predicted", "value", which), 2, factor)]
            row += [interval(candidate, which, factor)]
        missions = number((candidate.get("simulated") or {}).get("missions", 0), 0)
        missed = [_missed(candidate, which)[0] or 0.0 for which in range(len(goals))]
        if max(missed, default=0.0):
            missions += f", {max(missed):.0f} miss"
        verdict = candidate.get("verdict") or candidate.get("told") or ""
        rows.append([*row, missions, verdict, named(candidate.get("keys") or {})])
    return f'<div class="candidates">{table(headings, rows, caption)}</div>'


def _sensitivity(record: Record) -> str:
    """Return what becomes of the answer when the sea, the drift or the fleet is not as planned."""
    cases, goals = record.get("sensitivity") or [], record.get("goal") or []
    if not cases:
        return ""
    headings = [("if", "")]
    for goal in goals:
        shown = units(goal["metric"])
        headings += [(shown["words"], shown["unit"]), ("as planned", shown["unit"])]
    headings += [("missions", ""), ("goal", "")]
    untold = f" {UNTOLD}" if _is_untold(cases) else ""
    rows = []
    for case in cases:
        row = [case.get("told") or named(case.get("keys") or {})]
        for place, goal in enumerate(goals):
            factor = units(goal["metric"])["factor"]
            for simulated in (case, case.get("as_planned")):
                row.append(interval({"simulated": simulated}, place, factor))
        rows.append([*row, number(case.get("missions"), 0), _verdict(case)])
    return (
        '<section id="sensitivity"><h2>If it is not as planned, in numbers</h2>'
        '<p class="note">The answer, '
        "simulated again with one thing changed, and beside it as planned with the same seeds; in "
        f"brackets the interval that holds the mean with the stated confidence.{untold}</p>"
        f"{table(headings, rows, 'Sensitivity of the answer')}</section>"
    )


def _origin(record: Record) -> str:
    parts = [("Scenario", record.get("scenario")), ("sha256", record.get("scenario_sha256"))]
    versions = record.get("versions") or {}
    parts.append(("Versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    excluded = record.get("excluded") or []
    if excluded:
        parts.append(("Not simulated", "; ".join(str(group.get("told")) for group in excluded)))
    items = "".join(
        f"<dt>{name}</dt><dd><code>{escape(str(value))}</code></dd>"
        for name, value in parts
        if value
    )
    if record.get("answer"):
        keys = "".join(f"{setting(key, value)}\n" for key, value in record["answer"].items())
        items += f"<dt>The answer's keys</dt><dd><pre>{escape(keys)}</pre></dd>"
    return (
        '<section id="origin"><h2>What made this plan</h2>'
        f'<dl class="origin">{items}</dl></section>{footer()}'
    )
