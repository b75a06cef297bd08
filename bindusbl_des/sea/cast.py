"""A cast of a CTD: conductivity, temperature and depth, or the speed of sound, read from CSV."""

import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .csv_cells import cells_of

Floats = NDArray[np.float64]

WATER = ("temperature_c", "salinity_psu")
SPEED = "sound_speed_m_per_s"
COLUMNS = f"depth_m and {SPEED}, or depth_m, {' and '.join(WATER)}"

# What such a column can hold: anything else is another quantity or unit.
LIMITS = {
    "depth_m": (0.0, 12_000.0),
    "temperature_c": (-10.0, 50.0),
    "salinity_psu": (0.0, 60.0),
    SPEED: (1300.0, 1700.0),
}


class Cast(NamedTuple):
    """Samples of a cast, by increasing depth (n,), m: temperature (n,), degC, salinity (n,), psu,
    speed of sound (n,), m/s; what was not measured is None.
    """

    depths_m: Floats
    temperatures_c: Floats | None
    salinities_psu: Floats | None
    speeds_m_per_s: Floats | None


def read_cast(path: str | Path) -> Cast:
    """Return the samples of a cast.

    The file has a header line with the columns depth_m and sound_speed_m_per_s, or depth_m,
    temperature_c and salinity_psu, or all of them, in any order; further columns are ignored.

    Raises:
        ValueError: naming file, line and remedy, when the file is not such a cast.
    """
    return _read(str(path), cells_of(path))


@lru_cache(maxsize=16)
def _read(path: str, rows: tuple[tuple[str, ...], ...]) -> Cast:
    header = [name.strip() for name in rows[0]] if rows else []
    names = [name for name in LIMITS if name in header]
    has_water = all(name in names for name in WATER)
    if "depth_m" not in names or not (has_water or SPEED in names):
        raise ValueError(f"{path}:1: has the columns {', '.join(header)}; it needs {COLUMNS}")
    names = [name for name in names if has_water or name not in WATER]
    places = {name: header.index(name) for name in names}
    lines = [number for number, row in enumerate(rows[1:], 2) if row]
    if len(lines) < 2:
        raise ValueError(f"{path}: has {len(lines)} samples; a cast needs at least two")
    samples = np.array([_sample(path, line, rows[line - 1], places) for line in lines])
    stuck = np.flatnonzero(np.diff(samples[:, 0]) <= 0.0)
    if len(stuck):
        above, below = samples[stuck[0], 0], samples[stuck[0] + 1, 0]
        raise ValueError(
            f"{path}:{lines[stuck[0] + 1]}: depth_m must increase, but {below:g} m follows "
            f"{above:g} m; keep the way down, or the way up turned around"
        )
    samples.setflags(write=False)
    columns = dict(zip(names, samples.T, strict=True))
    return Cast(columns["depth_m"], *(columns.get(name) for name in (*WATER, SPEED)))


def _sample(path: str, line: int, row: tuple[str, ...], places: dict[str, int]) -> list[float]:
    sample = []
    for name, place in places.items():
        text = row[place].strip() if place < len(row) else ""
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        least, most = LIMITS[name]
        if not least <= value <= most:
            raise ValueError(
                f"{path}:{line}: {name} must be a number from {least:g} to {most:g}; got {text!r}"
            )
        sample.append(value)
    return sample
