"""Tables of a campaign's page: the map as it is without scripts, and the fewest ASVs."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.wording import plus_minus, with_half
from ..records.metrics import lower_is_better
from ..report.page import table
from .statistics.findings import SUB_METRE
from .statistics.intervals import intervals, short_names, written
from .statistics.outcomes import MissionOutcomes

if TYPE_CHECKING:
    from .campaign import Campaign

# More rows or columns than this are no map; the table of points has them.
MOST_STEPS = 40
# Of errors that are asked to be small; a page without scripts has the first.
ACCURACIES = (
    "worst_position_error_p95_m",
    "worst_position_error_m",
    "position_error_p95_m",
    "position_error_m",
)
COUNT = "asvs.count"
# More combinations of the other keys than this nobody reads.
MOST_COMBINATIONS = 300


def heat_table(
    campaign: "Campaign", found: MissionOutcomes, metric: str, columns: list[dict[str, Any]]
) -> str:
    """Return a metric along the first key with numbers, a row for each combination of the others.

    `columns` are the varied keys with their labels.  "" where there are too many for a map.
    """
    if not columns:
        return ""
    points, names = campaign.plan.points, [column["key"] for column in columns]
    numbers = [
        column["key"]
        for column in columns
        if column["values"] is not None and len(column["labels"]) > 1
    ]
    along = (numbers or names)[0]
    across, rows = columns[names.index(along)]["labels"], _rows(campaign, along)
    if max(len(rows), len(across)) > MOST_STEPS:
        return ""
    known = intervals(found.by_seed(metric, len(points)))
    low, high = np.nanmin([*known.mean, np.inf]), np.nanmax([*known.mean, -np.inf])
    whole, well = found.whole(metric, len(points)), found.well(len(points))
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
            gap = f"\n{whole[at]}/{well[at]}" if whole[at] < well[at] else ""
            mean, spread = with_half(known.mean[at], half)
            spread = f"± {spread}" if np.isfinite(half) else "one seed"
            line.append(f"{mean}\n{spread}{gap}")
        cells.append(line)
    short, name = _others(campaign, along), short_names(names)[along]
    corner = f"{short} ↓ {name} →" if short else f"{name} →"
    headings = [(corner, ""), *((label, "") for label in across)]
    return table(headings, cells, "Heatmap", looks).replace("<table>", '<table class="heat">', 1)


def _rows(campaign: "Campaign", along: str) -> dict[str, dict[str, int]]:
    """Return of each combination of the other keys the point at each value of a key."""
    rows: dict[str, dict[str, int]] = {}
    for number, point in enumerate(campaign.plan.points):
        others = (
            written(point.varied[column]) for column in campaign.plan.columns if column != along
        )
        rows.setdefault(", ".join(others) or "all", {})[written(point.varied[along])] = number
    return rows


def _others(campaign: "Campaign", along: str) -> str:
    names = short_names(list(campaign.plan.columns))
    return ", ".join(short for key, short in names.items() if key != along)


def fewest_points(campaign: "Campaign", columns: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return the numbers of ASVs that were tried, and a row of points at them for each combination
    of the other keys; None where their number was not varied.
    """
    counts: list[str] = next(
        (column["labels"] for column in columns if column["key"] == COUNT and column["values"]), []
    )
    if len(counts) < 2:
        return None
    rows = list(_rows(campaign, COUNT).values())[:MOST_COMBINATIONS]
    return {"counts": counts, "points": [[row.get(count) for count in counts] for row in rows]}


def fewest_tables(
    campaign: "Campaign", found: MissionOutcomes, tried: dict[str, Any], limit: float = SUB_METRE
) -> str:
    """Return for each kind of error the fewest ASVs that surely keep it below a limit (m).

    `tried` is of :func:`fewest_points`.  A script marks the cells again for other limits.
    """
    counts, rows = tried["counts"], list(_rows(campaign, COUNT))
    headings = [(_others(campaign, COUNT), ""), *((_asvs(count), "m") for count in counts)]
    shown, ran = "", np.bincount(found.point, minlength=len(campaign.plan.points))
    for metric in ACCURACIES:
        known = intervals(found.by_seed(metric, len(campaign.plan.points)))
        texts = _judged(found, metric, len(campaign.plan.points))
        lines, looks = [], {}
        for place, points in enumerate(tried["points"]):
            upper = [
                np.nan if point is None else known.mean[point] + known.half_width[point]
                for point in points
            ]
            sure = [column for column, bound in enumerate(upper) if bound < limit]
            for column, point in enumerate(points):
                if point is not None and known.mean[point] < limit:
                    looks[place, column + 1] = "sure" if column in sure else "near"
            if sure:
                looks[place, sure[0] + 1] = "sure fewest"
            looks[place, len(counts) + 1] = "answer"
            is_known = all(point is None or ran[point] for point in points)
            none = f"more than {counts[-1]}" if is_known else "not known yet"
            fewest = counts[sure[0]] if sure else none
            cells = ["-" if point is None else texts[point] for point in points]
            lines.append([rows[place], *cells, fewest])
        made = table([*headings, ("fewest", "")], lines, "Fewest ASVs", looks)
        hidden = " hidden" * (metric != ACCURACIES[0])
        shown += f'<div id="lookup-{metric}"{hidden}>{made}</div>'
    if len(rows) > MOST_COMBINATIONS:
        shown += f'<p class="note">The first {MOST_COMBINATIONS} of {len(rows)} combinations.</p>'
    return shown


def _asvs(count: str) -> str:
    return f"{count} ASV{'s' * (count != '1')}"


def _judged(found: MissionOutcomes, metric: str, points: int) -> list[str]:
    """Return a metric at each point, and on further lines whose it is and what it leaves out."""
    well, ran = found.well(points), np.bincount(found.point, minlength=points)
    served = found.whole("worst_latency_mean_s", points)
    texts = means(found, metric, points)
    for point, text in enumerate(texts):
        lines = [text, worst_auv(found, point, metric, well[point])]
        if well[point] < ran[point]:
            lines.append(f"{well[point]} of {ran[point]} missions")
        if served[point] < well[point]:
            lines.append(f"an AUV without a fix in {well[point] - served[point]}/{well[point]}")
        texts[point] = "\n".join(filter(None, lines))
    return texts


def means(found: MissionOutcomes, metric: str, points: int) -> list[str]:
    """Return a metric at each point as text, and in how many missions all AUVs have it."""
    known = intervals(found.by_seed(metric, points))
    whole, well = found.whole(metric, points), found.well(points)
    return [
        plus_minus(known.mean[point], known.half_width[point]).replace("+-", "±")
        + (f" {whole[point]}/{well[point]}" if whole[point] < well[point] else "")
        for point in range(points)
    ]


def worst_auv(found: MissionOutcomes, point: int, metric: str, well: int) -> str:
    """Return the AUV that is the worst of most missions of a point, and in how many it is; "" where
    none is.
    """
    name, times = next(iter(found.who(point, metric).items()), ("", 0))
    return name if times in (0, well) else f"{name} {times}/{well}"
