"""Measured channels: curves of delivery over range, and time series of links."""

import math
import re
from functools import partial
from itertools import pairwise
from typing import NamedTuple

from ...support.tables import TableRow, of_file, read_table, sifted

# Columns of a file with a curve, and an example of a line
COLUMNS = ("range_m", "delivery_ratio")
EXAMPLE = "such as `50,0.95`"


class DeliveryCurve(NamedTuple):
    """Ranges (n,), m, increasing, delivery ratios (n,), and messages on rows that are left out."""

    ranges_m: tuple[float, ...]
    ratios: tuple[float, ...]
    left_out: tuple[str, ...] = ()


@of_file(16)
def read_curve(path: str) -> DeliveryCurve:
    """Return the curve in a CSV file.

    Its header line has the columns range_m and delivery_ratio, in any order and among others; the
    ranges increase, and the ratios lie in [0, 1].

    Raises:
        ValueError: naming file, line, value and remedy, when the file is not such a curve.
    """
    table = read_table(path)
    missing = [name for name in COLUMNS if name not in table.names]
    if missing:
        raise ValueError(
            f"{path}:1: column {', '.join(missing)} missing; the header needs {', '.join(COLUMNS)}"
        )
    points, unread = sifted(table.rows(), _point)
    if not points:
        raise ValueError(f"{path}: has no points; a curve needs at least one line {EXAMPLE}")
    for (_, before, _), (where, away, _) in pairwise(points):
        if away <= before:
            raise ValueError(
                f"{where}: range_m is {away:g} after {before:g}; sort the lines by range, each "
                "range once (is there a curve of another modem in the file?)"
            )
    _, ranges, ratios = zip(*points, strict=True)
    return DeliveryCurve(ranges, ratios, (*table.left_out, *unread))


def _point(row: TableRow) -> tuple[str, float, float]:
    """Return a row's place (file:line), range (m) and delivery ratio."""
    values = []
    for name in COLUMNS:
        try:
            values.append(float(row.cells[name]))
        except ValueError:
            raise ValueError(
                f"{row.where}: {name} is {row.cells[name]!r}; give a number, {EXAMPLE}"
            ) from None
    away, ratio = values
    if not 0.0 <= away < math.inf:
        raise ValueError(f"{row.where}: range_m is {away:g}; give metres from 0 on")
    if not 0.0 <= ratio <= 1.0:
        remedy = "divide per cent by 100" if 1.0 < ratio <= 100.0 else "give a share of 1"
        raise ValueError(f"{row.where}: delivery_ratio is {ratio:g}, not within 0 and 1; {remedy}")
    return row.where, away, ratio


# Columns of a file with links beside the measured one, and the form of a vehicle's name
LINK = ("time_s", "from", "to")
MEASURED = ("chance", "level_db")
VEHICLE = re.compile(r"(AUV|ASV)(\d{1,6})")
LINKS_EXAMPLE = "such as `0,AUV0,ASV1,0.9`"


class LinkRow(NamedTuple):
    """A row's place (file:line), instant (s), sender and listener, and the measured value."""

    where: str
    time: float
    sender: str
    listener: str
    value: float


class LinkSeries(NamedTuple):
    """Rows of links, with increasing instants for each link; whether their values are levels (dB),
    not chances; and messages on rows that are left out.
    """

    rows: tuple[LinkRow, ...]
    has_levels: bool
    left_out: tuple[str, ...] = ()


@of_file(16)
def read_series(path: str) -> LinkSeries:
    """Return the measured time series of links in a CSV file.

    Its header line has the columns time_s, from and to, and either chance, in [0, 1], or level_db;
    the instants of each link increase.

    Raises:
        ValueError: naming file, line, column, value and remedy, when the file is no such series.
    """
    table = read_table(path)
    missing = [name for name in LINK if name not in table.names]
    measured = [name for name in MEASURED if name in table.names]
    if missing or len(measured) != 1:
        lacks = (
            f"column {', '.join(missing)} missing"
            if missing
            else (
                "has both chance and level_db" if measured else "column chance or level_db missing"
            )
        )
        raise ValueError(
            f"{path}:1: {lacks}; the header needs time_s, from, to and one of chance, level_db"
        )
    [value] = measured
    rows, unread = sifted(table.rows(), partial(_link, value))
    if not rows:
        raise ValueError(f"{path}: has no rows; give at least one {LINKS_EXAMPLE}")
    last: dict[tuple[str, str], float] = {}
    for row in rows:
        link = row.sender, row.listener
        if row.time <= last.get(link, -math.inf):
            raise ValueError(
                f"{row.where}: time_s is {row.time:g} after {last[link]:g} of the same link; sort "
                "the lines of each link by time, each instant once"
            )
        last[link] = row.time
    return LinkSeries(tuple(rows), value == "level_db", (*table.left_out, *unread))


def _link(column: str, row: TableRow) -> LinkRow:
    """Return a row of links with the value in a column."""
    numbers = []
    for name in ("time_s", column):
        text = row.cells[name]
        try:
            numbers.append(float(text))
        except ValueError:
            numbers.append(math.nan)
        if not math.isfinite(numbers[-1]):
            raise ValueError(f"{row.where}: {name} is {text!r}; give a number, {LINKS_EXAMPLE}")
    for name in ("from", "to"):
        if VEHICLE.fullmatch(row.cells[name].strip()) is None:
            raise ValueError(
                f"{row.where}: {name} is {row.cells[name]!r}; name a vehicle, AUV0 or ASV1"
            )
    time, value = numbers
    sender, listener = row.cells["from"].strip(), row.cells["to"].strip()
    if sender == listener:
        raise ValueError(f"{row.where}: to is {listener!r}, as from is; name another vehicle")
    if column == "chance" and not 0.0 <= value <= 1.0:
        remedy = "divide per cent by 100" if 1.0 < value <= 100.0 else "give a share of 1"
        raise ValueError(f"{row.where}: chance is {value:g}, not within 0 and 1; {remedy}")
    return LinkRow(row.where, time, sender, listener, value)


def read_measured(path: str) -> DeliveryCurve | LinkSeries:
    """Return the contents of a channel's file: a series of links, or a delivery curve.

    Raises:
        ValueError: as of :func:`read_series` and :func:`read_curve`.
    """
    names = read_table(path).names
    return read_series(path) if {*LINK[1:], *MEASURED} & {*names} else read_curve(path)
