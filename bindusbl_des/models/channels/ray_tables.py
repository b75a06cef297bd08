"""Tables of travel time and loss of sound over range and two depths, interpolated.

Tables store the effect of bending: travel time beyond a straight ray's, and loss beyond spherical
spreading.  Both are smooth, and vanish where rays are steep or short, so that coarse grids are
precise, and positions beyond the grid (also nearer than its first range) have sensible values.  At
the edge of a shadow direct rays end, and reflected ones milliseconds later are the first: values of
two paths are never mixed.  Tables are a user's (CSV or Parquet, from any ray tracer) or traced
(:mod:`.table_channel`).
"""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from numpy.typing import ArrayLike, NDArray

from ...core.sea.water_column import Profile, cumulated_slowness
from ...support.arrays import Floats
from ...support.files import regular
from ...support.tables import of_file
from ...support.tables import read_table as table_of_text
from ...support.wording import described

# The shortest range (m) that counts: source levels are those at 1 m.
NEAREST_M = 1.0

# The least loss (dB re 1 m): less would be louder than at a hundredth of a millimetre.
LEAST_LOSS_DB = -100.0


class TableAxes(NamedTuple):
    """The axes of a table, increasing (m): horizontal ranges, depths of sources and receivers."""

    ranges_m: Floats
    source_depths_m: Floats
    receiver_depths_m: Floats


class SoundTable(NamedTuple):
    """Differences of rays from straight ones: on a grid, how much longer (s) they travel, and their
    loss (dB) beyond spherical spreading; arrays of ranges by depths of sources by receivers.

    `ways` has equal numbers where rays took the same path: direct, by the bottom, or none.  At the
    edge of a shadow the number changes, and nothing is interpolated across.  Absorption is not
    included: it depends on the frequency.
    """

    profile: Profile
    grid: TableAxes
    longer_s: Floats
    beyond_db: Floats
    ways: NDArray[np.int64]

    def travel_time_s(
        self, range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
    ) -> Floats:
        """Return the travel time of sound (s) over horizontal ranges (m) between two depths (m)."""
        straight = straight_time_s(self.profile, range_m, source_depth_m, receiver_depth_m)
        return straight + self.excess_time_s(range_m, source_depth_m, receiver_depth_m)

    def excess_time_s(
        self, range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
    ) -> Floats:
        """Return how much longer (s) that is than on a straight ray: below 0 for direct rays, above
        for reflected ones, which are the first in a shadow.
        """
        return self._between(self.longer_s, range_m, source_depth_m, receiver_depth_m)

    def loss_db(
        self, range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
    ) -> Floats:
        """Return the spreading loss (dB re 1 m) over horizontal ranges (m) between depths (m).

        Absorption is added, over :func:`slant_range_m`.
        """
        slant = slant_range_m(range_m, source_depth_m, receiver_depth_m)
        spherical = 20.0 * np.log10(np.maximum(slant, NEAREST_M))
        beyond = self._between(self.beyond_db, range_m, source_depth_m, receiver_depth_m)
        return np.asarray(spherical + beyond)

    def _between(self, values: Floats, *places: ArrayLike) -> Floats:
        return interpolated(self.grid, values, self.ways, *places)


def slant_range_m(
    range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
) -> Floats:
    """Return the straight distance (m) over a horizontal range between two depths (m)."""
    apart = np.asarray(receiver_depth_m, dtype=float) - np.asarray(source_depth_m, dtype=float)
    return np.asarray(np.hypot(np.asarray(range_m, dtype=float), apart))


def straight_time_s(
    profile: Profile,
    range_m: ArrayLike,
    source_depth_m: ArrayLike,
    receiver_depth_m: ArrayLike,
) -> Floats:
    """Return the travel time (s) of sound on a straight ray between two depths (m)."""
    above, below = (np.asarray(depth, dtype=float) for depth in (source_depth_m, receiver_depth_m))
    apart = below - above
    passed = cumulated_slowness(profile, below) - cumulated_slowness(profile, above)
    level = 1.0 / profile.at((above + below) / 2.0)
    # within a millimetre of depth the speed is one
    slowness = np.where(np.abs(apart) < 1e-3, level, passed / np.where(apart == 0.0, 1.0, apart))
    return np.asarray(slant_range_m(range_m, above, below) * slowness)


def interpolated(
    grid: TableAxes,
    values: Floats,
    ways: NDArray[np.int64],
    range_m: ArrayLike,
    source_depth_m: ArrayLike,
    receiver_depth_m: ArrayLike,
) -> Floats:
    """Return values on a grid interpolated linearly along each axis; constant beyond its ends.

    Of the corners of a cell only those of one path (equal numbers of `ways`) count, the path with
    the largest weight.
    """
    asked = np.broadcast_arrays(range_m, source_depth_m, receiver_depth_m)
    cells = [
        _cell(axis, np.asarray(coordinate, dtype=float))
        for axis, coordinate in zip(grid, asked, strict=True)
    ]
    weights, places = [], []
    for corner in product((0, 1), repeat=3):
        weight = np.ones(asked[0].shape)
        for cell, step in zip(cells, corner, strict=True):
            weight = weight * (cell.share if step else 1.0 - cell.share)
        corners = zip(cells, corner, strict=True)
        places.append(tuple(cell.above if step else cell.below for cell, step in corners))
        weights.append(weight)
    came = [ways[place] for place in places]
    mine, most = came[0], np.full(asked[0].shape, -1.0)
    for way in came:
        held = sum(
            np.where(other == way, weight, 0.0) for other, weight in zip(came, weights, strict=True)
        )
        mine, most = np.where(held > most, way, mine), np.maximum(held, most)
    total = np.zeros(asked[0].shape)
    for way, weight, place in zip(came, weights, places, strict=True):
        total += np.where(way == mine, weight * values[place], 0.0)
    return np.asarray(total / most)


