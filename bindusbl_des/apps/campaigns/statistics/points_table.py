"""Points of a campaign as a table (terminal, frame, LaTeX), and what their intervals contain."""

import json
from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from pathlib import Path

import numpy as np
import pyarrow as pa

from ....core.records.metrics import quantity
from ....core.results.columns import arrow
from ....core.results.schemas import mission_numbers
from ....support.wording import (
    WIDEST,
    filled,
    lettered,
    number,
    plus_minus,
    printable,
    with_half,
)
from ..experiments.experiment import ExperimentPlan, checkpoints
from ..storage.part_rows import varied_columns
from ..storage.parts import MISSIONS
from .findings import Findings
from .intervals import Interval, interval, short_key, written
from .outcomes import (
    JUDGED,
    MissionOutcomes,
    check_metrics,
    metric_by_metric,
    outcomes,
    unit,
)

SD = "navigation.velocity_bias_sd_m_per_s"
DRIFTS = ("percent_of_distance", "m_per_hour")


def in_intervals(plan: ExperimentPlan, points: Iterable[int]) -> str:
    """Return in sentences which errors differ between the seeds of some points, and which do not.

    An interval over seeds contains only what seeds change.  A velocity bias that is the same for
    every AUV and seed does not contribute, however uncertain it is for a real inertial system.
    """
    if len(plan.experiment.seeds) < 2:
        return "One seed shows no interval."
    differ = any(key.startswith("navigation") for key in plan.columns)
    chosen = list(points) if differ else [0]
    parts = [json.loads(plan.points[point].scenario)["navigation"] for point in chosen]
    drawn = [part["velocity_bias_sd_m_per_s"] for part in parts]
    fixed = [
        not sd and any(part["velocity_bias_m_per_s"]) for sd, part in zip(drawn, parts, strict=True)
    ]
    said = "Intervals are over seeds: noise, losses and the random walk of dead reckoning"
    if any(part["initial_position_sd_m"] for part in parts):
        said += ", errors of the start"
    if any(part.get(key) for part in parts for key in ("scale_factor_sd", "heading_sd_deg")):
        said += ", scale factors and headings of AUVs"
    sheets = [any((part.get("drift") or {}).get(key) for key in DRIFTS) for part in parts]
    if any(sheets):
        said += ", and the inertial systems as drawn by navigation.drift"
    if all(sheets):
        return f"{said}."
    if all(fixed):
        return (
            f"{said}. The velocity bias is the same for every AUV and seed ({SD} is 0), so the "
            "uncertainty of the inertial system is not in them."
        )
    if any(fixed):
        return (
            f"{said}. Where {SD} is 0, the velocity bias is the same for every AUV and seed, so "
            "the uncertainty of the inertial system is not in them there."
        )
    if any(drawn):
        sizes = sorted({sd for sd in drawn if sd})
        span = f"{sizes[0]:g}" if len(sizes) == 1 else f"{sizes[0]:g} to {sizes[-1]:g}"
        return (
            f"{said}, and the inertial systems: a velocity bias is drawn for each AUV and seed "
            f"({SD} is {span})."
        )
    return f"{said}. There is no velocity bias, neither a constant one nor one that is drawn."


# What the columns of a table of points are, besides the varied keys
COLUMNS = {
    "point": "number of the point",
    "metric": "metric of the mission",
    "unit": "unit of the metric",
    "mean": "mean over the missions that have a value",
    "low": "lower end of its 95 % interval over seeds (Student's t); empty for one value",
    "high": "upper end of that interval",
    "n": "missions that have a value",
    "missions": "missions that went well",
}


def points_rows(folder: Path, plan: ExperimentPlan) -> pa.Table:
    """Return a row for each metric and point: mean, 95 % interval, numbers of missions.

    Raises:
        CampaignError: when an older version did not record a metric.
    """
    names, points = mission_numbers(), len(plan.points)
    known = [found.means(name) for name, found in metric_by_metric(folder, names, plan)]
    number = pa.float64()
    keys = varied_columns(plan.columns, [point.varied for point in plan.points])
    columns = {
        "point": arrow(np.tile(np.arange(points), len(names)), pa.int64()),
        **{key: pa.concat_arrays([values] * len(names)) for key, values in keys.items()},
        "metric": arrow(np.repeat(names, points).tolist(), pa.string()),
        "unit": arrow(np.repeat(list(map(unit, names)), points).tolist(), pa.string()),
        "mean": arrow(np.concatenate([means.mean for means in known]), number),
        "low": arrow(np.concatenate([means.mean - means.half_width for means in known]), number),
        "high": arrow(np.concatenate([means.mean + means.half_width for means in known]), number),
        "n": arrow(np.concatenate([means.count for means in known]), pa.int64()),
        "missions": arrow(np.concatenate([means.well for means in known]), pa.int64()),
    }
    fields = [
        pa.field(name, array.type, metadata={"meaning": COLUMNS.get(name, "")})
        for name, array in columns.items()
    ]
    return pa.table(list(columns.values()), schema=pa.schema(fields))


