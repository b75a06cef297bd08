"""The report of a campaign as a page: what varied, the results with intervals, and failures.

Scripts draw the data: varied keys, and each point's metrics with intervals, packed.  Tables show
the same without scripts: a map of a metric, the fewest ASVs, and all points.
"""

import html
import json
from collections.abc import Sequence
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.records.metrics import WORST, lower_is_better, quantity
from ...core.results.schemas import mission_numbers, schema
from ...support.arrays import Floats
from ...support.wording import counted, decimals, number, plus_minus, with_half
from ..report.page import THEME, Packer, assembled, asset, filled, table
from ..report.run_page import footer
from .experiments.experiment import ExperimentPlan
from .failures import failures_in
from .statistics.findings import ERROR, SUB_METRE, Findings, findings
from .statistics.intervals import short_names, written
from .statistics.outcomes import JUDGED, MEANS, MissionOutcomes, metric_by_metric, outcomes
from .statistics.points_table import in_intervals

if TYPE_CHECKING:
    from .campaign import Campaign

SCRIPTS = ("saving.js", "plots.js", "heatmap.js", "lookup.js", "sweep.js")

# Metrics of a mission that a reader asks for first
FIRST = (*JUDGED, "worst_fix_benefit_m", *MEANS)
# What the table of points shows, the worst AUV by the first of them
TABLED = (*JUDGED[:3], "worst_fix_benefit_m", MEANS[0])
# Of errors that are asked to be small; a page without scripts has the first.
ACCURACIES = (
    "worst_position_error_p95_m",
    "worst_position_error_m",
    "position_error_p95_m",
    "position_error_m",
)
COUNT = "asvs.count"

# Steps of a column, as a share of its largest value: finer than a reader sees.
PRECISION = 1e-6
# A larger campaign shows its first points; its tables hold them all.
MOST_POINTS = 500
# More failures than this are counted, and found in the folder.
MOST_FAILURES = 200
# More rows or columns than this are no map; the table of points has them.
MOST_STEPS = 40
# More combinations of the other keys than this are not shown.
MOST_COMBINATIONS = 300

# A key with more different values than this share of the points was sampled: none comes twice.
SAMPLED = 0.5

# A varied key: its name, its values if all are numbers, and them as text, as they are shown.
Key = dict[str, Any]


