"""Recorded tracks of real vehicles, read from CSV files."""

import csv
import math
import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..core.wording import plain

Array = NDArray[np.float64]
Track = tuple[Array, Array]

COLUMNS = ("time_s", "x_m", "y_m", "depth_m")

# Faster (m/s) is no vehicle, and would outrun its own sound.
FASTEST = 1000.0

# Farther from the survey's centre (m) is nothing that a scenario could give.
FARTHEST = 1e6


def read_tracks(files: Sequence[str], offset_s: float, duration_s: float) -> list[Track]:
    """Return the tracks of a fleet, in the time of its mission: `offset_s` is subtracted.

    Raises:
        ValueError: naming file and remedy, when one cannot be read or none of it is in the mission.
    """
    tracks = [read_track(file, offset_s) for file in files]
    for number, problem in misplaced(tracks, offset_s, duration_s):
        raise ValueError(f"auvs.route.files.{number}: {problem}")
    return tracks


def misplaced(tracks: Sequence[Track], offset_s: float, duration_s: float) -> list[tuple[int, str]]:
    """Return which tracks are nowhere in a mission of `duration_s` (s), and what to do about it.

    Their vehicles would stand still from its start to its end.
    """
    away = [n for n, (times, _) in enumerate(tracks) if times[0] >= duration_s or times[-1] <= 0.0]
    if not away:
        return []
    first = min(float(tracks[number][0][0]) for number in away)
    remedy = f"set auvs.route.time_offset_s: {plain(first + offset_s)} to begin the mission with it"
    return [(number, f"{_span(tracks[number][0], duration_s)}; {remedy}") for number in away]


def _span(times: Array, duration_s: float) -> str:
    return (
        f"its times, {plain(float(times[0]))} to {plain(float(times[-1]))} s of the mission, lie "
        f"outside it (0 to {plain(duration_s)} s)"
    )


def read_track(path: str | Path, offset_s: float = 0.0) -> Track:
    """Return the times (n,), s, and positions (n, 3), m, z down, of a recorded track.

    The file has a header line with the columns time_s, x_m, y_m, depth_m in any order; further
    columns are ignored.  `offset_s` is subtracted from its times.

    Raises:
        ValueError: naming file, line and remedy, when the file is not such a track.
    """
    try:
        found = os.stat(path)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read as a CSV file: {error}") from None
    times, positions = _read(str(path), found.st_mtime_ns, found.st_size)
    return times - offset_s, positions


@lru_cache(maxsize=64)
def _read(path: str, _changed_at: int, _size: int) -> Track:
    """Return what is in a file; one that has not changed since is not read again."""
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
    speeds = np.hypot(*np.diff(track[:, 1:3], axis=0).T) / np.diff(track[:, 0])
    fastest = int(np.argmax(speeds))
    if speeds[fastest] > FASTEST:
        raise ValueError(
            f"{path}: sample {fastest + 2} is reached at {speeds[fastest]:.3g} m/s from that "
            f"before it; a vehicle slower than {FASTEST:g} m/s was expected: are x_m and y_m in "
            "metres, time_s in seconds?"
        )
    track.setflags(write=False)
    return track[:, 0], track[:, 1:]


def _sample(path: str, line: int, row: list[str], places: list[int]) -> list[float]:
    try:
        sample = [float(row[place]) for place in places]
    except (ValueError, IndexError):
        raise ValueError(f"{path}:{line}: needs a number in each of {', '.join(COLUMNS)}") from None
    if not all(math.isfinite(value) for value in sample):
        raise ValueError(f"{path}:{line}: holds a value that is not finite: {sample}")
    return sample
