"""The report of a campaign: what it varied, what came of it, how sure that is, and what failed.

A campaign as data of a page: its varied keys, and each point's metrics with their intervals.
"""

import html
import json
from collections.abc import Sequence
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.wording import counted
from ..records.metrics import WORST, lower_is_better, quantity
from ..report.page import THEME, Packer, assembled, asset, filled, table
from ..report.run_page import footer
from ..results.schemas import mission_numbers, schema
from .failures import failures_in
from .statistics.differences import key_effects
from .statistics.findings import Findings, findings
from .statistics.intervals import intervals, short_names, written
from .statistics.outcomes import JUDGED, MEANS, MissionOutcomes, metric_by_metric, outcomes
from .statistics.points_table import in_intervals
from .sweep_tables import fewest_points, fewest_tables, heat_table, means, worst_auv

if TYPE_CHECKING:
    from .campaign import Campaign

# Steps of a column, as a share of its largest value: more than anybody reads.
PRECISION = 1e-6


def packed_statistics(
    found: MissionOutcomes, metric: str, points: int, packer: Packer
) -> dict[str, Any]:
    """Return mean and half the 95 % interval of a metric at each point, packed for a page.

    As :func:`.statistics.intervals.interval` says: nan where no mission that went well
    has a value, and no interval of a single one.  Where some AUV has no value, `whole` tells in how
    many missions all have one.  Of a single point `each` has the value of each mission.
    """
    table = found.by_seed(metric, points)
    known, whole = intervals(table), found.whole(metric, points)
    columns = {
        "mean": packer.add(known.mean, quantum=quantum(known.mean)),
        "half": packer.add(known.half_width, quantum=quantum(known.half_width)),
    }
    if (whole < found.well(points)).any():
        columns["whole"] = packer.add(whole)
    if points == 1 and table.shape[1] <= MOST_POINTS:
        columns["each"] = packer.add(table[0], quantum=quantum(table[0]))
    return columns


def quantum(column: np.ndarray) -> float:
    """Return the step to which a column is rounded in a page."""
    known = np.abs(column[np.isfinite(column)])
    return float(known.max()) * PRECISION if len(known) and known.max() > 0 else PRECISION


def keys(campaign: "Campaign") -> list[dict[str, Any]]:
    """Return the varied keys with their values, numbers in ascending order."""
    return [
        {"key": key, "values": values(campaign, key), "labels": labels(campaign, key)}
        for key in campaign.plan.columns
    ]


def values(campaign: "Campaign", key: str) -> list[float] | None:
    """Return the different values of a key if all of them are numbers."""
    if campaign.plan.columns[key] not in ("int", "float"):
        return None
    found = {point.varied[key] for point in campaign.plan.points}
    return None if None in found else sorted(float(value) for value in found)


def labels(campaign: "Campaign", key: str) -> list[str]:
    """Return the different values of a key as text, in the order in which they are shown."""
    numbers = values(campaign, key)
    if numbers is not None:
        return [written(value) for value in numbers]
    return list(dict.fromkeys(written(point.varied[key]) for point in campaign.plan.points))


def value_numbers(campaign: "Campaign") -> list[list[int]]:
    """Return of each key, at each point, the number of its value in the list of values."""
    columns = []
    for key in campaign.plan.columns:
        place = {label: number for number, label in enumerate(labels(campaign, key))}
        columns.append([place[written(point.varied[key])] for point in campaign.plan.points])
    return columns


def described(names: Sequence[str]) -> list[dict[str, Any]]:
    """Return name, words, unit and meaning of metrics, whose they are (worst, fleet, mission), and
    whether `less` is better (None: neither is).

    The `title` says whose a quantity is, its `words` leave that to a heading.
    """
    columns = schema("mission")
    found = []
    for name in names:
        text = columns.field(name).metadata
        meaning = text[b"meaning"].decode().partition("; null where")[0]
        of = _whose(name, meaning)
        words = quantity(name.removeprefix(WORST))
        title = f"{words}, mean of the fleet" if of == "fleet" else quantity(name)
        unit = text[b"unit"].decode()
        found.append(
            {
                "name": name,
                "words": words,
                "title": title,
                "unit": unit,
                "meaning": meaning,
                "of": of,
                "less": lower_is_better(name),
            }
        )
    return found


