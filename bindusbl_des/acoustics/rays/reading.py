"""Tables of sound of one's own: CSV or Parquet, from any ray tracer."""

import os
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as arrow_csv
import pyarrow.parquet as parquet

from ...sea.profile import Profile
from .table import Floats, Grid, SoundTable, slant_range_m, straight_time_s

AXES = ("range_m", "source_depth_m", "receiver_depth_m")
VALUES = ("travel_time_s", "loss_db")
COLUMNS = f"{', '.join(AXES)}, {' and '.join(VALUES)}"


def read_table(path: str | Path, profile: Profile) -> SoundTable:
    """Return a table of sound from a file, CSV or Parquet (by its ending, .parquet).

    It has the columns range_m (horizontal), source_depth_m, receiver_depth_m, travel_time_s and
    loss_db (of spreading and bending, without absorption, re 1 m), a row for each place of a full
    grid, in any order.  Between its places what differs from straight ways in the profile's water
    is interpolated.

    Raises:
        ValueError: naming file and remedy, when the file is not such a table.
    """
    rows = _columns(path)
    grid = Grid(*(np.unique(rows[name]) for name in AXES))
    shape = tuple(map(len, grid))
    count = len(rows["range_m"])
    if shape[0] < 2:
        raise ValueError(f"{path}: needs at least two values of range_m")
    if count != np.prod(shape):
        raise ValueError(
            f"{path}: has {count} rows; a full grid of its {shape[0]} ranges, {shape[1]} depths of "
            f"sources and {shape[2]} of receivers has {np.prod(shape)}, one for each place"
        )
    order = np.lexsort([rows[name] for name in reversed(AXES)])
    places = [rows[name][order].reshape(shape) for name in AXES]
    wanted = np.meshgrid(*grid, indexing="ij")
    if not all(np.array_equal(it, axis) for it, axis in zip(places, wanted, strict=True)):
        raise ValueError(f"{path}: has a place twice, and another not at all; write each once")
    taken, loss = (rows[name][order].reshape(shape) for name in VALUES)
    straight = straight_time_s(profile, *places)
    _check_times(path, taken, straight)
    spherical = 20.0 * np.log10(np.maximum(slant_range_m(*places), 1.0))
    return SoundTable(profile, grid, taken - straight, loss - spherical)


def _columns(path: str | Path) -> dict[str, Floats]:
    try:
        found = os.stat(path)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error}") from None
    return _read(str(path), found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=4)
def _read(path: str, _changed_at: int, _size: int) -> dict[str, Floats]:
    """Return the columns of a file; one that has not changed since is not read again."""
    try:
        rows = (parquet.read_table if path.endswith(".parquet") else arrow_csv.read_csv)(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise ValueError(f"{path}: cannot be read as a table: {error}") from None
    names = [name.strip() for name in rows.column_names]
    missing = [name for name in (*AXES, *VALUES) if name not in names]
    if missing:
        raise ValueError(f"{path}: column {', '.join(missing)} missing; it needs {COLUMNS}")
    columns = {
        name: _numbers(path, name, rows.column(names.index(name))) for name in (*AXES, *VALUES)
    }
    for name in (*AXES, "travel_time_s"):
        if columns[name].min() < 0.0:
            raise ValueError(f"{path}: {name} must not be negative; met {columns[name].min():g}")
    return columns


def _numbers(path: str, name: str, column: pa.ChunkedArray) -> Floats:
    try:
        values = np.asarray(column.cast(pa.float64()).to_numpy(), dtype=float)
    except pa.ArrowInvalid as error:
        raise ValueError(f"{path}: {name} must hold numbers: {error}") from None
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong) or not len(values):
        row = f"row {wrong[0] + 1} has none" if len(wrong) else "there are no rows"
        raise ValueError(f"{path}: {name} must hold numbers; {row}")
    return values


def _check_times(path: str | Path, taken: Floats, straight: Floats) -> None:
    """Refuse times that are not those of this water: another unit, or another sea."""
    off = np.abs(taken - straight)
    worst = np.unravel_index(int(np.argmax(off - 0.1 * straight)), off.shape)
    if off[worst] > 0.1 * straight[worst] + 1e-3:
        raise ValueError(
            f"{path}: a travel time of {taken[worst]:g} s, where a straight way takes "
            f"{straight[worst]:g} s; give seconds, and the water that it was traced in"
        )
