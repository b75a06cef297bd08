"""The log that a name stands for: a PyFG file, a run that ships with gtsam, CSV or MCAP."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from math import nan, pi
from pathlib import Path

import numpy as np

from ...core.geometry.geodesy import ned_at_depth
from ...models.charts.shapes import BadChart, Degrees, position
from ...support.arrays import Floats
from ...support.tables import because, ordered
from .formats import (
    NOMINAL_SPEED,
    LogTable,
    Row,
    csv_tables,
    mcap_tables,
    name_in,
    numbers_in,
    read_pyfg,
    shipped,
)
from .log import BadLog, Log, LoggedFixes, Ranges, Receptions, SurveyedBeacons
from .repeats import Sighted, measured_once

SHIPPED = ("goats_15", "goats_16")
GTSAM = (
    "the recorded runs goats_15 and goats_16 ship with the package gtsam, which is not installed "
    "here; install it with: python -m pip install 'bindusbl-des[replay]'"
)
# Headings beyond (rad) are degrees, or go on turn by turn.
WHOLE_TURN = 2.0 * pi + 0.01
# A degree of latitude (m), about.
DEGREE_M = 111e3

# When odometry begins and ends (s), and when it would have a further row.
Span = tuple[float, float, float]

# What our export calls the columns of dead reckoning, beside what odometry of one's own has.
RECKONED = {"tracks": ("imu_x_m", "imu_y_m"), "odometry": ("x_m", "y_m")}


def read_log(name: str, vehicle: str | None = None, speed: float = NOMINAL_SPEED) -> Log:
    """Return a log: of a file or folder, or a run that ships with gtsam, by its bare name.

    `vehicle` chooses one of those in the tables; `speed` (m/s) as in :func:`read_pyfg`.  Rows that
    cannot be, and measurements that are there more than once, do not count; each kind of them is a
    UserWarning, and a line of `left_out` of the log.

    Raises:
        BadLog: naming file, place and remedy.
    """
    log = _log(name, vehicle, speed)
    for told in log.left_out:
        warnings.warn(told, stacklevel=2)
    return log


def _log(name: str, vehicle: str | None, speed: float) -> Log:
    path = Path(name)
    if path.is_dir():
        tables = csv_tables(path)
        return _log_of(path, tables, vehicle)
    if path.suffix == ".mcap":
        return _log_of(path, mcap_tables(path), vehicle)
    if not path.suffix and not path.exists():
        found = shipped(name)
        if found is None and name in SHIPPED:
            raise BadLog(f"{name}: {GTSAM}")
        path = found or path
    if not path.exists():
        raise BadLog(
            f"{name}: there is no such log; name a .pyfg or .mcap file, a folder of CSV files, or "
            + " or ".join(SHIPPED)
        )
    if path.suffix != ".pyfg":
        raise BadLog(f"{name}: a log is a .pyfg or .mcap file, or a folder of CSV files")
    if vehicle is not None:
        raise BadLog(f"{name}: a .pyfg file is of one vehicle; leave out --vehicle")
    return read_pyfg(path, speed)


def _log_of(path: Path, tables: dict[str, LogTable], vehicle: str | None) -> Log:
    """Return the log of one vehicle in tables."""
    tables, origin_deg = _in_metres(tables)
    kind = next((name for name in ("odometry", "tracks") if len(tables.get(name, ()))), None)
    if kind is None:
        raise BadLog(
            f"{path}: has no odometry; a table `odometry` needs time_s, yaw_rad, and x_m, y_m or "
            "lat_deg, lon_deg; `tracks` of an export time_s, vehicle, imu_x_m, imu_y_m, yaw_rad"
        )
    whose = _vehicle(path, tables[kind], vehicle)
    rows = tables[kind].where("vehicle", whose)
    times, places, yaws, depths = _odometry(rows, RECKONED[kind])
    empty = LogTable(str(path))
    beacons = _beacons(tables.get("beacons", empty))
    # Odometry of even steps ends up to a step before its mission does; later is another clock.
    span = float(times[0]), float(times[-1]), float(2.0 * times[-1] - times[-2])
    first = span[0]
    heard = tables.get("ranges", empty), tables.get("fixes", empty), tables.get("receptions", empty)
    log = Log(
        f"{path.stem}_{whose}" if whose else path.stem,
        times - first,
        places,
        yaws,
        depths,
        beacons,
        Ranges(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0)),
        LoggedFixes(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3))),
    )
    ranges = _ranges(_of(heard[0], whose), beacons, span, log)
    fixes = _fixes(_of(heard[1], whose).where("outcome", "delivered"), span, log)
    receptions = _receptions(_of(heard[2], whose), span, log)
    told = list(dict.fromkeys(text for table in tables.values() for text in table.left_out))
    if not len(ranges.times) and not len(fixes.times):
        nothing = f"{path}: has neither ranges nor fixes, so nothing corrects its odometry"
        raise BadLog(nothing + because(told))
    return replace(
        log, ranges=ranges, fixes=fixes, receptions=receptions, left_out=tuple(told),
        origin_deg=origin_deg,
    )  # fmt: skip


def _odometry(table: LogTable, columns: tuple[str, str]) -> tuple[Floats, Floats, Floats, Floats]:
    """Return instants (n,), s, that rise, places (n, 2), m, headings (n,), rad, unwrapped, and
    depths (n,), m.
    """
    names = ("time_s", *columns, "yaw_rad", *("z_m",) * table.has("z_m"))
    read = table.sifted(lambda place, row: (place, numbers_in(place, row, *names)))
    if len(read) < 2:
        few = f"{table.source}: has {len(read)} rows of odometry; a log needs two or more"
        raise BadLog(few + because(table.left_out))
    where, numbers = [place for place, _ in read], np.array([found for _, found in read])
    kept, told = ordered(where, numbers[:, 0].tolist(), "time_s", "s", fault=BadLog)
    if len(kept) < 2:
        raise BadLog(f"{table.source}: all rows of odometry are of one instant; a log needs two")
    table.left_out += told
    numbers = numbers[kept]
    _check_headings([where[n] for n in kept], numbers)
    depths = numbers[:, 4] if table.has("z_m") else np.zeros(len(numbers))
    return numbers[:, 0], numbers[:, 1:3], np.unwrap(numbers[:, 3]), depths


def _check_headings(where: Sequence[str], odometry: Floats) -> None:
    """Refuse headings beyond a turn, unless they go the way of the odometry (n, 4) as radians that
    go on turn by turn, and not as degrees.
    """
    yaws = odometry[:, 3]
    beyond = np.flatnonzero(np.abs(yaws) > WHOLE_TURN)
    if not len(beyond):
        return
    moved = np.diff(odometry[:, 1:3], axis=0)
    ways, courses = np.hypot(*moved.T), np.arctan2(moved[:, 1], moved[:, 0])
    as_rad, as_deg = (
        float(ways @ np.cos(each[:-1] - courses)) for each in (yaws, np.radians(yaws))
    )
    if as_rad <= as_deg or as_rad <= 0.0:
        first = int(beyond[0])
        raise BadLog(
            f"{where[first]}: yaw_rad is {yaws[first]:g}, beyond 2 pi; are these degrees? Multiply "
            "them by pi / 180"
        )


def _in_metres(tables: dict[str, LogTable]) -> tuple[dict[str, LogTable], Degrees | None]:
    """Return tables in metres north and east of where an odometry in degrees begins, and that
    place; None where they are in metres.

    Raises:
        BadLog: naming a place that is in degrees where the odometry is in metres, or the reverse.
    """
    odometry = tables.get("odometry", LogTable(""))
    placed = {name: tables[name] for name in ("odometry", "beacons", "fixes") if name in tables}
    if "fixes" in placed:  # those that nobody received need no place
        placed["fixes"] = placed["fixes"].where("outcome", "delivered")
    in_degrees = odometry.has("lat_deg")
    for table in placed.values():
        if not len(table) or table.has("lat_deg") == in_degrees:
            continue
        units = ("metres", "lat_deg, lon_deg") if in_degrees else ("lat_deg, lon_deg", "metres")
        raise BadLog(
            f"{table.rows[0][0]}: is in {units[0]}, but the odometry is in {units[1]}; where it "
            "began is not known, so write all tables in one of them"
        )
    if not in_degrees:
        return tables, None
    read = {name: table.sifted(_degrees) for name, table in placed.items()}
    origin = read["odometry"][0][2] if read["odometry"] else (0.0, 0.0)
    there = {name: _north_east(placed[name], read[name], origin) for name in placed}
    return tables | there, origin


Position = tuple[str, Row, Degrees]


def _north_east(table: LogTable, read: list[Position], origin: Degrees) -> LogTable:
    lat, lon = np.array([position for _, _, position in read]).reshape(-1, 2).T
    places = ned_at_depth(lat, lon, np.zeros(len(lat)), origin).tolist()
    return table.of(
        (place, {**row, "x_m": x, "y_m": y})
        for (place, row, _), (x, y, _) in zip(read, places, strict=True)
    )


def _degrees(place: str, row: Row) -> Position:
    """Return a row with its place and its latitude and longitude (deg)."""
    lat, lon = numbers_in(place, row, "lat_deg", "lon_deg")
    if lat == lon == 0.0:
        raise BadLog(f"{place}: is at 0, 0, as receivers say that have no fix")
    try:
        return place, row, position(lat, lon, place, "lat_deg, lon_deg")
    except BadChart as error:
        raise BadLog(str(error)) from None


def _vehicle(path: Path, odometry: LogTable, vehicle: str | None) -> str:
    """Return whose log is meant; a table of odometry without names is of one vehicle."""
    if not odometry.has("vehicle"):
        return vehicle or ""
    read = odometry.sifted(lambda place, row: name_in(place, row, "vehicle").strip())
    known = [name for name in dict.fromkeys(read) if not name.startswith("ASV")]
    if vehicle is None and len(known) == 1:
        return known[0]
    if vehicle not in known:
        raise BadLog(f"{path}: holds {', '.join(known)}; name one with --vehicle")
    return vehicle


def _of(table: LogTable, whose: str) -> LogTable:
    """Return a vehicle's rows of a table, all where none is named.

    Raises:
        BadLog: when these are of several.
    """
    for column in ("vehicle", "auv"):
        table = table.where(column, whose)
        known = sorted({str(row[column]) for _, row in table.rows if row.get(column)})
        if len(known) > 1:
            raise BadLog(f"{table.source}: is of {', '.join(known)}; name one with --vehicle")
    return table


def _beacons(table: LogTable) -> SurveyedBeacons:
    columns = ("x_m", "y_m", *("z_m",) * table.has("z_m"))

    def surveyed(place: str, row: Row) -> tuple[str, str, list[float]]:
        return place, name_in(place, row, "beacon"), numbers_in(place, row, *columns)

    read = table.sifted(surveyed)
    places: dict[str, list[float]] = {}
    for place, name, found in read:
        if places.setdefault(name, found) != found:
            raise BadLog(f"{place}: the beacon {name} is listed twice; leave one of them out")
    rows = [[*found, 0.0][:3] for found in places.values()]
    return SurveyedBeacons(tuple(places), np.array(rows).reshape(-1, 3))


def _in_time(place: str, column: str, time: float, span: Span) -> float:
    """Return an instant (s) that the odometry knows of, or which is but a step behind its end."""
    first, last, after = span
    if not first <= time < after:
        raise BadLog(
            f"{place}: {column} is {time:.15g}, outside the time of the odometry, {first:.15g} to "
            f"{last:.15g} s; are both by the same clock?"
        )
    return time


def _once(
    table: LogTable,
    read: list[Sighted],
    what: str,
    span: Span,
    log: Log,
    unit_m: float = 1.0,
) -> list[Sighted]:
    """Return what was measured, once each, in the time of the odometry."""
    in_time = [sight for sight in read if what == "receptions" or sight.time <= span[1]]
    found, told = measured_once(in_time, log, span[0], what, unit_m)
    table.left_out += told
    return found


def _ranges(table: LogTable, beacons: SurveyedBeacons, span: Span, log: Log) -> Ranges:
    numbers = {name: number for number, name in enumerate(beacons.names)}

    def measured(place: str, row: Row) -> Sighted:
        name = name_in(place, row, "beacon")
        if name not in numbers:
            known = ", ".join(beacons.names) or "there are none"
            raise BadLog(f"{place}: the beacon {name} is not in the table beacons ({known})")
        time, metres = numbers_in(place, row, "time_s", "range_m")
        if metres < 0.0:
            raise BadLog(f"{place}: range_m is {metres:g}; a range is 0 m or more")
        return Sighted(place, _in_time(place, "time_s", time, span), name, (metres,))

    read = _once(table, table.sifted(measured), "ranges", span, log)
    times = np.array([sight.time for sight in read])
    whom = np.array([numbers[sight.source] for sight in read], dtype=np.int64)
    metres = np.array([sight.measured[0] for sight in read])
    return Ranges(times - span[0], whom, metres)


def _fixes(table: LogTable, span: Span, log: Log) -> LoggedFixes:
    """Return fixes in the order of the instants at which they hold, whenever they were told."""
    instant = next(
        (column for column in ("valid_at_s", "pinged_at_s") if table.has(column)), "time_s"
    )
    crossed = ("cov_xy_m2",) * table.has("cov_xy_m2")
    written = ("lat_deg", "lon_deg") if table.has("lat_deg") else ("x_m", "y_m")

    def measured(place: str, row: Row) -> Sighted:
        columns = (instant, "x_m", "y_m", "sd_x_m", "sd_y_m", *crossed)
        time, x, y, sd_x, sd_y, both = [*numbers_in(place, row, *columns), 0.0][:6]
        if sd_x <= 0.0 or sd_y <= 0.0:
            raise BadLog(f"{place}: sd_x_m and sd_y_m must be above 0 m")
        if abs(both) > sd_x * sd_y:
            raise BadLog(f"{place}: cov_xy_m2 is {both:g}, above sd_x_m times sd_y_m")
        time = _in_time(place, instant, time, span)
        first, second = numbers_in(place, row, *written)
        source = str(row.get("asv", ""))
        return Sighted(place, time, source, (first, second), (x, y, sd_x**2, sd_y**2, both))

    unit_m = DEGREE_M if table.has("lat_deg") else 1.0
    read = _once(table, table.sifted(measured), "fixes", span, log, unit_m)
    numbers = np.array([(sight.time, *sight.rest) for sight in read]).reshape(-1, 6)
    return LoggedFixes(numbers[:, 0] - span[0], numbers[:, 1:3], numbers[:, 3:])


# What becomes of a signal that nothing overlapped, by the column `outcome`; of others nothing is
# learnt.  What a column `valid` says.
OUTCOMES = {"heard": False, "lost": True}
VALID = {"1": False, "true": False, "0": True, "false": True}


def _receptions(table: LogTable, span: Span, log: Log) -> Receptions | None:
    """Return which signals were heard and which lost, each by the pair of who sent and who heard.

    Raises:
        BadLog: naming the place that says neither.
    """
    if not len(table):
        return None
    named = "outcome" if table.has("outcome") else "valid"
    instant = "arrived_at_s" if table.has("arrived_at_s") else "time_s"
    known = table
    if named == "outcome":  # an answer that was never sent, its call being lost, has no instant
        known = table.of(
            line
            for line in table.rows
            if str(line[1].get(named)) in OUTCOMES and line[1].get(instant)
        )
    away = next((name for name in ("slant_range_m", "range_m") if table.has(name)), "")

    def heard(place: str, row: Row) -> Sighted:
        is_lost = _is_lost(place, named, row.get(named))
        (time,) = numbers_in(place, row, instant)
        is_known = row.get(away) not in (None, "")
        metres = numbers_in(place, row, away)[0] if is_known else nan
        other = str(row.get("asv", row.get("beacon", "")))
        return Sighted(place, time, other, (metres,), (is_lost,))

    read = _once(table, known.sifted(heard), "receptions", span, log)
    names = sorted({sight.source for sight in read})
    pairs = np.array([names.index(sight.source) for sight in read], dtype=np.int64)
    ranges = np.array([sight.measured[0] for sight in read])
    times = np.array([sight.time for sight in read])
    return Receptions(times, pairs, np.array([sight.rest[0] for sight in read], bool), ranges)


def _is_lost(place: str, column: str, said: object) -> bool:
    known = OUTCOMES if column == "outcome" else VALID
    if str(said).strip().lower() not in known:
        raise BadLog(
            f"{place}: {column} is {said!r}; receptions need a column outcome (heard or lost), or "
            "valid (1 or 0, true or false)"
        )
    return known[str(said).strip().lower()]
