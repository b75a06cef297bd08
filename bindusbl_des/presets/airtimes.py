"""Airtimes of modems as measured: a row for each payload."""

import csv
from dataclasses import dataclass
from functools import lru_cache
from math import inf, isfinite, nan
from pathlib import Path
from typing import NoReturn

COLUMNS = ("payload_bytes", "airtime_s", "processing_delay_mean_s")


def table_file(name: str) -> str:
    """Return where a table that ships lies."""
    return str(Path(__file__).with_name(name))


@dataclass(frozen=True)
class AirtimeTable:
    """How long messages of 1, 2, ... bytes take, and how much later a modem hands them over.

    Both are tuples of s, the first for one byte.  Where no delay was measured stands that of the
    next larger payload which has one (S2C: below 20 B that of 20 B), behind the last that of the
    last; 0 where the table has none at all.
    """

    airtimes_s: tuple[float, ...]
    delays_s: tuple[float, ...]

    @property
    def most_bytes(self) -> int:
        """The largest payload of the table."""
        return len(self.airtimes_s)

    def airtime(self, payload_bytes: int) -> float:
        """Return the airtime (s) of a message, as it stands in the table.

        >>> airtime_table(table_file("s2c_airtimes.csv")).airtime(56)
        0.770201
        """
        return self.airtimes_s[payload_bytes - 1]

    def delay(self, payload_bytes: int) -> float:
        """Return how long (s) after its end a message is handed over.

        >>> table = airtime_table(table_file("s2c_airtimes.csv"))
        >>> table.delay(1), table.delay(20), table.delay(21)
        (0.088179, 0.088179, 0.088342)
        """
        return self.delays_s[payload_bytes - 1]


def airtime_table(file: str) -> AirtimeTable:
    """Return the table in a CSV file.

    Its columns are `payload_bytes`, from 1 on without a gap, `airtime_s` and, if it likes,
    `processing_delay_mean_s`, which may be empty.

    Raises:
        ValueError: when there is no such file, or a line of it is wrong.
    """
    path = Path(file)
    try:
        return _read(path, path.stat().st_mtime_ns)
    except OSError as error:
        raise ValueError(f"{file}: {error.strerror or error}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{file}: cannot be read as a CSV file: {error}") from None


@lru_cache(maxsize=16)
def _read(path: Path, _changed: int) -> AirtimeTable:
    """Read a table; one that has changed since is read again."""
    with path.open(newline="", encoding="utf-8-sig") as stream:
        lines = csv.DictReader(stream, restval="")
        if not {*COLUMNS[:2]} <= {*(lines.fieldnames or ())}:
            _refuse(path, 1, f"has no columns {' and '.join(COLUMNS[:2])}")
        airtimes: list[float] = []
        delays: list[float] = []
        for number, line in enumerate(lines, 2):
            if line[COLUMNS[0]].strip() != str(number - 1):
                _refuse(path, number, f"is for {line[COLUMNS[0]]!r} bytes; {number - 1} is next")
            airtimes.append(_seconds(path, number, line, COLUMNS[1]))
            empty = not (line.get(COLUMNS[2]) or "").strip()
            delays.append(nan if empty else _seconds(path, number, line, COLUMNS[2]))
    if not airtimes:
        _refuse(path, 2, "is the first of the table, and there is none")
    return AirtimeTable(tuple(airtimes), _filled(delays))


def _seconds(path: Path, number: int, line: dict[str, str], column: str) -> float:
    try:
        value = float(line[column])
    except ValueError:
        value = inf
    if not (isfinite(value) and 0.0 <= value <= 1e4):
        _refuse(path, number, f"has the {column} {line[column]!r}, which is no time in s")
    return value


def _filled(delays: list[float]) -> tuple[float, ...]:
    """Fill gaps with the delay of the next larger payload, behind the last with that one."""
    known = [it for it in delays if it == it]
    after = known[-1] if known else 0.0
    filled: list[float] = []
    for it in reversed(delays):
        after = it if it == it else after
        filled.append(after)
    return tuple(reversed(filled))


def _refuse(path: Path, number: int, what: str) -> NoReturn:
    raise ValueError(f"{path}:{number}: a line of a table of airtimes that {what}")
