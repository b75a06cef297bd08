"""The points of a campaign in a table for the terminal, each with its means."""

from pathlib import Path
from typing import Any

from ..experiments.plan import Plan
from ..storage.parts import MISSIONS
from .intervals import Interval, interval
from .outcomes import outcomes
from .stopping import wide_points

# metric, heading, digits
METRICS = (
    ("position_error_m", "error m", 3),
    ("fixes_delivered", "fixes", 1),
    ("hf_coverage", "coverage", 3),
)
WIDEST = 80

# A larger campaign shows its first points; its tables hold them all.
MOST_ROWS = 40


def points_table(folder: Path, plan: Plan) -> str:
    """Return a row per point: its values, missions, and mean +- 95 % CI of the main metrics."""
    targets = plan.experiment.until_ci
    found = outcomes(folder, [*(it[0] for it in METRICS), *(target.metric for target in targets)])
    shown = range(min(len(plan.points), MOST_ROWS))
    keys = [_short(key, list(plan.columns)) for key in plan.columns]
    rows = [["point", *keys, "ok", *(heading for _, heading, _ in METRICS)]]
    for point in shown:
        labels = [_written(value) for value in plan.points[point].varied.values()]
        values = [found.at(point, metric)[1].tolist() for metric, _, _ in METRICS]
        cells = [_cell(interval(v), it[2]) for v, it in zip(values, METRICS, strict=True)]
        rows.append([str(point), *labels, str(len(values[0])), *cells])
    lines = _lines(rows)
    if len(plan.points) > MOST_ROWS:
        lines.append(f"... {len(plan.points) - MOST_ROWS} more points in {MISSIONS}/")
    lines.append("mean +- 95 % confidence interval over seeds (Student's t)")
    if targets:
        wide = len(wide_points(plan, found))
        asked = ", ".join(f"{target.metric} +- {target.written}" for target in targets)
        lines.append(f"{asked}: reached at {len(plan.points) - wide} of {len(plan.points)} points")
    return "\n".join(lines)


def _short(key: str, keys: list[str]) -> str:
    """Return as many last words of a key as tell it from the others."""
    words = key.split(".")
    for length in range(1, len(words)):
        tail = ".".join(words[-length:])
        if sum(other == tail or other.endswith(f".{tail}") for other in keys) == 1:
            return tail
    return key


def _written(value: Any) -> str:
    if value is None:
        return "null"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _cell(found: Interval, digits: int) -> str:
    if found.count == 0:
        return "-"
    if found.count == 1:
        return f"{found.mean:.{digits}f}"
    return f"{found.mean:.{digits}f} +- {found.half_width:.{digits}f}"


def _lines(rows: list[list[str]]) -> list[str]:
    """Return the rows in columns; those of the varied keys give way where it gets too wide."""
    last = len(rows[0]) - len(METRICS) - 1
    widths = [max(len(row[n]) for row in rows) for n in range(len(rows[0]))]
    while sum(widths) + 2 * len(widths) - 2 > WIDEST and max(widths[1:last], default=0) > 4:
        widest = max(range(1, last), key=lambda n: widths[n])
        widths[widest] -= 1
    lines = ["  ".join(_fit(c, w) for c, w in zip(row, widths, strict=True)) for row in rows]
    shown = [line[:WIDEST].rstrip() for line in lines]
    return [shown[0], "-" * max(map(len, shown)), *shown[1:]]


def _fit(text: str, width: int) -> str:
    return text.rjust(width) if len(text) <= width else f"{text[: width - 1]}~"
