"""The page of a plan: the answer, a chart to move vessels on, what was simulated, and what if."""

from collections.abc import Mapping, Sequence
from html import escape
from string import Template
from typing import Any

from ...report.page import assembled, asset, filled, number, table
from ...report.run_page import footer
from .wording import bound, goal_told, interval, named, parted, setting, units, value_of

PREDICTOR = (
    *("predict_sights.js", "predict_rounds.js", "predict_errors.js", "predict_waiting.js"),
    *("predict_afterwards.js", "predictor.js", "predict_map.js"),
)
CHART = ("seamap.js", *PREDICTOR, "team.js", "planmap.js", "sliders.js")
SCRIPTS = (*CHART, "pareto.js", "plan.js")

Record = Mapping[str, Any]


def plan_page(record: Record, inputs: Mapping[str, Any] | None = None) -> str:
    """Return the page of a plan as HTML, one file that asks the network for nothing.

    `record` is what `plan.json` holds, `inputs` what the chart needs to know
    (:func:`.chart.chart_of`); without it no vessel can be moved, and the page says so.  What the
    record lacks, the page leaves out.
    """
    goals = record.get("goal") or []
    data = {
        "scenario": record.get("scenario", "SCENARIO.yaml"),
        "goal": [{**goal, **units(goal["metric"])} for goal in goals],
        "candidates": record.get("candidates") or [],
        "chosen": record.get("chosen"),
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
    goals = "; ".join(map(goal_told, record.get("goal") or []))
    head = filled("<h1>{name}</h1><p>{told}</p>", name=record.get("name", "plan"), told=goals)
    return f"<header><div>{head}</div>{asset('theme.html')}</header>"


def _answer(record: Record) -> str:
    """Return the answer: in sentences, in numbers, what binds, and the command that flies it."""
    told = list(record.get("told") or [])
    is_open, none = not record.get("settled", True), not record.get("answer")
    kind = "verdict open" if is_open else "verdict warning" if none else "verdict"
    first = told[0] if told else _plainly(record)
    parts = [filled(f'<p class="{kind}">{{it}}</p>', it=first), _tiles(record)]
    parts += [filled("<p>{it}</p>", it=it) for it in told[1:]]
    if record.get("would"):
        parts.append(filled("<p><b>What would:</b> {it}</p>", it=record["would"]))
    binding = [it for it in record.get("binding") or [] if it.get("told")]
    if binding:
        items = "".join(filled("<li>{it}</li>", it=it["told"]) for it in binding)
        parts.append(f"<h3>What binds</h3><ul>{items}</ul>")
    if record.get("run") and record.get("answer"):
        fly = '<p class="copied">To fly it: <code id="answer-run">{it}</code></p>'
        parts.append(filled(fly, it=record["run"]))
    return f'<section id="answer"><h2>The answer</h2>{"".join(parts)}</section>'


def _plainly(record: Record) -> str:
    """Return the answer where the record has no words for it."""
    if not record.get("answer"):
        return "No candidate is known to meet the goal."
    return "Least team that meets the goal: " + named(record["answer"]) + "."


def _tiles(record: Record) -> str:
    """Return the numbers of the answer; of a null answer what was flown, and how sure one asked."""
    found = [("missions simulated", number(record.get("missions"), 0), "")]
    if record.get("confidence") is not None and record.get("settled", True):
        found.append(("confidence", number(record["confidence"], 0, 100), "%"))
    chosen = _chosen(record)
    if chosen is not None:
        found.insert(0, ("vessels", number(chosen.get("asvs"), 0), ""))
        for place, goal in enumerate(record.get("goal") or []):
            told = units(goal["metric"])
            words = f"{told['words']}, simulated (goal {bound(goal)})"
            mean, span = parted(chosen, place, told["factor"])
            found.insert(1 + place, (words, mean, f"{told['unit']} {span}".strip()))
    tiles = "".join(
        filled(
            "<div><dt>{words}</dt><dd>{it} <small>{unit}</small></dd></div>",
            words=words,
            it=it,
            unit=unit,
        )
        for words, it, unit in found
    )
    return f'<dl class="tiles">{tiles}</dl>'


def _chart(record: Record, inputs: Mapping[str, Any] | None) -> str:
    """Return the section in which vessels are moved; what its numbers are worth, and leave out."""
    if inputs is None:
        return asset("plan_still.html")
    stated = record.get("prediction_error") or {}
    said = [
        f"{units(metric)['words']}: of half of the teams by less than "
        f"{number(it.get('median'), 0, 100)} %, of nine in ten by less than "
        f"{number(it.get('p90'), 0, 100)} %"
        for metric, it in stated.items()
        if any(metric == goal["metric"] for goal in record.get("goal") or [])
    ]
    told = f"Beside simulations they are off ({'; '.join(said)})." if said else ""
    left_out = " ".join(inputs["inputs"].get("approximations") or ())
    return Template(asset("plan.html")).substitute(stated=escape(told), left_out=escape(left_out))


def _chosen(record: Record) -> Record | None:
    """Return the candidate that is the answer, None where nothing is."""
    place, candidates = record.get("chosen"), record.get("candidates") or []
    return candidates[place] if place is not None and place < len(candidates) else None


def _candidates(record: Record) -> str:
    """Return the plot of candidates and the tables of those that were simulated."""
    candidates = record.get("candidates") or []
    flown = [place for place, it in enumerate(candidates) if it.get("simulated")]
    if not candidates:
        return ""
    runners = record.get("runners_up") or []
    chosen = [] if record.get("chosen") is None else [record["chosen"]]
    first = [it for it in (*chosen, *runners) if 0 <= it < len(candidates)]
    rest = [it for it in flown if it not in first]
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
    priced = any(it.get("cost") != it.get("asvs") for it in candidates)
    headings = [("candidate", ""), ("vessels", ""), *([("cost", "")] * priced)]
    for goal in goals:
        told = units(goal["metric"])
        headings += [(f"{told['words']}, predicted", told["unit"]), ("simulated", told["unit"])]
    headings += [("missions", ""), ("verdict", ""), ("settings", "")]
    rows = []
    for place in places:
        it = candidates[place]
        row = [f"{place + 1}", number(it.get("asvs"), 0), *([number(it.get("cost"))] * priced)]
        for which, goal in enumerate(goals):
            factor = units(goal["metric"])["factor"]
            row += [number(value_of(it, "predicted", "value", which), 2, factor)]
            row += [interval(it, which, factor)]
        missions = (it.get("simulated") or {}).get("missions", 0)
        verdict = it.get("verdict") or it.get("told") or ""
        rows.append([*row, number(missions, 0), verdict, named(it.get("keys") or {})])
    return f'<div class="candidates">{table(headings, rows, caption)}</div>'


def _sensitivity(record: Record) -> str:
    """Return what becomes of the answer when the sea, the drift or the fleet is not as planned."""
    cases, goals = record.get("sensitivity") or [], record.get("goal") or []
    if not cases:
        return ""
    headings = [("if", "")]
    for it in goals:
        told = units(it["metric"])
        headings += [(told["words"], told["unit"]), ("as planned", told["unit"])]
    headings += [("missions", ""), ("goal", "")]
    words = {True: "✓ still met", False: "✗ not met", None: "needs more missions"}
    rows = []
    for case in cases:
        row = [case.get("told") or named(case.get("keys") or {})]
        for place, it in enumerate(goals):
            factor = units(it["metric"])["factor"]
            for simulated in (case, case.get("as_planned")):
                row.append(interval({"simulated": simulated}, place, factor))
        rows.append([*row, number(case.get("missions"), 0), words.get(case.get("met"), "-")])
    return (
        '<section id="sensitivity"><h2>If it is not as planned</h2><p class="note">The answer, '
        "simulated again with one thing changed, and beside it as planned with the same seeds; in "
        "brackets the interval that holds the mean with the stated confidence.</p>"
        f"{table(headings, rows, 'Sensitivity of the answer')}</section>"
    )


def _origin(record: Record) -> str:
    parts = [("Scenario", record.get("scenario")), ("sha256", record.get("scenario_sha256"))]
    versions = record.get("versions") or {}
    parts.append(("Versions", ", ".join(f"{name} {it}" for name, it in versions.items())))
    excluded = record.get("excluded") or []
    if excluded:
        parts.append(("Not simulated", "; ".join(str(it.get("told")) for it in excluded)))
    items = "".join(
        f"<dt>{name}</dt><dd><code>{escape(str(it))}</code></dd>" for name, it in parts if it
    )
    if record.get("answer"):
        keys = "".join(f"{setting(key, it)}\n" for key, it in record["answer"].items())
        items += f"<dt>The answer's keys</dt><dd><pre>{escape(keys)}</pre></dd>"
    return (
        '<section id="origin"><h2>What made this plan</h2>'
        f'<dl class="origin">{items}</dl></section>{footer()}'
    )