# What LaTeX takes for something else, and how it is written
IN_LATEX = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
}  # fmt: skip


def in_latex(text: str) -> str:
    """Return a text as LaTeX prints it.

    >>> in_latex("range_m 5 %")
    'range\\\\_m 5 \\\\%'
    """
    return "".join(IN_LATEX.get(sign, sign) for sign in text)


def latex_table(folder: Path, plan: ExperimentPlan, name: str, metrics: Sequence[str]) -> str:
    """Return a row per point for LaTeX: varied keys, missions, means with half their 95 % interval.

    Raises:
        ValueError: when there is no such metric.
    """
    check_metrics(metrics)
    found = outcomes(folder, metrics, len(plan.points))
    keys, well, means = list(plan.columns), found.well, [found.means(name) for name in metrics]
    rows = [[*(in_latex(key) for key in keys), "$n$", *(in_latex(quantity(m)) for m in metrics)]]
    for point, planned in enumerate(plan.points):
        values = [in_latex(written(value)) for value in planned.varied.values()]
        cells = [_in_latex(known.at(point), int(well[point])) for known in means]
        rows.append([*values, str(well[point]), *cells])
    head, *body = (f"{' & '.join(row)} \\\\" for row in rows)
    kinds = "".join("l" if plan.columns[key] in ("text", "json") else "r" for key in keys)
    lines = [
        f"% {printable(name)}: means over n missions with half of the 95 % confidence interval",
        "% (Student's t); (k): k of them have a value",
        f"\\begin{{tabular}}{{{kinds}r{'r' * len(metrics)}}}", r"\hline", head, r"\hline",
        *body, r"\hline", r"\end{tabular}",
    ]  # fmt: skip
    return "\n".join([*lines, ""])


def _in_latex(known: Interval, missions: int) -> str:
    if not known.count:
        return "--"
    mean, half = with_half(known.mean, known.half_width)
    text = f"${mean} \\pm {half}$" if isfinite(known.half_width) else f"${mean}$"
    return text if known.count == missions else f"{text} ({known.count})"


# When a point needs no further seeds: its confidence intervals are narrow enough.
#
# Points are looked at when fixed numbers of their seeds have rows, whoever ran them and in
# whatever order, so that a campaign ends with the same missions on any number of workers.


def settled(plan: ExperimentPlan, found: MissionOutcomes) -> Iterator[tuple[int, bool]]:
    """Yield how many seeds each point needs by the present results, and if its targets are met.

    A point at which all missions fail needs no more.
    """
    most = len(plan.experiment.seeds)
    for first in range(0, len(plan), most):
        for count in checkpoints(most):
            begin, end = np.searchsorted(found.mission, (first, first + count)).tolist()
            well = found.ok[begin:end]
            is_narrow = True
            for target in plan.experiment.until_ci:
                known = interval(found.metrics[target.metric][begin:end][well].tolist())
                is_narrow &= known.half_width <= target.half_width(known.mean)  # nan is not enough
            if end - begin < count or is_narrow or not well.any():
                break
        yield count, is_narrow


# metric, heading, decimals at least (none: as its interval has, which is shown), what it is
METRICS = (
    ("worst_position_error_m", "error m", None, "error: the mean over time"),
    ("worst_position_error_p95_m", "95 % m", None, "95 %: it is below that 95 % of the time"),
    ("worst_fix_age_p95_s", "age s", 1, "age: the last fix is younger 95 % of the time"),
    ("position_error_m", "fleet m", 2, "fleet: the mean error of all AUVs"),
)
SHORTEST_KEY = 4

# A larger campaign shows its first points; its tables hold them all.
MOST_ROWS = 40


