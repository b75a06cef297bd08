"""Recorded tracks of real vehicles, read from CSV files."""

import csv
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

COLUMNS = ("time_s", "x_m", "y_m", "depth_m")


def read_track(path: str | Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the times (n,), s, and positions (n, 3), m, z down, of a recorded track.

    The file has a header line with the columns time_s, x_m, y_m, depth_m in any order; further
    columns are ignored.

    Raises:
        ValueError: naming file, line and remedy, when the file is not such a track.
    """
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read as a CSV file: {error}") from None
    header = [name.strip() for name in rows[0]] if rows else []
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise ValueError(
            f"{path}:1: column {', '.join(missing)} missing; the header needs {', '.join(COLUMNS)}"
        )
    places = [header.index(name) for name in COLUMNS]
    samples = [_sample(path, number, row, places) for number, row in enumerate(rows[1:], 2) if row]
    if len(samples) < 2:
        raise ValueError(f"{path}: has {len(samples)} samples; a track needs at least two")
    track = np.array(samples)
    stuck = np.flatnonzero(np.diff(track[:, 0]) <= 0.0)
    if len(stuck):
        raise ValueError(
            f"{path}: time_s must increase, but sample {stuck[0] + 2} "
            f"({track[stuck[0] + 1, 0]:g} s) does not follow {track[stuck[0], 0]:g} s"
        )
    return track[:, 0], track[:, 1:]


def _sample(path: str | Path, line: int, row: list[str], places: list[int]) -> list[float]:
    try:
        sample = [float(row[place]) for place in places]
    except (ValueError, IndexError):
        raise ValueError(f"{path}:{line}: needs a number in each of {', '.join(COLUMNS)}") from None
    if not all(math.isfinite(value) for value in sample):
        raise ValueError(f"{path}:{line}: holds a value that is not finite: {sample}")
    return sample
