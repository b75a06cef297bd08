"""Curves of delivery over range, read from CSV files."""

import math
from functools import lru_cache
from pathlib import Path

from ...core.files import cells_of

COLUMNS = ("range_m", "delivery_ratio")

# What a line looks like
EXAMPLE = "such as `50,0.95`"

Curve = tuple[tuple[float, ...], tuple[float, ...]]


def read_curve(path: str | Path) -> Curve:
    """Return the ranges (n,), m, and delivery ratios (n,) of a CSV file.

    Its header line has the columns range_m and delivery_ratio, in any order and among others; the
    ranges increase, and the ratios lie in [0, 1].

    Raises:
        ValueError: naming file, line, value and remedy, when the file is not such a curve.
    """
    return _read(str(path), cells_of(path))


@lru_cache(maxsize=16)
def _read(path: str, rows: tuple[tuple[str, ...], ...]) -> Curve:
    header = [name.strip() for name in rows[0]] if rows else []
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise ValueError(
            f"{path}:1: column {', '.join(missing)} missing; the header needs {', '.join(COLUMNS)}"
        )
    places = [header.index(name) for name in COLUMNS]
    points: list[tuple[float, float]] = []
    for line, row in enumerate(rows[1:], 2):
        if row:
            points.append(_point(f"{path}:{line}", row, places, points))
    if not points:
        raise ValueError(f"{path}: has no points; a curve needs at least one line {EXAMPLE}")
    ranges, ratios = zip(*points, strict=True)
    return ranges, ratios


def _point(
    where: str, row: tuple[str, ...], places: list[int], before: list[tuple[float, float]]
) -> tuple[float, float]:
    """Return the range (m) and the delivery ratio of a line, which comes after those `before`."""
    if len(row) <= max(places):
        raise ValueError(f"{where}: has {len(row)} columns; give {', '.join(COLUMNS)} {EXAMPLE}")
    values = []
    for name, place in zip(COLUMNS, places, strict=True):
        try:
            values.append(float(row[place]))
        except ValueError:
            raise ValueError(f"{where}: {name} is {row[place]!r}; give a number") from None
    away, ratio = values
    if not 0.0 <= away < math.inf:
        raise ValueError(f"{where}: range_m is {away:g}; give metres from 0 on")
    if not 0.0 <= ratio <= 1.0:
        remedy = "divide per cent by 100" if 1.0 < ratio <= 100.0 else "give a share of 1"
        raise ValueError(f"{where}: delivery_ratio is {ratio:g}, not within 0 and 1; {remedy}")
    if before and away <= before[-1][0]:
        raise ValueError(
            f"{where}: range_m is {away:g} after {before[-1][0]:g}; sort the lines by range, each "
            "range once (is there a curve of another modem in the file?)"
        )
    return away, ratio
