"""Tables that users wrote as text: logs, tracks, CTD casts, curves, airtimes, tables of sound.

They are read with any separator (comma, semicolon, tab, blank), decimal mark and encoding; rows
that cannot be read are left out.
"""

import csv
import io
import math
import os
import re
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache, partial, update_wrapper
from pathlib import Path
from typing import Any, Concatenate, NamedTuple, ParamSpec, TypeVar

from .files import regular, text_of

Given = TypeVar("Given")
Found = TypeVar("Found")
More = ParamSpec("More")

# Separators of fields, and beginnings of lines without fields ("sep=;" is Excel's).
PARTING = (",", ";", "\t")
REMARK = re.compile(r"\s*(#|%|sep=)")
DECIMAL_COMMA = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")
POINT = re.compile(r"\s*[-+]?\d*\.\d+([eE][-+]?\d+)?\s*")

# The first line of Sea-Bird's .cnv, and the last line of its header, which names the columns and
# the mark of missing values.
SEA_BIRD, SEA_BIRD_DATA = "* Sea-Bird", "*END*"

# First bytes of files with tables that are not text.
OTHERS = {
    b"PK": "a zip archive, such as a workbook of Excel; save the sheet as CSV",
    b"PAR1": "a Parquet file; save it as CSV",
    b"\xd0\xcf\x11\xe0": "a workbook of Excel; save the sheet as CSV",
}

# Messages name at most this many of the rows that are left out.
MOST_NAMED = 2


class TableRow(NamedTuple):
    """A row: its place (file:line), and its cells by column."""

    where: str
    cells: dict[str, str]

    def number(
        self, column: str, limits: tuple[float, float], called: str = "", slack: float = 0.0
    ) -> float:
        """Return the number in a column, `called` so, within its limits, less by `slack` at most.

        Raises:
            ValueError: naming place, column and range, for anything else.
        """
        text, (least, most) = self.cells[column].strip(), limits
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not least - slack <= value <= most:
            raise ValueError(
                f"{self.where}: {called or column} must be a number from {least:g} to {most:g}; "
                f"got {text!r}"
            )
        return value


class Table(NamedTuple):
    """A table: its file, the names of its columns, its lines by number with their cells, and
    messages about lines that are left out.
    """

    path: str
    names: list[str]
    lines: list[tuple[int, list[str]]]
    left_out: tuple[str, ...] = ()

    def rows(self) -> Iterator[TableRow]:
        """Yield the rows; cells that a short row lacks are empty."""
        nothing = dict.fromkeys(self.names, "")
        for number, cells in self.lines:
            known = nothing | dict(zip(self.names, cells, strict=False))
            yield TableRow(f"{self.path}:{number}", known)


def read_table(path: str | Path, fault: type[ValueError] = ValueError) -> Table:
    """Return the table in a text file, whose first line of cells names the columns.

    Lines that begin with `#` or `%` are remarks; empty lines and repeated headers are skipped; a
    last remark before a table of numbers alone is its header.  Decimal commas are read where commas
    do not separate the fields and no number has a point.

    Raises:
        ValueError: of the type `fault`, naming the file, when it cannot be read as a table.
    """
    try:
        raw = Path(regular(path)).read_bytes()
        for begin, kind in OTHERS.items():
            if raw.startswith(begin):
                raise fault(f"{path}: is {kind}")
        return _table(str(path), text_of(raw), fault)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise fault(f"{path}: cannot be read as a CSV file: {why}") from None