def _whose(name: str, meaning: str) -> str:
    if name.startswith(WORST):
        return "worst"
    return "fleet" if meaning.startswith("fleet mean of: ") else "mission"


SCRIPTS = ("saving.js", "plots.js", "heatmap.js", "lookup.js", "sweep.js")

# Metrics of a mission that a reader asks for first
FIRST = (*JUDGED, "worst_fix_benefit_m", *MEANS)
# What the table of points shows, the worst AUV by the first of them
TABLED = (*JUDGED[:3], "worst_fix_benefit_m", MEANS[0])
# A larger campaign shows its first points; its tables hold them all.
MOST_POINTS = 500
# More failures than this are counted, and found in the folder.
MOST_FAILURES = 200


def sweep_page(campaign: "Campaign", said: Findings | None = None) -> str:
    """Return the report of a campaign, finished or not, as HTML; `said` is found unless given."""
    said = said or findings(campaign.folder, campaign.plan)
    packer, points = Packer(), len(campaign.plan.points)
    metrics = [*FIRST, *(name for name in mission_numbers() if name not in FIRST)]
    found = outcomes(campaign.folder, FIRST)
    well, ran = found.well(points), np.bincount(found.point, minlength=points)
    varied = keys(campaign)
    tried = fewest_points(campaign, varied)
    data = {
        "keys": varied,
        "lookup": tried,
        "metrics": described(metrics),
        "points": [packer.add(column) for column in value_numbers(campaign)],
        "seeds": [str(seed) for seed in np.unique(found.seed)] if points == 1 else [],
        "statistics": {
            name: packed_statistics(those, name, points, packer)
            for name, those in metric_by_metric(campaign.folder, metrics, len(campaign.plan))
        },
        "count": packer.add(well),
        "failed": packer.add(ran - well),
    }
    failures, story = failures_in(campaign.folder), _story(campaign, found, said)
    body = (
        _head(campaign)
        + f'<section id="story"><h2>What this sweep found</h2>{story}</section>'
        + Template(asset("sweep.html")).substitute(
            heat=heat_table(campaign, found, FIRST[0], varied) if points > 1 else "",
            mapped="" if points > 1 else " hidden",
            fewest=fewest_tables(campaign, found, tried) if tried else "",
            unvaried="" if tried else " hidden",
            over=" over the varied keys" if points > 1 else "",
            single="" if points > 1 else " hidden",
            metric=html.escape(described(FIRST[:1])[0]["title"]),
        )
        + _points_section(campaign, found)
        + _failure_section(failures)
        + _origin(campaign)
    )
    return assembled(f"{campaign.record['name']}: sweep", body, SCRIPTS, data, packer.text())


def _head(campaign: "Campaign") -> str:
    state, seeds = campaign.state(), len(campaign.plan.experiment.seeds)
    answer = (
        f"{counted(len(campaign.plan.points), 'point')} with {counted(seeds, 'seed')} each: "
        f"{state.done} missions done, {state.failed} failed, {state.missing} missing"
    )
    head = filled("<h1>{name}</h1><p>{answer}</p>", name=campaign.record["name"], answer=answer)
    return f"<header><div>{head}</div>{THEME}</header>"


def _story(campaign: "Campaign", found: MissionOutcomes, said: Findings) -> str:
    """Return what was found: the best point, harm, want of fixes, collisions, effects of keys."""
    first, _, rest = said.best.partition(". ")
    story = f'<p class="verdict">{_text(first.removesuffix("."))}.</p>'
    story += f"<p>{_text(rest)} {_text(said.sure)}</p>" if rest or said.sure else ""
    alarms = [said.failed, *said.harm, *said.starved, said.collided]
    story += _items("alarms", [text for text in alarms if text])
    effects = key_effects(campaign.plan, found)
    if effects:
        story += "<p>Mean error of the worst AUV by one key, averaged over the others:</p>"
        story += _items("effects", effects)
    contents = in_intervals(campaign.plan, range(len(campaign.plan.points)))
    return story + f'<p class="note">{_text(contents)}</p>'


