"""The log that a name stands for: a PyFG file, a run that ships with gtsam, CSV or MCAP."""

from pathlib import Path

import numpy as np

from ..charts.shapes import BadChart, position
from ..core.arrays import Flags, Floats
from ..geometry.geodesy import ned_at_depth
from .formats import NOMINAL_SPEED, LogTable, csv_tables, mcap_tables, read_pyfg, shipped
from .log import BadLog, Log, LoggedFixes, Ranges, Receptions, SurveyedBeacons

SHIPPED = ("goats_15", "goats_16")
GTSAM = (
    "the recorded runs goats_15 and goats_16 ship with the package gtsam, which is not installed "
    "here; install it with: python -m pip install 'bindusbl-des[replay]'"
)
# What our export calls the columns of dead reckoning, beside what odometry of one's own has.
RECKONED = {"tracks": ("imu_x_m", "imu_y_m"), "odometry": ("x_m", "y_m")}


def read_log(name: str, vehicle: str | None = None, speed: float = NOMINAL_SPEED) -> Log:
    """Return a log: of a file or folder, or a run that ships with gtsam, by its bare name.

    `vehicle` chooses one of those in the tables; `speed` (m/s) as in :func:`read_pyfg`.

    Raises:
        BadLog: naming file, place and remedy.
    """
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
    tables = _in_metres(tables)
    kind = next((name for name in ("odometry", "tracks") if len(tables.get(name, ()))), None)
    if kind is None:
        raise BadLog(
            f"{path}: has no odometry; a table `odometry` needs time_s, yaw_rad, and x_m, y_m or "
            "lat_deg, lon_deg; `tracks` of an export time_s, vehicle, imu_x_m, imu_y_m, yaw_rad"
        )
    whose = _vehicle(path, tables[kind], vehicle)
    rows = tables[kind].where("vehicle", whose)
    odometry = rows.numbers("time_s", *RECKONED[kind], "yaw_rad")
    times = odometry[:, 0]
    if len(times) < 2:
        raise BadLog(f"{rows.source}: has {len(times)} rows of odometry; a log needs two or more")
    stuck = np.flatnonzero(np.diff(times) <= 0.0)
    if len(stuck):
        place = rows.rows[int(stuck[0]) + 1][0]
        raise BadLog(f"{place}: time_s must rise from row to row of a vehicle")
    empty = LogTable(str(path))
    beacons = _beacons(tables.get("beacons", empty))
    ranges = _ranges(_of(tables.get("ranges", empty), whose), beacons)
    fixes = _fixes(_of(tables.get("fixes", empty), whose).where("outcome", "delivered"))
    # Odometry of even steps ends up to a step before its mission does; later is another clock.
    ends = float(times[-1]), float(2.0 * times[-1] - times[-2])
    in_time, known = _until(ranges.times, *ends), _until(fixes.times, *ends)
    ranges = Ranges(ranges.times[in_time], ranges.beacons[in_time], ranges.metres[in_time])
    fixes = LoggedFixes(fixes.times[known], fixes.places[known], fixes.covariances[known])
    first = float(times[0])
    log = Log(
        f"{path.stem}_{whose}" if whose else path.stem,
        times - first,
        odometry[:, 1:3],
        np.unwrap(odometry[:, 3]),
        rows.numbers("z_m")[:, 0] if rows.has("z_m") else np.zeros(len(times)),
        beacons,
        ranges._replace(times=ranges.times - first),
        fixes._replace(times=fixes.times - first),
        receptions=_receptions(_of(tables.get("receptions", empty), whose)),
    )
    _check_times(path, log)
    return log


def _in_metres(tables: dict[str, LogTable]) -> dict[str, LogTable]:
    """Return tables in metres north and east of where an odometry in degrees begins.

    Raises:
        BadLog: naming a place that is in degrees where the odometry is in metres, or the reverse.
    """
    odometry = tables.get("odometry", LogTable(""))
    placed = {name: tables[name] for name in ("odometry", "beacons", "fixes") if name in tables}
    if "fixes" in placed:  # those that nobody received need no place
        placed["fixes"] = placed["fixes"].where("outcome", "delivered")
    origin = _degrees(odometry)[0] if len(odometry) and odometry.has("lat_deg") else None
    for table in placed.values():
        if not len(table) or table.has("lat_deg") == (origin is not None):
            continue
        units = ("lat_deg, lon_deg", "metres") if origin is None else ("metres", "lat_deg, lon_deg")
        raise BadLog(
            f"{table.rows[0][0]}: is in {units[0]}, but the odometry is in {units[1]}; where it "
            "began is not known, so write all tables in one of them"
        )
    if origin is None:
        return tables
    return tables | {name: _north_east(table, origin) for name, table in placed.items()}


def _north_east(table: LogTable, origin: tuple[float, float]) -> LogTable:
    lat, lon = np.array(_degrees(table)).reshape(-1, 2).T
    places = ned_at_depth(lat, lon, np.zeros(len(lat)), origin).tolist()
    rows = [
        (place, {**row, "x_m": x, "y_m": y})
        for (place, row), (x, y, _) in zip(table.rows, places, strict=True)
    ]
    return LogTable(table.source, rows)


def _degrees(table: LogTable) -> list[tuple[float, float]]:
    """Return latitude and longitude (deg) of each row."""
    places = table.numbers("lat_deg", "lon_deg").tolist()
    try:
        return [
            position(lat, lon, place, "lat_deg, lon_deg")
            for (lat, lon), (place, _) in zip(places, table.rows, strict=True)
        ]
    except BadChart as error:
        raise BadLog(str(error)) from None