def sweep_page(campaign: "Campaign", said: Findings | None = None) -> str:
    """Return the report of a campaign, finished or not, as HTML; `said` may give its findings."""
    plan = campaign.plan
    said = said or findings(campaign.folder, plan)
    packer, points = Packer(), len(plan.points)
    metrics = [*FIRST, *(name for name in mission_numbers() if name not in FIRST)]
    found = outcomes(campaign.folder, FIRST, points)
    varied = _keys(campaign)
    tried = _fewest_points(campaign, varied)
    data = {
        "keys": varied,
        "lookup": tried,
        "metrics": described(metrics),
        "points": [packer.add(column) for column in _value_numbers(campaign, varied)],
        "seeds": [str(seed) for seed in np.unique(found.seed)] if points == 1 else [],
        "statistics": {
            name: _packed_means(those, name, packer)
            for name, those in metric_by_metric(campaign.folder, metrics, plan)
        },
        "count": packer.add(found.well),
        "failed": packer.add(found.ran - found.well),
    }
    failures, story = failures_in(campaign.folder), _story(campaign, found, said)
    body = (
        _head(campaign)
        + f'<section id="story"><h2>What this sweep found</h2>{story}</section>'
        + Template(asset("sweep.html")).substitute(
            heat=_heat_table(campaign, found, FIRST[0], varied) if points > 1 else "",
            mapped="" if points > 1 else " hidden",
            fewest=_fewest_tables(campaign, found, tried) if tried else "",
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


def _packed_means(found: MissionOutcomes, metric: str, packer: Packer) -> dict[str, Any]:
    """Return a metric's mean and half its 95 % interval at each point, packed for a page.

    Both are nan without a value, the interval also with a single one.  `whole` counts missions in
    which all AUVs have a value, if any lacks one.  `each` has every mission's value for a single
    point.
    """
    known, by_seed = found.means(metric), found.by_seed(metric)
    columns = {"mean": _packed(known.mean, packer), "half": _packed(known.half_width, packer)}
    if (known.whole < known.well).any():
        columns["whole"] = packer.add(known.whole)
    if found.points == 1 and by_seed.shape[1] <= MOST_POINTS:
        columns["each"] = _packed(by_seed[0], packer)
    return columns


def _packed(column: Floats, packer: Packer) -> dict[str, Any]:
    known = np.abs(column[np.isfinite(column)])
    largest = float(known.max(initial=0.0))
    return packer.add(column, quantum=largest * PRECISION if largest > 0 else PRECISION)


def _keys(campaign: "Campaign") -> list[Key]:
    """Return the varied keys, numbers in ascending order."""
    found: list[Key] = []
    for key, kind in campaign.plan.columns.items():
        given = [point.varied[key] for point in campaign.plan.points]
        if kind in ("int", "float") and None not in given:
            numbers = sorted(set(map(float, given)))
            found.append({"key": key, "values": numbers, "labels": list(map(written, numbers))})
        else:
            labels = list(dict.fromkeys(map(written, given)))
            found.append({"key": key, "values": None, "labels": labels})
    return found


def _value_numbers(campaign: "Campaign", varied: Sequence[Key]) -> list[list[int]]:
    """Return for each key the index of its value at each point, in the list of values."""
    columns = []
    for key in varied:
        place = {label: number for number, label in enumerate(key["labels"])}
        values = (point.varied[key["key"]] for point in campaign.plan.points)
        columns.append([place[written(value)] for value in values])
    return columns


def described(names: Sequence[str]) -> list[dict[str, Any]]:
    """Return name, words, unit and meaning of metrics, whose they are (worst, fleet, mission), and
    whether `less` is better (None: neither).

    The `title` says whose a quantity is; its `words` do not.
    """
    found = []
    for name in names:
        text = schema("mission").field(name).metadata
        meaning = text[b"meaning"].decode().partition("; null where")[0]
        is_fleet = meaning.startswith("fleet mean of: ")
        of = "worst" if name.startswith(WORST) else "fleet" if is_fleet else "mission"
        words = quantity(name.removeprefix(WORST))
        found.append(
            {
                "name": name,
                "words": words,
                "title": f"{words}, mean of the fleet" if of == "fleet" else quantity(name),
                "unit": text[b"unit"].decode(),
                "meaning": meaning,
                "of": of,
                "less": lower_is_better(name),
            }
        )
    return found


def _head(campaign: "Campaign") -> str:
    state, seeds = campaign.state(), len(campaign.plan.experiment.seeds)
    answer = (
        f"{counted(len(campaign.plan.points), 'point')} with {counted(seeds, 'seed')} each: "
        f"{state.done} missions done, {state.failed} failed, {state.missing} missing"
    )
    head = filled("<h1>{name}</h1><p>{answer}</p>", name=campaign.record["name"], answer=answer)
    return f"<header><div>{head}</div>{THEME}</header>"


def _story(campaign: "Campaign", found: MissionOutcomes, said: Findings) -> str:
    """Return the findings: the best point, harm, missing fixes, collisions, effects of keys."""
    first, _, rest = said.best.partition(". ")
    story = f'<p class="verdict">{_text(first.removesuffix("."))}.</p>'
    story += f"<p>{_text(rest)} {_text(said.sure)}</p>" if rest or said.sure else ""
    alarms = [said.failed, *said.harm, *said.starved, said.collided]
    story += _items("alarms", [text for text in alarms if text])
    effects = _key_effects(campaign.plan, found)
    if effects:
        story += "<p>Mean error of the worst AUV by one key, averaged over the others:</p>"
        story += _items("effects", effects)
    contents = in_intervals(campaign.plan, range(len(campaign.plan.points)))
    return story + f'<p class="note">{_text(contents)}</p>'


def _key_effects(plan: ExperimentPlan, found: MissionOutcomes) -> list[str]:
    """Return for each key the range of the worst AUV's mean errors over its values.

    Keys with the largest effect come first.  Values are compared over the same points of the other
    keys: points without a successful mission are left out at all values, and counted.
    """
    error = found.means(ERROR).mean
    effects = [effect for key in plan.columns if (effect := _effect(plan, key, error)) is not None]
    return [said for _, said in sorted(effects, key=lambda effect: -effect[0])]


def _effect(plan: ExperimentPlan, key: str, error: Floats) -> tuple[float, str] | None:
    """Return the range of means over the values of a key, and its words."""
    values = list(dict.fromkeys(written(point.varied[key]) for point in plan.points))
    if len(values) < 2 or len(values) > SAMPLED * len(plan.points):
        return None
    rows: dict[str, Floats] = {}
    for point, mean in zip(plan.points, error.tolist(), strict=True):
        held = repr([item for item in point.varied.items() if item[0] != key])
        row = rows.setdefault(held, np.full(len(values), np.nan))
        row[values.index(written(point.varied[key]))] = mean
    table = np.array(list(rows.values()))
    seen = ~np.isnan(table).all(axis=0)  # values at which every mission fails tell nothing
    table = table[:, seen]
    whole = ~np.isnan(table).any(axis=1)
    if table.shape[1] < 2 or not whole.any():
        return None
    names = [value for value, is_seen in zip(values, seen, strict=True) if is_seen]
    means = table[whole].mean(axis=0)
    low, high = int(np.argmin(means)), int(np.argmax(means))
    left, places = int((~whole).sum()), max(2, decimals(means[high] - means[low], digits=1))
    rest = f" (without {left} of {len(table)} combinations that lack a value)" * bool(left)
    ends = [f"{number(means[end], places)} m at {names[end]}" for end in (low, high)]
    return float(means[high] - means[low]), f"{key}: {', '.join(ends)}{rest}"


def _items(kind: str, texts: Sequence[str]) -> str:
    items = "".join(f"<li>{_text(text)}</li>" for text in texts)
    return f'<ul class="{kind}">{items}</ul>' if items else ""


def _text(said: str) -> str:
    return html.escape(said).replace(" +- ", "&nbsp;&plusmn;&nbsp;")


def _heat_table(
    campaign: "Campaign", found: MissionOutcomes, metric: str, varied: Sequence[Key]
) -> str:
    """Return a metric along the first key with numbers, a row for each combination of the others;
    "" where there are too many for a map.
    """
    if not varied:
        return ""
    numbers = [key for key in varied if key["values"] is not None and len(key["labels"]) > 1]
    along = (numbers or varied)[0]
    across, rows = along["labels"], _rows(campaign, along["key"])
    if max(len(rows), len(across)) > MOST_STEPS:
        return ""
    known = found.means(metric)
    low, high = np.nanmin([*known.mean, np.inf]), np.nanmax([*known.mean, -np.inf])
    cells, looks = [], {}
    for place, (name, numbered) in enumerate(rows.items()):
        line = [name]
        for column, label in enumerate(across, 1):
            at = numbered.get(label)
            if at is None or not np.isfinite(known.mean[at]):
                line.append("-")
                looks[place, column] = "none"
                continue
            share = (known.mean[at] - low) / (high - low) if high > low else 0.5
            bad = share if lower_is_better(metric) is not False else 1 - share
            looks[place, column] = f"shade{round(10 * (1 - bad))}"
            half = known.half_width[at]
            mean, spread = with_half(known.mean[at], half)
            spread = f"± {spread}" if np.isfinite(half) else "one seed"
            line.append("\n".join(filter(None, (mean, spread, known.gap(at)))))
        cells.append(line)
    names = short_names(list(campaign.plan.columns))
    others = _others(campaign, along["key"])
    corner = f"{others} ↓ {names[along['key']]} →" if others else f"{names[along['key']]} →"
    headings = [(corner, ""), *((label, "") for label in across)]
    return table(headings, cells, "Heatmap", looks).replace("<table>", '<table class="heat">', 1)


def _rows(campaign: "Campaign", along: str) -> dict[str, dict[str, int]]:
    """Return of each combination of the other keys the point at each value of a key."""
    rows: dict[str, dict[str, int]] = {}
    for place, point in enumerate(campaign.plan.points):
        texts = {key: written(value) for key, value in point.varied.items()}
        own = texts.pop(along)
        rows.setdefault(", ".join(texts.values()) or "all", {})[own] = place
    return rows


def _others(campaign: "Campaign", along: str) -> str:
    names = short_names(list(campaign.plan.columns))
    return ", ".join(short for key, short in names.items() if key != along)


def _fewest_points(campaign: "Campaign", varied: Sequence[Key]) -> dict[str, Any] | None:
    """Return the numbers of ASVs that were tried, and a row of points at them for each combination
    of the other keys; None where their number was not varied.
    """
    counts: list[str] = next(
        (key["labels"] for key in varied if key["key"] == COUNT and key["values"]), []
    )
    if len(counts) < 2:
        return None
    rows = list(_rows(campaign, COUNT).values())[:MOST_COMBINATIONS]
    return {"counts": counts, "points": [[row.get(count) for count in counts] for row in rows]}


def _fewest_tables(campaign: "Campaign", found: MissionOutcomes, tried: dict[str, Any]) -> str:
    """Return for each kind of error the fewest ASVs that surely keep it below a metre.

    A script marks the cells again for other limits.
    """
    counts, rows = tried["counts"], list(_rows(campaign, COUNT))
    asvs = ((f"{count} ASV{'s' * (count != '1')}", "m") for count in counts)
    headings = [(_others(campaign, COUNT), ""), *asvs, ("fewest", "")]
    shown = ""
    for metric in ACCURACIES:
        known, texts = found.means(metric), _judged(found, metric)
        upper = known.mean + known.half_width
        lines, looks = [], {}
        for place, points in enumerate(tried["points"]):
            tested = [(n, point) for n, point in enumerate(points) if point is not None]
            sure = [n for n, point in tested if upper[point] < SUB_METRE]
            for n, point in tested:
                if known.mean[point] < SUB_METRE:
                    looks[place, n + 1] = "sure" if n in sure else "near"
            if sure:
                looks[place, sure[0] + 1] = "sure fewest"
            looks[place, len(counts) + 1] = "answer"
            is_known = all(found.ran[point] for _, point in tested)
            none = f"more than {counts[-1]}" if is_known else "not known yet"
            cells = ["-" if point is None else texts[point] for point in points]
            lines.append([rows[place], *cells, counts[sure[0]] if sure else none])
        made = table(headings, lines, "Fewest ASVs", looks)
        hidden = " hidden" * (metric != ACCURACIES[0])
        shown += f'<div id="lookup-{metric}"{hidden}>{made}</div>'
    if len(rows) > MOST_COMBINATIONS:
        shown += f'<p class="note">The first {MOST_COMBINATIONS} of {len(rows)} combinations.</p>'
    return shown


def _judged(found: MissionOutcomes, metric: str) -> list[str]:
    """Return a metric at each point, and on further lines whose it is and what it leaves out."""
    served, texts = found.means("worst_latency_mean_s").whole, _means(found, metric)
    for point, (well, ran) in enumerate(zip(found.well, found.ran, strict=True)):
        lines = [texts[point], _worst_auv(found, point, metric)]
        if well < ran:
            lines.append(f"{well} of {ran} missions")
        if served[point] < well:
            lines.append(f"an AUV without a fix in {well - served[point]}/{well}")
        texts[point] = "\n".join(filter(None, lines))
    return texts


def _means(found: MissionOutcomes, metric: str) -> list[str]:
    """Return a metric at each point as text, and in how many missions all AUVs have it."""
    known = found.means(metric)
    ends = zip(known.mean, known.half_width, strict=True)
    return [
        f"{plus_minus(mean, half).replace('+-', '±')} {known.gap(point)}".rstrip()
        for point, (mean, half) in enumerate(ends)
    ]


def _worst_auv(found: MissionOutcomes, point: int, metric: str) -> str:
    """Return the AUV that is most often the worst at a point, and how often; or ""."""
    name, times = next(iter(found.who(point, metric).items()), ("", 0))
    well = found.well[point]
    return name if times in (0, well) else f"{name} {times}/{well}"


def _points_section(campaign: "Campaign", found: MissionOutcomes) -> str:
    """Return the table of all points with their settings and metrics."""
    metrics, columns = described(TABLED), [_means(found, name) for name in TABLED]
    well, ran = found.well, found.ran
    rows = [
        [
            str(point),
            *map(written, planned.varied.values()),
            f"{well[point]}" if well[point] == ran[point] else f"{well[point]} of {ran[point]}",
            _worst_auv(found, point, TABLED[0]) or "-",
            *(column[point] for column in columns),
        ]
        for point, planned in enumerate(campaign.plan.points[:MOST_POINTS])
    ]
    names = short_names(list(campaign.plan.columns)).values()
    headings = [(name, "") for name in ("point", *names, "missions", "worst AUV")]
    headings += [
        (metric["words"], "worst AUV" if metric["of"] == "worst" else metric["of"])
        for metric in metrics
    ]
    shown = table(headings, rows, "All points").replace('"scroll"', '"scroll tall"', 1)
    cut = f" The first {MOST_POINTS} of {found.points} points." * (found.points > MOST_POINTS)
    return (
        f'<section id="points"><h2>All points</h2>{shown}'
        '<p class="note">Means over the missions that went well, with half of the 95 % confidence '
        "interval; n/m: n of m missions have a value for every AUV. The worst AUV is that of most "
        f"missions by its mean error.{cut}</p></section>"
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
