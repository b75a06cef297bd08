"""Tracks in CSV files: time_s, then x_m and y_m or lat_deg and lon_deg, and depth_m or z_m."""

import csv
import math
from collections.abc import Iterator, Sequence

from ..core.regular_files import regular
from .samples import Sample, in_sea
from .shapes import BadChart, position

TIME, NAME = "time_s", "vehicle"
METRES, DEGREES, DEPTHS = ("x_m", "y_m"), ("lat_deg", "lon_deg"), ("depth_m", "z_m")
COLUMNS = "time_s, x_m, y_m, depth_m, or time_s, lat_deg, lon_deg, depth_m"


def read_csv(path: str) -> Iterator[tuple[str, Sample]]:
    """Yield the samples of a CSV file, each with the vehicle that a column `vehicle` names.

    Columns may stand in any order, and others beside them; where there are metres, degrees do not
    count.  The table `tracks` of an export is such a file.

    Raises:
        BadChart: naming file, line and remedy.
    """
    try:
        with open(regular(path), newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadChart(f"{path}: cannot be read as a CSV file: {error}") from None
    header = [name.strip() for name in rows[0]] if rows else []
    columns, in_degrees = _columns(path, header)
    places = [header.index(name) for name in columns]
    named = header.index(NAME) if NAME in header else None
    for number, row in enumerate(rows[1:], 2):
        if row:
            sample = _sample(f"{path}:{number}", row, places, columns, in_degrees)
            yield row[named].strip() if named is not None else "", sample


def _columns(path: str, header: Sequence[str]) -> tuple[list[str], bool]:
    """Return the columns of time, place and depth, and whether places are in degrees."""
    depth = next((name for name in DEPTHS if name in header), DEPTHS[0])
    metres, degrees = [TIME, *METRES, depth], [TIME, *DEGREES, depth]
    in_degrees = any(it in header for it in DEGREES) and not all(it in header for it in METRES)
    columns = degrees if in_degrees else metres
    missing = [name for name in columns if name not in header]
    if missing:
        raise BadChart(f"{path}:1: column {', '.join(missing)} missing; the header needs {COLUMNS}")
    return columns, in_degrees


def _sample(
    told: str, row: Sequence[str], places: Sequence[int], columns: Sequence[str], in_degrees: bool
) -> Sample:
    try:
        time, first, second, depth = (float(row[place]) for place in places)
    except (ValueError, IndexError):
        raise BadChart(f"{told}: needs a number in each of {', '.join(columns)}") from None
    if not all(math.isfinite(value) for value in (time, first, second, depth)):
        values = [time, first, second, depth]
        raise BadChart(f"{told}: holds a value that is not finite: {values}")
    depth = in_sea(told, depth)
    if in_degrees:
        return Sample(told, time, position(first, second, told, "lat_deg, lon_deg"), depth, True)
    return Sample(told, time, (first, second), depth, False)
