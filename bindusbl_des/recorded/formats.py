"""Formats of logs: PyFG, CSV and MCAP."""

import csv
import json
from collections.abc import Iterable, Iterator, Mapping
from importlib.util import find_spec
from math import sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.arrays import Floats
from ..core.files import regular
from ..core.wording import described
from .log import BadLog, Log, LoggedFixes, Ranges, Stated, SurveyedBeacons, recorded

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


class Line(NamedTuple):
    """A line: where it stands (file:line), of which kind, its names and its numbers."""

    place: str
    kind: str
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
    lines: dict[str, list[Line]] = {kind: [] for kind in WORDS}
    for line in _lines(path):
        lines[line.kind].append(line)
    steps = lines["EDGE_SE2"]
    if not steps:
        raise BadLog(f"{path}: has no EDGE_SE2, so no odometry to replay")
    numbers = _numbered(steps)
    beacons = SurveyedBeacons(
        tuple(line.names[0] for line in lines["VERTEX_XY"]),
        np.array([(*line.numbers, 0.0) for line in lines["VERTEX_XY"]]).reshape(-1, 3),
    )
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
        _ranges(lines["EDGE_RANGE"], numbers, beacons, times),
        LoggedFixes(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3))),
        placed=False,
        has_clock=has_clock,
        stated=_stated(steps, lines["EDGE_RANGE"]),
    )


def _lines(path: Path) -> Iterator[Line]:
    try:
        text = regular(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadLog(f"{path}: cannot be read as text: {error}") from None
    for number, row in enumerate(text.splitlines(), 1):
        words, place = row.split(), f"{path}:{number}"
        if not words:
            continue
        kind = words[0]
        if kind not in WORDS:
            known = ", ".join(WORDS)
            raise BadLog(f"{place}: {kind} is not known; a run in the plan has {known}")
        if len(words) != WORDS[kind]:
            raise BadLog(f"{place}: {kind} has {len(words) - 1} words, not {WORDS[kind] - 1}")
        names = tuple(words[k] for k in NAMES[kind])
        rest = [word for k, word in enumerate(words) if k and k not in NAMES[kind]]
        yield Line(place, kind, names, tuple(recorded(place, kind, word) for word in rest))


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
    for line in lines:
        pose, beacon = line.names
        if pose not in poses:
            raise BadLog(f"{line.place}: no step leads to the pose {pose}")
        if beacon not in beacons.names:
            raise BadLog(f"{line.place}: the beacon {beacon} has no VERTEX_XY")
        if line.numbers[1] < 0.0 or line.numbers[2] <= 0.0:
            raise BadLog(f"{line.place}: needs a range from 0 m on and a variance above 0 m2")
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


class LogTable:
    """Rows, each with the place that a message names: `file:line`, or the number of a message."""

    def __init__(self, source: str, rows: Iterable[tuple[str, Row]] = ()) -> None:
        self.source, self.rows = source, list(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def where(self, column: str, value: str) -> "LogTable":
        """Return the rows that have a value in a column, however it is capitalised; all if there is
        no such column, or none is asked for.
        """
        if not value:
            return self
        kept = [
            (place, row)
            for place, row in self.rows
            if str(row.get(column, value)).strip().casefold() == value.casefold()
        ]
        return LogTable(self.source, kept)

    def has(self, column: str) -> bool:
        """Tell whether the table has a column."""
        return any(column in row for _, row in self.rows)

    def words(self, column: str) -> list[str]:
        """Return a column of names.

        Raises:
            BadLog: naming the place that has none.
        """
        for place, row in self.rows:
            if not row.get(column):
                raise BadLog(f"{place}: needs a name in the column {column}")
        return [str(row[column]) for _, row in self.rows]

    def numbers(self, *columns: str) -> Floats:
        """Return columns of numbers (n, columns).

        Raises:
            BadLog: naming the place, and all columns that are needed and lacking.
        """
        for place, row in self.rows:
            lacking = [column for column in columns if row.get(column) in (None, "")]
            if lacking:
                raise BadLog(
                    f"{place}: needs numbers in {', '.join(columns)}; it lacks "
                    f"{', '.join(lacking)} and has {', '.join(filter(None, row))}"
                )
        found = [
            [recorded(place, column, row[column]) for column in columns] for place, row in self.rows
        ]
        return np.array(found, dtype=np.float64).reshape(-1, len(columns))


def csv_tables(folder: Path) -> dict[str, LogTable]:
    """Return the tables of a folder by their files' names.

    Raises:
        BadLog: when a file cannot be read as CSV.
    """
    return {path.stem: _csv_table(path) for path in sorted(folder.glob("*.csv"))}


def _csv_table(path: Path) -> LogTable:
    try:
        with open(regular(path), newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, skipinitialspace=True, restkey="", restval=None)
            rows = [(f"{path}:{reader.line_num}", row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadLog(f"{path}: cannot be read as a CSV file: {error}") from None
    return LogTable(str(path), rows)


def mcap_tables(path: Path) -> dict[str, LogTable]:
    """Return the tables of an MCAP file: its JSON messages, by the last word of their topics.

    Raises:
        BadLog: when it cannot be read, or the package mcap is missing.
    """
    tables: dict[str, LogTable] = {}
    for topic, number, row in _messages(path):
        name = topic.rpartition("/")[2]
        table = tables.setdefault(name, LogTable(str(path)))
        table.rows.append((f"{path}: message {number} on {topic}", row))
    return tables


def _messages(path: Path) -> Iterator[tuple[str, int, Row]]:
    """Yield topic, number on it from 1, and content of each JSON message, in the order of time."""
    try:
        from mcap.reader import make_reader
    except ModuleNotFoundError:
        raise BadLog(
            f"{path}: MCAP files are read by the package mcap, which is not installed here; "
            "install it with: python -m pip install 'bindusbl-des[replay]'"
        ) from None
    counts: dict[str, int] = {}
    try:
        with open(regular(path), "rb") as file:
            for _, channel, message in make_reader(file).iter_messages():
                if channel.message_encoding != "json":
                    continue
                topic = channel.topic
                counts[topic] = counts.get(topic, 0) + 1
                row = json.loads(message.data)
                if not isinstance(row, dict):
                    raise BadLog(
                        f"{path}: message {counts[topic]} on {topic} is {described(row)}, no row"
                    )
                yield topic, counts[topic], row
    except BadLog:
        raise
    except Exception as error:  # of a damaged file the package raises whatever it comes upon
        raise BadLog(
            f"{path}: cannot be read as an MCAP file: {error or type(error).__name__}"
        ) from None