class _Cell(NamedTuple):
    """The indices of an axis between which values lie, and the share of the way up (0 to 1)."""

    below: NDArray[np.intp]
    above: NDArray[np.intp]
    share: Floats


def _cell(axis: Floats, values: Floats) -> _Cell:
    last = len(axis) - 1
    above = np.clip(np.searchsorted(axis, values, side="right"), min(1, last), last)
    below = np.maximum(above - 1, 0)
    step = np.where(above > below, axis[above] - axis[below], 1.0)
    return _Cell(below, above, np.clip((values - axis[below]) / step, 0.0, 1.0))


AXES = ("range_m", "source_depth_m", "receiver_depth_m")
VALUES = ("travel_time_s", "loss_db")
COLUMNS = f"{', '.join(AXES)}, {' and '.join(VALUES)}"


def read_table(path: str | Path, profile: Profile) -> SoundTable:
    """Return a table of sound from a file, CSV or Parquet (by its ending, .parquet).

    It has the columns range_m (horizontal), source_depth_m, receiver_depth_m, travel_time_s and
    loss_db (of spreading and bending, without absorption, re 1 m), a row for each point of a full
    grid, in any order.  Differences from straight rays in the profile's water are interpolated
    between points.

    Raises:
        ValueError: naming file and remedy, when the file is not such a table.
    """
    rows = _columns(path)
    grid = TableAxes(*(np.unique(rows[name]) for name in AXES))
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
    if not all(np.array_equal(place, axis) for place, axis in zip(places, wanted, strict=True)):
        raise ValueError(f"{path}: has a place twice, and another not at all; write each once")
    taken, loss = (rows[name][order].reshape(shape) for name in VALUES)
    straight = straight_time_s(profile, *places)
    _check_times(path, taken, straight)
    spherical = 20.0 * np.log10(np.maximum(slant_range_m(*places), 1.0))
    one_way = np.zeros(shape, dtype=np.int64)  # a file does not say how its sound came
    return SoundTable(profile, grid, taken - straight, loss - spherical, one_way)


@of_file(4)
def _columns(path: str) -> dict[str, Floats]:
    found = _of_parquet(path) if path.endswith(".parquet") else _of_text(path)
    missing = [name for name in (*AXES, *VALUES) if name not in found]
    if missing:
        raise ValueError(f"{path}: column {', '.join(missing)} missing; it needs {COLUMNS}")
    columns = {name: _numbers(path, name, found[name]) for name in (*AXES, *VALUES)}
    for name in (*AXES, "travel_time_s"):
        if columns[name].min() < 0.0:
            raise ValueError(f"{path}: {name} must not be negative; met {columns[name].min():g}")
    if (least := columns["loss_db"].min()) < LEAST_LOSS_DB:
        raise ValueError(
            f"{path}: loss_db must be at least {LEAST_LOSS_DB:g} (dB re 1 m); met {least:g}"
        )
    # where rays meet losses may be negative, at most places only if their sign is wrong
    if (middle := float(np.median(columns["loss_db"]))) < 0.0:
        raise ValueError(
            f"{path}: loss_db is negative at most places (median {middle:.1f} dB), as if sound "
            "grew louder with distance; losses are positive: turn their sign"
        )
    return columns


def _of_text(path: str) -> dict[str, Sequence[object]]:
    table = table_of_text(path)
    rows = list(table.rows())
    return {name: [row.cells[name] for row in rows] for name in table.names}


def _of_parquet(path: str) -> dict[str, Sequence[object]]:
    try:
        rows = parquet.read_table(regular(path))
    except (OSError, pa.ArrowInvalid) as error:
        raise ValueError(f"{path}: cannot be read as a table: {error}") from None
    return {name.strip(): rows.column(name).to_pylist() for name in rows.column_names}


def _numbers(path: str, name: str, column: Sequence[object]) -> Floats:
    """Return a column of finite numbers."""
    values = np.array([_number(cell) for cell in column])
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong) or not len(values):
        if not len(values):
            raise ValueError(f"{path}: {name} must hold numbers; there are no rows")
        cell = column[wrong[0]]
        has = "none" if cell in (None, "") else described(cell)
        raise ValueError(f"{path}: {name} must hold numbers; row {wrong[0] + 1} has {has}")
    return values


def _number(cell: object) -> float:
    try:
        return float(cell)  # type: ignore[arg-type]  # whatever it is, float says
    except (TypeError, ValueError, OverflowError):
        return np.nan


def _check_times(path: str | Path, taken: Floats, straight: Floats) -> None:
    """Refuse travel times that do not fit this water: of another unit, or another sea."""
    off = np.abs(taken - straight)
    worst = np.unravel_index(int(np.argmax(off - 0.1 * straight)), off.shape)
    if off[worst] > 0.1 * straight[worst] + 1e-3:
        raise ValueError(
            f"{path}: a travel time of {taken[worst]:g} s, where a straight way takes "
            f"{straight[worst]:g} s; give seconds, and the water that it was traced in"
        )
