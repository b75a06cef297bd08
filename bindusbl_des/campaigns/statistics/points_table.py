"""The points of a campaign in a table for the terminal, each with its means."""

from collections.abc import Iterator
from pathlib import Path
from textwrap import fill

from ...core.wording import lettered
from ..experiments.plan import ExperimentPlan
from ..storage.parts import MISSIONS
from .contents import in_intervals
from .findings import findings
from .intervals import Interval, interval
from .naming import short_key, written
from .outcomes import JUDGED, Outcomes, outcomes
from .stopping import wide_points

# metric, heading, digits of mean and interval (0: without one)
METRICS = (
    ("worst_position_error_m", "error m", 2, 2),
    ("worst_position_error_p95_m", "95 % m", 2, 2),
    ("worst_fix_age_p95_s", "age s", 1, 0),
    ("position_error_m", "fleet m", 2, 0),
)
WIDEST = 80
SHORTEST_KEY = 4

# A larger campaign shows its first points; its tables hold them all.
MOST_ROWS = 40


def points_table(folder: Path, plan: ExperimentPlan) -> str:
    """Return a row per point: its values, missions, what its worst AUV got; then the findings.

    Means are over the missions that went well, with 95 % intervals.
    """
    targets = plan.experiment.until_ci
    found = outcomes(folder, [*(it[0] for it in METRICS), *(target.metric for target in targets)])
    keys = [short_key(key, list(plan.columns)) for key in plan.columns]
    rows = [["point", *keys, "ok", "worst", *(heading for _, heading, *_ in METRICS)]]
    for point in range(min(len(plan.points), MOST_ROWS)):
        labels = [written(value) for value in plan.points[point].varied.values()]
        cells = [_cell(found, point, *it) for it in METRICS]
        rows.append([str(point), *labels, _well(found, point), _who(found, point), *cells])
    lines = _lines(rows)
    if len(plan.points) > MOST_ROWS:
        lines.append(f"... {len(plan.points) - MOST_ROWS} more points in {MISSIONS}/")
    return "\n".join([*lines, *_told(folder, plan), *_reached(plan, found)])


def _told(folder: Path, plan: ExperimentPlan) -> Iterator[str]:
    """Yield what the columns are, what the missions show, and what the intervals contain."""
    yield _filled(
        "error (mean over time), 95 % (of the time it is below) and age (the last fix is younger "
        "95 % of the time) of each mission's worst AUV; fleet: mean error of all AUVs. Mean +- "
        "95 % confidence interval over seeds (Student's t). "
        + in_intervals(plan, range(len(plan.points)))
    )
    for text in findings(folder, plan).sentences():
        yield _filled(f"* {text}", "  ")


def _filled(text: str, indent: str = "") -> str:
    return fill(
        text, WIDEST, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def _reached(plan: ExperimentPlan, found: Outcomes) -> Iterator[str]:
    """Yield how often the intervals became as narrow as was asked, and over how many missions."""
    targets = plan.experiment.until_ci
    if not targets:
        return
    wide, points = len(wide_points(plan, found)), len(plan.points)
    asked = ", ".join(f"{target.metric} +- {target.written}" for target in targets)
    yield f"{asked}: reached at {points - wide} of {points} points"
    for target in targets:
        whole, well = found.whole(target.metric, points), found.well(points)
        if (whole < well).any():
            yield (
                f"{target.metric}: {int(whole.sum())} of {int(well.sum())} missions have a value "
                "for every AUV"
            )


def _well(found: Outcomes, point: int) -> str:
    """Return how many missions went well, of how many if some failed."""
    well, failed = int(found.ok[found.point == point].sum()), found.failed(point)
    return f"{well}/{well + failed}" if failed else str(well)


def _who(found: Outcomes, point: int) -> str:
    """Return the AUV that is the worst of most missions of a point, marked if not of all."""
    who = found.who(point, JUDGED[0])
    if not who:
        return "-"
    name, count = next(iter(who.items()))
    return name if count == who.total() else f"{name} {count}/{who.total()}"


def _cell(
    found: Outcomes, point: int, metric: str, _: str, digits: int, interval_digits: int
) -> str:
    values = found.at(point, metric)[1].tolist()
    it = interval(values)
    shown = _number(it, digits, interval_digits)
    return shown if it.count == len(values) else f"{shown} ({it.count}/{len(values)})"


def _number(found: Interval, digits: int, interval_digits: int) -> str:
    if found.count == 0:
        return "-"
    if found.count == 1 or not interval_digits:
        return f"{found.mean:.{digits}f}"
    return f"{found.mean:.{digits}f} +- {found.half_width:.{interval_digits}f}"


def _lines(rows: list[list[str]]) -> list[str]:
    """Return the rows in columns; where they get too wide, long keys have letters, told above.

    If that is not enough, the last metrics are left to the report; then values give way.
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
    told = [_filled(", ".join(f"{it}: {key}" for it, key in letters.items()))] if letters else []
    return [*told, lines[0], "-" * max(map(len, lines)), *lines[1:]]


def _widths(rows: list[list[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*rows, strict=True)]


def _total(widths: list[int]) -> int:
    return sum(widths) + 2 * len(widths) - 2


def _fit(text: str, width: int) -> str:
    return text.rjust(width) if len(text) <= width else f"{text[: width - 1]}~"
