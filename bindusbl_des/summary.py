"""A mission in a table for the terminal."""

from collections.abc import Callable, Sequence
from typing import Any

Row = dict[str, Any]

# heading, unit, metric, digits, factor
COLUMNS: tuple[tuple[str, str, str, int, float], ...] = (
    ("pings", "", "pings", 0, 1),
    ("in range", "%", "hf_coverage", 0, 100),
    ("fixes", "", "fixes_delivered", 0, 1),
    ("interval", "s", "interval_mean_s", 2, 1),
    ("latency", "s", "latency_mean_s", 3, 1),
    ("error", "m", "position_error_m", 2, 1),
    ("95 %", "m", "position_error_p95_m", 2, 1),
    ("no fixes", "m", "imu_error_m", 2, 1),
)

# A larger fleet shows its first AUVs, and between which values all of them lie.
MOST_ROWS, FIRST_ROWS = 20, 10


def summary_table(auvs: Sequence[Row], mission: Row) -> str:
    """Return a table with a row per AUV and the fleet's mean, units below the headings.

    Take the metrics of each AUV and of the mission by their names; None is not known.  A large
    fleet has the rows of its first AUVs, and least, mean and largest values of all.
    """
    is_large = len(auvs) > MOST_ROWS
    shown = auvs[: FIRST_ROWS if is_large else MOST_ROWS]
    rows = [
        ("AUV", *(heading for heading, *_ in COLUMNS)),
        ("", *(unit for _, unit, *_ in COLUMNS)),
    ]
    rows += [_row(str(auv["auv"]), auv) for auv in shown]
    if is_large:
        rows.append((f"+{len(auvs) - FIRST_ROWS}", *("..." for _ in COLUMNS)))
        rows.append(_row("min", _extremes(auvs, min)))
        rows.append(_row("mean", mission))
        rows.append(_row("max", _extremes(auvs, max)))
    else:
        rows.append(_row("mean", mission))
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = [
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
    lines.insert(2, "-" * max(map(len, lines)))
    lines.append(
        f"{mission['rounds']:.0f} rounds, {mission['collisions']:.0f} collisions; channel use "
        f"HF {100 * mission['hf_utilisation']:.1f} %, MF {100 * mission['mf_utilisation']:.1f} %"
    )
    return "\n".join(lines)


def _extremes(auvs: Sequence[Row], pick: Callable[..., Any]) -> Row:
    return {
        metric: pick((auv[metric] for auv in auvs if auv[metric] is not None), default=None)
        for _, _, metric, *_ in COLUMNS
    }


def _row(name: str, metrics: Row) -> tuple[str, ...]:
    cells = [name]
    for _, _, metric, digits, factor in COLUMNS:
        value = metrics[metric]
        known = value is not None
        cells.append(f"{value * factor:.{digits}f}" if known else "-")
    return tuple(cells)