def _items(kind: str, texts: Sequence[str]) -> str:
    items = "".join(f"<li>{_text(text)}</li>" for text in texts)
    return f'<ul class="{kind}">{items}</ul>' if items else ""


def _text(said: str) -> str:
    return html.escape(said).replace(" +- ", "&nbsp;&plusmn;&nbsp;")


def _points_section(campaign: "Campaign", found: MissionOutcomes) -> str:
    """Return all points with their settings and metrics, which a page without scripts has too."""
    points, metrics = len(campaign.plan.points), described(TABLED)
    columns = [means(found, name, points) for name in TABLED]
    well, ran = found.well(points), np.bincount(found.point, minlength=points)
    rows = [
        [
            str(point),
            *(written(value) for value in campaign.plan.points[point].varied.values()),
            f"{well[point]}" if well[point] == ran[point] else f"{well[point]} of {ran[point]}",
            worst_auv(found, point, TABLED[0], well[point]) or "-",
            *(column[point] for column in columns),
        ]
        for point in range(min(points, MOST_POINTS))
    ]
    names = short_names(list(campaign.plan.columns)).values()
    headings = [(name, "") for name in ("point", *names, "missions", "worst AUV")]
    headings += [
        (metric["words"], "worst AUV" if metric["of"] == "worst" else metric["of"])
        for metric in metrics
    ]
    shown = table(headings, rows, "All points").replace('"scroll"', '"scroll tall"', 1)
    more = f" The first {MOST_POINTS} of {points} points." if points > MOST_POINTS else ""
    return (
        f'<section id="points"><h2>All points</h2>{shown}'
        '<p class="note">Means over the missions that went well, with half of the 95 % confidence '
        "interval; n/m: n of m missions have a value for every AUV. The worst AUV is that of most "
        f"missions by its mean error.{more}</p></section>"
    )


def _failure_section(failures: list[dict[str, Any]]) -> str:
    if not failures:
        return '<section id="failures"><h2>Failures</h2><p>No mission failed.</p></section>'
    rows = [
        [
            str(failure["mission"]),
            _settings(failure["varied"]),
            str(failure["seed"]),
            failure["error"],
            failure["reproduce"],
        ]
        for failure in failures[:MOST_FAILURES]
    ]
    headings = [(name, "") for name in ("mission", "point", "seed", "error", "to see it again")]
    more = len(failures) - len(rows)
    rest = f"<p>{more} more are in the folder failures/.</p>" if more else ""
    shown = table(headings, rows, "Missions that failed")
    return (
        '<section id="failures" class="texts"><h2>Failures</h2>'
        f"<p>{counted(len(failures), 'mission')} failed.</p>{shown}{rest}</section>"
    )


def _settings(varied: dict[str, Any]) -> str:
    return ", ".join(f"{key}={written(value)}" for key, value in varied.items())


def _origin(campaign: "Campaign") -> str:
    record = campaign.record
    versions = ", ".join(f"{name} {number}" for name, number in record["versions"].items())
    seeds = ", ".join(map(str, campaign.plan.experiment.seeds[:40]))
    more = ", ..." if len(campaign.plan.experiment.seeds) > 40 else ""
    text = json.dumps(record["scenario"], indent=2, ensure_ascii=False)
    return (
        filled(
            '<section id="origin"><h2>What made this sweep</h2><dl class="origin">'
            "<dt>Base scenario</dt><dd>{name}, sha256 <code>{scenario}</code></dd>"
            "<dt>Plan</dt><dd>sha256 <code>{plan}</code></dd><dt>Seeds</dt><dd>{seeds}{more}</dd>"
            "<dt>Versions</dt><dd>{versions}</dd></dl>"
            "<details><summary>The base scenario in full, as JSON (JSON is YAML)</summary>"
            "<pre>{text}</pre></details></section>",
            name=record["scenario"]["name"],
            scenario=record["scenario_sha256"],
            plan=record["plan_sha256"],
            seeds=seeds,
            more=more,
            versions=versions,
            text=text,
        )
        + footer()
    )
