"""Rows of a log that somebody kept: CSV files of a folder, or JSON messages of an MCAP file.

A table has the columns that our own export writes: `tracks` (or `odometry`), `fixes`, `ranges`,
`beacons`.  Further columns are ignored.
"""

import csv
import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core.regular_files import regular
from ..core.wording import described
from .log import Array, BadLog, recorded

Row = Mapping[str, Any]


class Table:
    """Rows, each with the place that a message names: `file:line`, or the number of a message."""

    def __init__(self, source: str, rows: Iterable[tuple[str, Row]] = ()) -> None:
        self.source, self.rows = source, list(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def where(self, column: str, value: str) -> "Table":
        """Return the rows that have a value in a column; all if there is no such column, or none
        is asked for.
        """
        kept = [(place, row) for place, row in self.rows if row.get(column, value) == value]
        return Table(self.source, kept) if value else self

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

    def numbers(self, *columns: str) -> Array:
        """Return columns of numbers (n, columns).

        Raises:
            BadLog: naming the place and the column that holds none.
        """
        found = [[_number(place, row, column) for column in columns] for place, row in self.rows]
        return np.array(found, dtype=np.float64).reshape(-1, len(columns))


def _number(place: str, row: Row, column: str) -> float:
    if row.get(column) in (None, ""):
        raise BadLog(f"{place}: needs a number in the column {column}; it has {', '.join(row)}")
    return recorded(place, column, row[column])


def csv_tables(folder: Path) -> dict[str, Table]:
    """Return the tables of a folder by their files' names.

    Raises:
        BadLog: when a file cannot be read as CSV.
    """
    return {path.stem: _csv_table(path) for path in sorted(folder.glob("*.csv"))}


def _csv_table(path: Path) -> Table:
    try:
        with open(regular(path), newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, skipinitialspace=True, restkey="", restval=None)
            rows = [(f"{path}:{reader.line_num}", row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadLog(f"{path}: cannot be read as a CSV file: {error}") from None
    return Table(str(path), rows)


def mcap_tables(path: Path) -> dict[str, Table]:
    """Return the tables of an MCAP file: its JSON messages, by the last word of their topics.

    Raises:
        BadLog: when it cannot be read, or the package mcap is missing.
    """
    tables: dict[str, Table] = {}
    for topic, number, row in _messages(path):
        name = topic.rpartition("/")[2]
        table = tables.setdefault(name, Table(str(path)))
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
        raise BadLog(f"{path}: cannot be read as an MCAP file: {error}") from None