def _table(path: str, text: str, fault: type[ValueError]) -> Table:
    lines = io.StringIO(text, newline=None)
    if text.startswith(SEA_BIRD):
        return _of_sea_bird(path, text)
    remark, header, number = "", "", 0
    for line in lines:
        number += 1
        if line.strip() and not REMARK.match(line):
            header = line
            break
        remark = line
    parting = max(PARTING, key=header.count)
    if parting not in header and len(header.split()) > 1:
        parting = ""
    names, told = _names(header, parting), _names(remark.lstrip(" #%"), parting)
    if all(map(_is_number, names)) and len(told) == len(names):  # as numpy's savetxt writes it
        names, lines, number = told, io.StringIO(header + lines.read()), number - 1
    rows = [
        (at, cells)
        for at, cells in _parted(lines, parting, number)
        if any(map(str.strip, cells)) and list(map(str.strip, cells)) != names
    ]
    if parting != ",":
        _write_points([cells for _, cells in rows])
    rows, left_out = sifted(rows, partial(_whole, path, names, fault))
    return Table(path, names, rows, left_out)


def _of_sea_bird(path: str, text: str) -> Table:
    """Return the table of a .cnv file; missing values are empty."""
    told, _, data = text.partition(SEA_BIRD_DATA)
    flag = re.search(r"(?m)^# bad_flag = (\S+)", told)
    missing = flag.group(1) if flag else ""
    names = re.findall(r"(?m)^# name \d+ = ([^:\n]*[^:\s])", told)
    lines = [
        (number, ["" if cell == missing else cell for cell in row.split()])
        for number, row in enumerate(data.splitlines(), told.count("\n") + 1)
        if row.strip()
    ]
    return Table(path, names, lines)


def _names(header: str, parting: str) -> list[str]:
    return [name.strip() for _, names in _parted([header], parting, 0) for name in names]


