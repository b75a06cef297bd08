"""A mission in a table for the terminal."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

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


def summary_table(auvs: "pd.DataFrame", mission: "pd.DataFrame") -> str:
    """Return a table with a row per AUV and the fleet's mean, units below the headings.

    A large fleet has the rows of its first AUVs, and least, mean and largest values of all.
    """
    is_large = len(auvs) > MOST_ROWS
    shown: list[Any] = auvs.head(FIRST_ROWS if is_large else MOST_ROWS).to_dict("records")
    rows = [
        ("AUV", *(heading for heading, *_ in COLUMNS)),
        ("", *(unit for _, unit, *_ in COLUMNS)),
    ]
    rows += [_row(str(auv["auv"]), auv) for auv in shown]
    whole: Any = mission.iloc[0].to_dict()
    if is_large:
        known = auvs[[metric for _, _, metric, *_ in COLUMNS]]
        least: Any = known.min().to_dict()
        most: Any = known.max().to_dict()
        rows.append((f"+{len(auvs) - FIRST_ROWS}", *("..." for _ in COLUMNS)))
        rows.append(_row("min", least))
        rows.append(_row("mean", whole))
        rows.append(_row("max", most))
    else:
        rows.append(_row("mean", whole))
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
        f"{whole['rounds']:.0f} rounds, {whole['collisions']:.0f} collisions; channel use "
        f"HF {100 * whole['hf_utilisation']:.1f} %, MF {100 * whole['mf_utilisation']:.1f} %"
    )
    return "\n".join(lines)


def _row(name: str, metrics: dict[str, Any]) -> tuple[str, ...]:
    cells = [name]
    for _, _, metric, digits, factor in COLUMNS:
        value = metrics[metric]
        known = value is not None and value == value
        cells.append(f"{value * factor:.{digits}f}" if known else "-")
    return tuple(cells)
