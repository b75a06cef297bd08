"""Formats of logs: PyFG, CSV and MCAP."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from importlib.util import find_spec
from math import pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...models.charts.recordings import mcap_messages
from ...models.charts.shapes import BadChart
from ...support.arrays import Floats
from ...support.files import regular, text_of
from ...support.tables import read_table, sifted
from .log import (
    BadLog,
    Log,
    LoggedFixes,
    NothingLogged,
    Ranges,
    Stated,
    SurveyedBeacons,
    recorded,
)

# Factor graphs as text (PyFG): the odometry and ranges of one vehicle in the plan.
#
# The lines of a file, all lengths in m, angles in rad, covariances as upper triangles:
#
#     VERTEX_SE2 time pose x y heading        VERTEX_XY beacon x y
#     EDGE_SE2 time pose pose dx dy turn  xx xy xt yy yt tt
#     EDGE_RANGE time pose beacon range variance
#
# What the vertices of poses say is a guess for a solver (in what gtsam ships, the sum of the
# steps) and not read. Source: reader and files of GTSAM (Dellaert and others),
# `gtsam/Data/*.pyfg`.


# How many words a line of each kind has, and which of them are names.
WORDS = {"VERTEX_SE2": 6, "VERTEX_XY": 4, "EDGE_SE2": 13, "EDGE_RANGE": 6}
NAMES = {"VERTEX_SE2": (2,), "VERTEX_XY": (1,), "EDGE_SE2": (2, 3), "EDGE_RANGE": (2, 3)}

# The speed (m/s) by which distance stands in for instants that were not recorded.
NOMINAL_SPEED = 1.0


class Written(NamedTuple):
    """A line as it is written: where it stands (file:line), of which kind, and its words."""

    place: str
    kind: str
    words: list[str]


class Line(NamedTuple):
    """A line: where it stands (file:line), its names and its numbers."""

    place: str
    names: tuple[str, ...]
    numbers: tuple[float, ...]


def shipped(name: str) -> Path | None:
    """Return the file of a run that ships in the package gtsam, such as ``goats_15``, or None."""
    found = find_spec("gtsam")
    if found is None or not found.submodule_search_locations:
        return None
    path = Path(found.submodule_search_locations[0]) / "Data" / f"{name}.pyfg"
    return path if path.is_file() else None


def read_pyfg(path: Path, speed: float = NOMINAL_SPEED) -> Log:
    """Return the log in a file of one vehicle, whose odometry is in a frame of its own.

    Where it has no instants they follow from the way gone at a `speed` (m/s).

    Raises:
        BadLog: naming file, line and remedy.
    """
    lines: dict[str, list[Written]] = {kind: [] for kind in WORDS}
    for written in _lines(path):
        lines[written.kind].append(written)
    steps = list(map(_line, lines["EDGE_SE2"]))
    if not steps:
        raise BadLog(f"{path}: has no EDGE_SE2, so no odometry to replay")
    for step in steps:
        if abs(step.numbers[3]) > 2.0 * pi + 0.01:
            raise BadLog(
                f"{step.place}: turns by {step.numbers[3]:g} rad, beyond 2 pi; are these degrees?"
            )
    numbers = _numbered(steps)
    vertices = list(map(_line, lines["VERTEX_XY"]))
    beacons = SurveyedBeacons(
        tuple(line.names[0] for line in vertices),
        np.array([(*line.numbers, 0.0) for line in vertices]).reshape(-1, 3),
    )
    read = partial(_range_line, numbers, beacons.names)
    ranges, left_out = sifted(lines["EDGE_RANGE"], read)
    moves = np.array([line.numbers[1:4] for line in steps])
    poses = _poses(moves)
    times, has_clock = _times(steps, poses, speed)
    return Log(
        path.stem,
        times,
        poses[:, :2],
        poses[:, 2] + _ahead(moves),
        np.zeros(len(times)),
        beacons,
        _ranges(ranges, numbers, beacons, times),
        LoggedFixes(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3))),
        placed=False,
        has_clock=has_clock,
        stated=_stated(steps, ranges),
        left_out=left_out,
    )


def _lines(path: Path) -> Iterator[Written]:
    try:
        text = text_of(regular(path).read_bytes())
    except (OSError, UnicodeDecodeError) as error:
        raise BadLog(f"{path}: cannot be read as text: {error}") from None
    for number, row in enumerate(text.splitlines(), 1):
        words, place = row.split(), f"{path}:{number}"
        if not words or words[0].startswith("#"):
            continue
        kind = words[0]
        if kind not in WORDS:
            known = ", ".join(WORDS)
            raise BadLog(f"{place}: {kind} is not known; a run in the plan has {known}")
        yield Written(place, kind, words)


def _line(written: Written) -> Line:
    place, kind, words = written
    if len(words) != WORDS[kind]:
        raise BadLog(f"{place}: {kind} has {len(words) - 1} words, not {WORDS[kind] - 1}")
    names = tuple(words[k] for k in NAMES[kind])
    rest = [word for k, word in enumerate(words) if k and k not in NAMES[kind]]
    return Line(place, names, tuple(recorded(place, kind, word) for word in rest))


def _range_line(poses: Mapping[str, int], beacons: Sequence[str], written: Written) -> Line:
    """Return a line of a range, from a pose that there is to a beacon that there is."""
    line = _line(written)
    pose, beacon = line.names
    if pose not in poses:
        raise BadLog(f"{line.place}: no step leads to the pose {pose}")
    if beacon not in beacons:
        raise BadLog(f"{line.place}: the beacon {beacon} has no VERTEX_XY")
    if line.numbers[1] < 0.0 or line.numbers[2] <= 0.0:
        raise BadLog(f"{line.place}: needs a range from 0 m on and a variance above 0 m2")
    return line


def _numbered(steps: list[Line]) -> dict[str, int]:
    """Return the poses' names with their numbers, in the order of one vehicle's steps."""
    numbers = {steps[0].names[0]: 0}
    for line in steps:
        before, after = line.names
        if numbers.get(before) != len(numbers) - 1 or after in numbers:
            raise BadLog(
                f"{line.place}: the step from {before} to {after} does not go on from the last; "
                "a log is of one vehicle, its steps in order"
            )
        numbers[after] = len(numbers)
    return numbers


def _poses(steps: Floats) -> Floats:
    """Return the poses (n + 1, 3) that steps (n, 3), each in the frame of the last, sum up to."""
    heading = np.concatenate(([0.0], np.cumsum(steps[:, 2])))
    c, s = np.cos(heading[:-1]), np.sin(heading[:-1])
    moved = np.column_stack((c * steps[:, 0] - s * steps[:, 1], s * steps[:, 0] + c * steps[:, 1]))
    places = np.vstack((np.zeros((1, 2)), np.cumsum(moved, axis=0)))
    return np.column_stack((places, heading))


def _ahead(steps: Floats) -> float:
    """Return which way (rad, in the body) a vehicle goes: a file need not have x point ahead."""
    return float(np.arctan2(*steps[:, 1::-1].sum(axis=0)))


def _times(steps: list[Line], poses: Floats, speed: float) -> tuple[Floats, bool]:
    """Return instants (n,), s, from 0, and whether they were recorded."""
    stamps = np.array([line.numbers[0] for line in steps])
    if (stamps == stamps[0]).all():
        gone = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        return np.concatenate(([0.0], np.cumsum(gone))) / speed, False
    back = np.flatnonzero(np.diff(stamps) < 0.0)
    if len(back):
        line = steps[int(back[0]) + 1]
        raise BadLog(f"{line.place}: its instant {line.numbers[0]:g} s is before that of the last")
    first = stamps[0] - (stamps[1] - stamps[0])  # a step bears the instant of its end
    return np.concatenate(([first], stamps)) - first, True


def _ranges(
    lines: list[Line], poses: dict[str, int], beacons: SurveyedBeacons, times: Floats
) -> Ranges:
    at = times[[poses[line.names[0]] for line in lines]] if lines else np.zeros(0)
    order = np.argsort(at, kind="stable")
    whom = np.array([beacons.names.index(line.names[1]) for line in lines], dtype=np.int64)
    metres = np.array([line.numbers[1] for line in lines])
    return Ranges(at[order], whom[order], metres[order])


def _stated(steps: list[Line], ranges: list[Line]) -> Stated | None:
    if not ranges:
        return None
    variance = float(np.median([line.numbers[2] for line in ranges]))
    for line in steps:
        if min(line.numbers[4], line.numbers[7], line.numbers[9]) < 0.0:
            raise BadLog(f"{line.place}: needs variances of a step from 0 on")
    spread = np.array([line.numbers[4:] for line in steps])
    along = np.sqrt(0.5 * (spread[:, 0] + spread[:, 3]))
    return Stated(sqrt(variance), along, np.sqrt(spread[:, 5]))


# Rows of a log that somebody kept: CSV files of a folder, or JSON messages of an MCAP file.
#
# A table has the columns that our own export writes: `tracks` (or `odometry`), `fixes`, `ranges`,
# `beacons`. Further columns are ignored.


Row = Mapping[str, Any]
Read = TypeVar("Read")


class LogTable:
    """Rows, each with the place that a message names: `file:line`, or the number of a message.

    What is to be said of rows that cannot be is in `left_out`, also that of the tables made of it.
    """

    def __init__(
        self,
        source: str,
        rows: Iterable[tuple[str, Row]] = (),
        left_out: list[str] | None = None,
    ) -> None:
        self.source, self.rows = source, list(rows)
        self.left_out: list[str] = [] if left_out is None else left_out

    def __len__(self) -> int:
        return len(self.rows)

    def of(self, rows: Iterable[tuple[str, Row]]) -> "LogTable":
        """Return some of its rows, as they are or with more columns, as a table."""
        return LogTable(self.source, rows, self.left_out)

    def where(self, column: str, value: str) -> "LogTable":
        """Return the rows that have a value in a column, however it is capitalised; all if there is
        no such column, or none is asked for.
        """
        if not value:
            return self
        return self.of(
            (place, row)
            for place, row in self.rows
            if str(row.get(column, value)).strip().casefold() == value.casefold()
        )

    def has(self, column: str) -> bool:
        """Tell whether the table has a column."""
        return any(column in row for _, row in self.rows)

    def sifted(self, read: Callable[[str, Row], Read]) -> list[Read]:
        """Return what is read of each row; those that cannot be are left out.

        Raises:
            BadLog: what is wrong with the first of them, where they are not the fewer.
        """
        found, told = sifted(self.rows, lambda line: read(*line))
        self.left_out += told
        return found


def name_in(place: str, row: Row, column: str) -> str:
    """Return a name in a row.

    Raises:
        BadLog: naming the place that has none.
    """
    if not row.get(column):
        raise BadLog(f"{place}: needs a name in the column {column}")
    return str(row[column])


def numbers_in(place: str, row: Row, *columns: str) -> list[float]:
    """Return numbers in a row.

    Raises:
        BadLog: naming the place, and all columns that are needed and lacking.
    """
    lacking = [column for column in columns if row.get(column) in (None, "")]
    if lacking:
        fault = NothingLogged if all(row.get(column) == "" for column in lacking) else BadLog
        raise fault(
            f"{place}: needs numbers in {', '.join(columns)}; it lacks {', '.join(lacking)} and "
            f"has {', '.join(filter(None, row))}"
        )
    return [recorded(place, column, row[column]) for column in columns]


def csv_tables(folder: Path) -> dict[str, LogTable]:
    """Return the tables of a folder by their files' names.

    Raises:
        BadLog: when a file cannot be read as CSV.
    """
    found = {path.stem: read_table(path, BadLog) for path in sorted(folder.glob("*.csv"))}
    return {
        name: LogTable(table.path, table.rows(), [*table.left_out]) for name, table in found.items()
    }


def mcap_tables(path: Path) -> dict[str, LogTable]:
    """Return the tables of an MCAP file: its JSON messages, by the last word of their topics.

    Raises:
        BadLog: when it cannot be read, or the package mcap is missing.
    """
    tables: dict[str, LogTable] = {}
    try:
        for told in mcap_messages(str(path)):
            table = tables.setdefault(told.topic.rpartition("/")[2], LogTable(str(path)))
            row = told.content if isinstance(told.content, dict) else {}  # it lacks all columns
            table.rows.append((told.where, row))
    except BadChart as error:
        raise BadLog(str(error)) from None
    return tables
