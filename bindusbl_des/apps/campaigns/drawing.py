"""Figures of a campaign: means of one metric over one or two varied keys."""

from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.scenario import keys as table
from ...support.wording import did_you_mean
from ..figures.style import finished
from ..figures.sweeps import Levels, Means, curves, heatmap
from .statistics.intervals import interval
from .statistics.outcomes import JUDGED, check_metrics, failed_because, outcomes, unit

if TYPE_CHECKING:
    from .campaign import Campaign


Cells = dict[tuple[int, int], tuple[float, float, int]]


def means_of(
    campaign: "Campaign", metric: str, x: str | None = None, series: str | None = None
) -> Means:
    """Return the means of a metric over `x` (default: the first numeric key) and `series`.

    Missions that differ in other keys share a cell; the title says so.

    Raises:
        ValueError: when there is no such metric or key, or nothing varies or was run.
    """
    check_metrics([metric])
    varied = _varying(campaign)
    if not varied:
        raise ValueError(f"{campaign.folder}: no key varies, so there is nothing to draw over")
    for key in (x, series):
        if key is not None and key not in varied:
            hint = did_you_mean(key, varied) or f"; it varies {', '.join(varied)}"
            raise ValueError(f"{campaign.folder} does not vary {key!r}{hint}")
    across = _levels(campaign, x or next((k for k in varied if k != series), varied[0]))
    rest = [key for key in varied if key != across.key]
    other = series or (rest[0] if rest else None)
    lines = _levels(campaign, other) if other and other != across.key else None
    cells, gaps = _cells(campaign, metric, across, lines)
    if not cells:
        failed = campaign.state().failed
        why = f": {failed} failed{failed_because(campaign.folder)}" if failed else ""
        raise ValueError(f"{campaign.folder} holds no mission with a {metric} yet{why}")
    title = _title(campaign, varied, across, lines)
    return Means(metric, unit(metric), across, lines, cells, title, gaps)


def _varying(campaign: "Campaign") -> list[str]:
    """Return the keys with several values, numeric ones first."""
    levels = [_levels(campaign, key) for key in campaign.plan.columns]
    several = [level for level in levels if len(level.values) > 1]
    return [level.key for level in sorted(several, key=lambda level: not level.is_numeric)]


def _levels(campaign: "Campaign", key: str) -> Levels:
    values: list[Any] = []
    for point in campaign.plan.points:
        if point.varied[key] not in values:
            values.append(point.varied[key])
    measure = next((row.unit for row in table.settable() if row.key == key), "")
    levels = Levels(key, measure, tuple(values))
    return Levels(key, measure, tuple(sorted(values))) if levels.is_numeric else levels


def _cells(
    campaign: "Campaign", metric: str, x: Levels, series: Levels | None
) -> tuple[Cells, dict[tuple[int, int], tuple[int, int]]]:
    """Return the means, and where AUVs lack a value, how many missions have all values."""
    points = campaign.plan.points
    rows = outcomes(campaign.folder, [metric], len(points))
    whole, well = rows.means(metric).whole, rows.well
    found: dict[tuple[int, int], list[float]] = defaultdict(list)
    served: dict[tuple[int, int], NDArray[np.int64]] = defaultdict(lambda: np.zeros(2, np.int64))
    for number, point in enumerate(points):
        line = series.values.index(point.varied[series.key]) if series else 0
        cell = (x.values.index(point.varied[x.key]), line)
        found[cell] += rows.at(number, metric)[1].tolist()
        served[cell] += (whole[number], well[number])
    bars = {cell: interval(values) for cell, values in found.items()}
    cells = {cell: (bar.mean, bar.half_width, bar.count) for cell, bar in bars.items() if bar.count}
    gaps = {cell: (int(all_), int(of)) for cell, (all_, of) in served.items() if all_ < of}
    return cells, gaps


def _title(campaign: "Campaign", varied: list[str], x: Levels, series: Levels | None) -> str:
    shown = {x.key, series.key if series else ""}
    others = [key for key in varied if key not in shown]
    pooled = f"; pooled over {', '.join(others)}" if others else ""
    seeds = len(campaign.plan.experiment.seeds)
    return f"{campaign.record['name']}: {seeds} seeds, 95 % intervals{pooled}"


KINDS = {"curves": curves, "heatmap": heatmap}


def drawn(
    campaign: "Campaign",
    kind: str,
    width: float,
    path: str | Path | None = None,
    **what: str | None,
) -> Any:
    """Return a figure of a campaign, `width` inches wide; also write it to `path`, if given.

    `what` holds its `metric`, and the keys `x` and `series`, as for `means_of`.

    Raises:
        ValueError: when there is no such kind, format, metric or key, or nothing to draw.
        OSError: when it cannot be written.
    """
    if kind not in KINDS:
        hint = did_you_mean(kind, KINDS) or f"; there are {', '.join(KINDS)}"
        raise ValueError(f"no figure {kind!r} of a campaign{hint}")
    means = means_of(campaign, what.pop("metric", None) or JUDGED[0], **what)
    return finished(lambda inches: KINDS[kind](means, inches), width, path)
