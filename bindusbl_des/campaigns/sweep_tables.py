"""What a campaign's page has without scripts: its map as a table, and the fewest ASVs in words."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.wording import significant
from ..report.page import table
from .statistics.findings import SUB_METRE
from .statistics.intervals import intervals
from .statistics.naming import MOST_NAMED, listed, plus_minus, point_name, short_key, written
from .statistics.outcomes import MissionOutcomes, lower_is_better

if TYPE_CHECKING:
    from .campaign import Campaign

# More rows or columns than this are no map; the table of points has them.
MOST_STEPS = 40
ACCURACY = "worst_position_error_p95_m"
COUNT = "asvs.count"


def heat_table(
    campaign: "Campaign", found: MissionOutcomes, metric: str, columns: list[dict[str, Any]]
) -> str:
    """Return a metric along the first key with numbers, a row for each combination of the others.

    `columns` are the varied keys with their labels.  "" where there are too many for a map.
    """
    if not columns:
        return ""
    points, names = campaign.plan.points, [it["key"] for it in columns]
    numbers = [it["key"] for it in columns if it["values"] is not None and len(it["labels"]) > 1]
    along = (numbers or names)[0]
    others = [name for name in names if name != along]
    across = columns[names.index(along)]["labels"]
    rows: dict[str, dict[str, int]] = {}
    for number, point in enumerate(points):
        row = ", ".join(written(point.varied[name]) for name in others) or "all"
        rows.setdefault(row, {})[written(point.varied[along])] = number
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
            spread = f"± {significant(half, 2)}" if np.isfinite(half) else "one seed"
            line.append(f"{significant(known.mean[at])}\n{spread}{gap}")
        cells.append(line)
    short = ", ".join(short_key(name, names) for name in others)
    corner = f"{short} ↓ {short_key(along, names)} →" if short else f"{short_key(along, names)} →"
    headings = [(corner, ""), *((label, "") for label in across)]
    return table(headings, cells, "Heatmap", looks).replace("<table>", '<table class="heat">', 1)


def fewest_said(campaign: "Campaign", found: MissionOutcomes) -> str:
    """Return with how few ASVs the worst AUV is surely below a metre, "" where none were varied."""
    points = campaign.plan.points
    if campaign.plan.columns.get(COUNT) != "int" or len({it.varied[COUNT] for it in points}) < 2:
        return ""
    goal = f"the worst AUV surely below {SUB_METRE:g} m for 95 % of the time"
    known = intervals(found.by_seed(ACCURACY, len(points)))
    if not np.isfinite(known.half_width).any():
        return f"With one seed a point no number of ASVs keeps {goal}; run more."
    names = [name for name in campaign.plan.columns if name != COUNT]
    fewest: dict[str, int | None] = {}
    for number, point in enumerate(points):
        shown = (f"{short_key(it, names)}={written(point.varied[it])}" for it in names)
        place, count = ", ".join(shown), point.varied[COUNT]
        place = f"({place})" if len(names) > 1 else place
        before = fewest.setdefault(place, None)
        if known.mean[number] + known.half_width[number] < SUB_METRE:
            fewest[place] = count if before is None else min(before, count)
    counts = sorted({it for it in fewest.values() if it is not None})
    if not counts:
        near = int(np.nanargmin(known.mean))
        return (
            f"No number of ASVs here keeps {goal}; nearest comes "
            f"{point_name(near, points[near].varied)}: "
            f"{plus_minus(known.mean[near], known.half_width[near])} m."
        )
    begun = f"Fewest ASVs that keep {goal}"
    if not names:
        return f"{begun}: {counts[0]}."
    said = [f"{it} with {_some([k for k, v in fewest.items() if v == it])}" for it in counts]
    lost = [place for place, it in fewest.items() if it is None]
    if lost:
        said.append(f"more than {max(it.varied[COUNT] for it in points)} with {_some(lost)}")
    return f"{begun}: {'; '.join(said)}."


def _some(places: list[str]) -> str:
    """Return places in words, the first of many."""
    more = len(places) - MOST_NAMED
    return listed([*places[:MOST_NAMED], f"{more} more"] if more > 0 else places)