def points_table(folder: Path, plan: ExperimentPlan, said: Findings) -> str:
    """Return a table with a row for each point, then the findings.

    Means are over successful missions, with 95 % intervals.
    """
    targets = plan.experiment.until_ci
    wanted = [*(metric[0] for metric in METRICS), *(target.metric for target in targets)]
    found = outcomes(folder, wanted, len(plan.points))
    keys = [short_key(key, list(plan.columns)) for key in plan.columns]
    rows = [["point", *keys, "ok", "worst", *(metric[1] for metric in METRICS)]]
    for point in range(min(len(plan.points), MOST_ROWS)):
        labels = [written(value) for value in plan.points[point].varied.values()]
        cells = [_cell(found, point, metric[0], metric[2]) for metric in METRICS]
        rows.append([str(point), *labels, _well(found, point), _who(found, point), *cells])
    lines, shown = _lines(rows)
    if len(plan.points) > MOST_ROWS:
        lines.append(f"... {len(plan.points) - MOST_ROWS} more points in {MISSIONS}/")
    columns = [metric[3] for metric in METRICS[:shown]]
    return "\n".join([*lines, *_told(plan, said, columns), *_reached(plan, found)])


def _told(plan: ExperimentPlan, said: Findings, columns: Sequence[str]) -> Iterator[str]:
    """Yield the meanings of columns, the findings, and what the intervals contain."""
    yield filled(
        f"Of each mission's worst AUV: {'; '.join(columns)}. Mean +- 95 % confidence interval over "
        f"seeds (Student's t). {in_intervals(plan, range(len(plan.points)))}"
    )
    for text in said.sentences():
        yield filled(f"* {text}", "  ")


def _reached(plan: ExperimentPlan, found: MissionOutcomes) -> Iterator[str]:
    """Yield how many points met their targets, and with how many missions."""
    targets = plan.experiment.until_ci
    if not targets:
        return
    points = len(plan.points)
    narrow = sum(is_narrow for _, is_narrow in settled(plan, found))
    asked = ", ".join(f"{target.metric} +- {target.written}" for target in targets)
    yield f"{asked}: reached at {narrow} of {points} points"
    for target in targets:
        whole, well = int(found.means(target.metric).whole.sum()), int(found.well.sum())
        if whole < well:
            yield f"{target.metric}: {whole} of {well} missions have a value for every AUV"


def _well(found: MissionOutcomes, point: int) -> str:
    """Return the number of successful missions, and of all if some failed."""
    well, ran = found.well[point], found.ran[point]
    return f"{well}/{ran}" if well < ran else str(well)


def _who(found: MissionOutcomes, point: int) -> str:
    """Return the AUV that is most often the worst at a point, marked if not always."""
    who = found.who(point, JUDGED[0])
    if not who:
        return "-"
    name, count = next(iter(who.items()))
    return name if count == who.total() else f"{name} {count}/{who.total()}"


def _cell(found: MissionOutcomes, point: int, metric: str, digits: int | None) -> str:
    values = found.at(point, metric)[1].tolist()
    known = interval(values)
    half = known.half_width
    shown = plus_minus(known.mean, half) if digits is None else number(known.mean, digits)
    return shown if known.count == len(values) else f"{shown} ({known.count}/{len(values)})"


def _lines(rows: list[list[str]]) -> tuple[list[str], int]:
    """Return the rows in columns, and how many of METRICS they have.

    In wide tables long keys get letters, which a line above explains; if still too wide, the last
    metrics are left out, then values.
    """
    head, *points = rows
    last = len(head) - len(METRICS) - 2
    saved = {n: len(head[n]) - max(len(row[n]) for row in points) for n in range(1, last)}
    longest_first = sorted((n for n in saved if saved[n] > 0), key=lambda n: -saved[n])
    letters: dict[str, str] = {}
    for n in longest_first:
        if _total(_widths([head, *points])) <= WIDEST:
            break
        letters[lettered(len(letters))], head = head[n], [*head]
        head[n] = next(reversed(letters))
    widths = _widths([head, *points])
    while _total(widths) > WIDEST and len(widths) > last + 3:  # the error stays
        widths.pop()
    while _total(widths) > WIDEST and max(widths[1:last], default=0) > SHORTEST_KEY:
        widest = max(range(1, last), key=lambda n: widths[n])
        widths[widest] -= 1
    lines = ["  ".join(map(_fit, row, widths))[:WIDEST].rstrip() for row in (head, *points)]
    key_lines = (
        [filled(", ".join(f"{letter}: {key}" for letter, key in letters.items()))]
        if letters
        else []
    )
    shown = len(widths) - last - 2
    return [*key_lines, lines[0], "-" * max(map(len, lines)), *lines[1:]], shown


def _widths(rows: list[list[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*rows, strict=True)]


def _total(widths: list[int]) -> int:
    return sum(widths) + 2 * len(widths) - 2


def _fit(text: str, width: int) -> str:
    return text.rjust(width) if len(text) <= width else f"{text[: width - 1]}~"