def _until(instants: Floats, end: float, after: float) -> Flags:
    """Tell which instants (n,), s, do not lie between two others (s)."""
    return np.asarray((instants <= end) | (instants >= after))


def _vehicle(path: Path, odometry: LogTable, vehicle: str | None) -> str:
    """Return whose log is meant; a table of odometry without names is of one vehicle."""
    if not odometry.has("vehicle"):
        return vehicle or ""
    known = [
        name for name in dict.fromkeys(odometry.words("vehicle")) if not name.startswith("ASV")
    ]
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
    names = table.words("beacon")
    for n, (place, _) in enumerate(table.rows):
        if names[n] in names[:n]:
            raise BadLog(f"{place}: the beacon {names[n]} is listed twice; leave one of them out")
    places = table.numbers("x_m", "y_m")
    depths = table.numbers("z_m") if table.has("z_m") else np.zeros((len(names), 1))
    return SurveyedBeacons(tuple(names), np.hstack((places, depths)))


def _ranges(table: LogTable, beacons: SurveyedBeacons) -> Ranges:
    names = table.words("beacon")
    for (place, _), name in zip(table.rows, names, strict=True):
        if name not in beacons.names:
            known = ", ".join(beacons.names) or "there are none"
            raise BadLog(f"{place}: the beacon {name} is not in the table beacons ({known})")
    numbers = table.numbers("time_s", "range_m")
    for (place, _), metres in zip(table.rows, numbers[:, 1], strict=True):
        if metres < 0.0:
            raise BadLog(f"{place}: range_m is {metres:g}; a range is 0 m or more")
    whom = np.array([beacons.names.index(name) for name in names], dtype=np.int64)
    order = np.argsort(numbers[:, 0], kind="stable")
    return Ranges(numbers[order, 0], whom[order], numbers[order, 1])


def _fixes(table: LogTable) -> LoggedFixes:
    """Return fixes in the order of the instants at which they hold, whenever they were told."""
    instant = next(
        (column for column in ("valid_at_s", "pinged_at_s") if table.has(column)), "time_s"
    )
    numbers = table.numbers(instant, "x_m", "y_m", "sd_x_m", "sd_y_m")
    for (place, _), row in zip(table.rows, numbers, strict=True):
        if row[3] <= 0.0 or row[4] <= 0.0:
            raise BadLog(f"{place}: sd_x_m and sd_y_m must be above 0 m")
    crossed: Floats = np.zeros((len(table), 1))
    if table.has("cov_xy_m2"):
        crossed = table.numbers("cov_xy_m2")
        for (place, _), row, both in zip(table.rows, numbers, crossed[:, 0], strict=True):
            if abs(both) > row[3] * row[4]:
                raise BadLog(f"{place}: cov_xy_m2 is {both:g}, above sd_x_m times sd_y_m")
    first = np.unique(numbers, axis=0, return_index=True)[1]
    if len(again := np.setdiff1d(np.arange(len(numbers)), first)):
        place = table.rows[int(again[0])][0]
        raise BadLog(
            f"{place}: the same fix is listed before; leave one out, it is one measurement"
        )
    order = np.argsort(numbers[:, 0], kind="stable")
    covariances = np.hstack((numbers[:, 3:] ** 2, crossed))
    return LoggedFixes(numbers[order, 0], numbers[order, 1:3], covariances[order])


# What becomes of a signal that nothing overlapped, by the column `outcome`; of others nothing is
# learnt.  What a column `valid` says.
OUTCOMES = {"heard": False, "lost": True}
VALID = {"1": False, "true": False, "0": True, "false": True}


def _receptions(table: LogTable) -> Receptions | None:
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
        rows = [
            line
            for line in table.rows
            if str(line[1].get(named)) in OUTCOMES and line[1].get(instant)
        ]
        known = LogTable(table.source, rows)
    is_lost = [_is_lost(place, named, row.get(named)) for place, row in known.rows]
    away = next((column for column in ("slant_range_m", "range_m") if known.has(column)), None)
    others = [str(row.get("asv", row.get("beacon", ""))) for _, row in known.rows]
    names = sorted(set(others))
    times = known.numbers(instant)[:, 0]
    order = np.argsort(times, kind="stable")
    ranges = np.full(len(known), np.nan) if away is None else known.numbers(away)[:, 0]
    pairs = np.array([names.index(other) for other in others], dtype=np.int64)
    return Receptions(times[order], pairs[order], np.array(is_lost, bool)[order], ranges[order])


def _is_lost(place: str, column: str, said: object) -> bool:
    known = OUTCOMES if column == "outcome" else VALID
    if str(said).strip().lower() not in known:
        raise BadLog(
            f"{place}: {column} is {said!r}; receptions need a column outcome (heard or lost), or "
            "valid (1 or 0, true or false)"
        )
    return known[str(said).strip().lower()]


def _check_times(path: Path, log: Log) -> None:
    """Refuse a log that tells of instants of which its odometry knows nothing."""
    for what, times in (("ranges", log.ranges.times), ("fixes", log.fixes.times)):
        outside = np.count_nonzero((times < 0.0) | (times > log.times[-1]))
        if outside:
            raise BadLog(
                f"{path}: {outside} of {len(times)} {what} lie outside the time of the odometry, "
                f"{log.times[-1]:g} s; are both by the same clock?"
            )
    if not len(log.ranges.times) and not len(log.fixes.times):
        raise BadLog(f"{path}: has neither ranges nor fixes, so nothing corrects its odometry")