def _parted(lines: Iterable[str], parting: str, before: int) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each line, with its number, which counts on from `before`."""
    told = (line if REMARK.match(line) is None else "\n" for line in lines)
    if not parting:
        yield from enumerate(map(str.split, told), before + 1)
        return
    reader = csv.reader(told, delimiter=parting, skipinitialspace=True)
    yield from ((before + reader.line_num, cells) for cells in reader)


def _is_number(cell: str) -> bool:
    return bool(re.fullmatch(r"[-+]?[\d.,]*\d[\d.,]*([eE][-+]?\d+)?", cell.strip()))


def _write_points(lines: list[list[str]]) -> None:
    """Replace decimal commas, unless a number has a point: commas then separate thousands."""
    if any(POINT.fullmatch(cell) for cells in lines for cell in cells):
        return
    for cells in lines:
        for n, cell in enumerate(cells):
            if DECIMAL_COMMA.fullmatch(cell):
                cells[n] = cell.replace(",", ".")


def _whole(
    path: str, names: Sequence[str], fault: type[ValueError], line: tuple[int, list[str]]
) -> tuple[int, list[str]]:
    """Return a line; raise `fault` if it has numbers beyond the last column."""
    number, cells = line
    if any(map(_is_number, cells[len(names) :])):
        raise fault(
            f"{path}:{number}: has {len(cells)} values under {len(names)} names of columns; are "
            "these decimal commas? Part the fields by semicolons, or write decimal points"
        )
    return line


Reader = Callable[Concatenate[str, More], Found]
FileReader = Callable[Concatenate[str | Path, More], Found]


def of_file(most: int) -> Callable[[Reader[More, Found]], FileReader[More, Found]]:
    """Return a decorator that caches what a function reads from `most` unchanged files."""

    def made(read: Reader[More, Found]) -> FileReader[More, Found]:
        @lru_cache(maxsize=most)
        def kept(path: str, _: tuple[int, int], *more: Any, **named: Any) -> Found:
            return read(path, *more, **named)

        def asked(path: str | Path, /, *more: More.args, **named: More.kwargs) -> Found:
            try:
                found = os.stat(path)
            except (OSError, ValueError):
                return read(str(path), *more, **named)  # which raises the error
            changed: Any = found.st_mtime_ns, found.st_size
            again: dict[str, Any] = named
            return kept(str(path), changed, *more, **again)

        update_wrapper(asked, read)
        return asked

    return made


# A few rows that cannot be read do not spoil the others.


class Unmeasured(ValueError):
    """A row without measurements; a log that is faster than its sensor has mostly such rows."""


def sifted(
    rows: Iterable[Given], read: Callable[[Given], Found]
) -> tuple[list[Found], tuple[str, ...]]:
    """Return the readable rows, as `read` returns them, and messages about the others.

    >>> sifted("12x", int)
    ([1, 2], ("1 of 3 rows is left out: invalid literal for int() with base 10: 'x'",))

    Raises:
        ValueError: the error of the first unreadable row, where these are not the fewer; rows
            without measurements may be more.
    """
    kept: list[Found] = []
    why: list[str] = []
    first: ValueError | None = None
    wrong = 0
    for row in rows:
        try:
            kept.append(read(row))
        except ValueError as error:
            first = first or error
            wrong += not isinstance(error, Unmeasured)
            why.append(str(error))
    if first is not None and (not kept or (wrong and wrong >= len(kept))):
        raise first
    return kept, left_out(why, len(kept) + len(why))


def left_out(why: Sequence[str], count: int) -> tuple[str, ...]:
    """Return a message about rows, out of `count`, that are left out, with the first reasons."""
    if not why:
        return ()
    more = f"; and {len(why) - MOST_NAMED} more" if len(why) > MOST_NAMED else ""
    is_ = "is" if len(why) == 1 else "are"
    return (f"{len(why)} of {count} rows {is_} left out: {'; '.join(why[:MOST_NAMED])}{more}",)


def because(told: Sequence[str]) -> str:
    """Return in brackets which rows are left out, for a message about too few rows."""
    return f" ({'; '.join(told)})" if told else ""


def ordered(
    places: Sequence[str],
    values: Sequence[float],
    what: str,
    unit: str,
    remedy: str = "",
    fault: type[ValueError] = ValueError,
) -> tuple[list[int], tuple[str, ...]]:
    """Return the numbers of rows whose values increase, as many as possible, and messages on the
    others; of equal values the first counts.

    `places` (n,) are the places of the rows, `values` (n,) are of a quantity `what` with a `unit`.

    Raises:
        ValueError: of the type `fault`, with the remedy, where rows that are not in order are not
            the fewer.
    """
    once = [n for n in range(len(values)) if not n or values[n] != values[n - 1]]
    told: tuple[str, ...] = ()
    if len(again := sorted(set(range(len(values))) - set(once))):
        told = (
            f"{len(again)} of {len(values)} rows have the {what} of the row before, first "
            f"{places[again[0]]}: the first of each counts",
        )
    kept = [once[k] for k in _rising([values[n] for n in once])]

    def fitting(n: int) -> int:
        after = bisect_left(kept, n)
        if after < len(kept) and kept[after] == n:
            return n
        is_less = after > 0 and values[kept[after - 1]] >= values[n]
        pair = (kept[after - 1], n) if is_less else (n, kept[after])
        first, second = (f"{values[row]:.15g} {unit}" for row in pair)
        raise fault(f"{places[n]}: {what} must increase, but {second} follows {first}{remedy}")

    found, others = sifted(once, fitting)
    return found, told + others


def _rising(values: Sequence[float]) -> list[int]:
    """Return the indices of a longest increasing subsequence; of two values in conflict it has the
    greater, as the deepest sample of a cast.

    Source: C. Schensted, Longest increasing and decreasing subsequences, Canadian Journal of
    Mathematics 13, 1961.

    >>> _rising([0.0, 1.0, 9.0, 2.0, 3.0, 2.5])
    [0, 1, 3, 4]
    """
    ends: list[
        float
    ] = []  # from the end, negated: the least last value of each length, and its index
    tails: list[int] = []
    behind = [-1] * len(values)
    for n in range(len(values) - 1, -1, -1):
        place = bisect_left(ends, -values[n])
        behind[n] = tails[place - 1] if place else -1
        ends[place : place + 1], tails[place : place + 1] = [-values[n]], [n]
    found, last = [], tails[-1] if tails else -1
    while last >= 0:
        found.append(last)
        last = behind[last]
    return found
