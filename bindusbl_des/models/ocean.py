"""Currents of ocean models in NetCDF (CMEMS, HYCOM, ROMS): the part of a file that a mission needs.

A file is opened lazily, and only what surrounds the survey in space, depth and time is read.  On
grids of longitude and latitude values stay where they are; the curved grid of ROMS, with its levels
that follow the bottom, is interpolated to one that runs north and east, at fixed depths.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.geometry.geodesy import ned_at_depth
from ..support.arrays import Floats

if TYPE_CHECKING:
    from ..core.vehicles.currents import Field

MISSING = "needs xarray and netCDF4: pip install 'bindusbl-des[ocean]'"

# Eastward and northward velocity: by standard name, else by the names of CMEMS, HYCOM and ROMS
STANDARD = "eastward_sea_water_velocity", "northward_sea_water_velocity"
NAMED = ("uo", "vo"), ("water_u", "water_v"), ("u_eastward", "v_northward"), ("u", "v")
SPEEDS = re.compile(r"(m|meter|metre|meters|metres)( ?/ ?|\*?\*? ?)(s|sec|second)(-1|\^-1|\*\*-1)?")
SINCE = re.compile(r"(second|sec|minute|hour|hr|h|day)s? +since +(.+)", re.IGNORECASE)
SECONDS = {"second": 1.0, "sec": 1.0, "minute": 60.0, "hour": 3600.0, "hr": 3600.0, "h": 3600.0}
CALENDARS = ("standard", "gregorian", "proleptic_gregorian")
# The largest part of a file that is kept: so many numbers of each component (128 MB)
MOST_NUMBERS = 16e6
DEGREE_M = 111_000.0
FASTEST_M_PER_S = 100.0  # what is faster is no water
LEVELS = 12  # depths to which the levels of ROMS are interpolated


class Asked(NamedTuple):
    """What a mission needs of a file: its origin (deg, height in m), how far (m) from there, the
    greatest depth (m), when it starts (ISO 8601; None: with the file) and how long (s) it lasts,
    infinite if that is not known yet.
    """

    origin: Sequence[float]
    reach_m: float
    deepest_m: float
    start: str | None
    lasts_s: float


def read_currents(file: str, asked: Asked) -> Field:
    """Return the current in a file around a mission; NaN on land, but for cells beside water.

    Raises:
        ValueError: with reason and remedy, when the file has not what the mission needs.
    """
    from ..core.vehicles.currents import field

    try:
        import xarray
    except ImportError:
        raise ValueError(MISSING) from None
    try:
        data = xarray.open_dataset(file, decode_times=False, decode_coords=False)
    except (OSError, ValueError, RuntimeError) as error:
        reason = str(error).splitlines()[0][:200]
        raise ValueError(f"{file}: cannot be read as NetCDF ({reason})") from None
    with data:
        east, north = _velocities(data, file)
        when, times = _times(data, east, file, asked)
        read = _on_curves if "s_rho" in east.dims else _on_axes
        depths, xs, ys, values = read(data, (east, north), when, asked, file)
    return field(axes=(times, depths, xs, ys), values=_beside_water(values))


def _velocities(data: Any, file: str) -> tuple[Any, Any]:
    """Return the eastward and the northward velocity; along the axes of its grid for ROMS."""
    by_standard = {str(part.attrs.get("standard_name")): part for part in data.data_vars.values()}
    pairs = [tuple(by_standard[name] for name in STANDARD)] if all(
        name in by_standard for name in STANDARD
    ) else [(data[u], data[v]) for u, v in NAMED if u in data and v in data]  # fmt: skip
    if not pairs:
        held = ", ".join(map(str, data.data_vars)) or "nothing"
        raise ValueError(
            f"{file}: has no velocities uo and vo (CMEMS), water_u and water_v (HYCOM) or u and v "
            f"(ROMS), but {held}"
        )
    for part in pairs[0]:
        units = str(part.attrs.get("units", "no units"))
        if not SPEEDS.fullmatch(units.strip().lower().replace("m.s", "m s")):
            raise ValueError(f"{file}: {part.name} is in {units!r}; convert it to m s-1")
    return pairs[0][0], pairs[0][1]


def _axis(data: Any, part: Any, names: Sequence[str]) -> Any:
    """Return the coordinate of a variable of one of these names, or standard names; or None."""
    for dim in part.dims:
        found = data[dim] if dim in data.variables else None
        known = () if found is None else (dim.lower(), str(found.attrs.get("standard_name")))
        if any(name in known for name in names):
            return found
    return None


def _times(data: Any, part: Any, file: str, asked: Asked) -> tuple[slice, Floats]:
    """Return which instants of a file a mission needs, and these (s) from its start."""
    axis = _axis(data, part, ("time", "ocean_time"))
    if axis is None:
        raise ValueError(f"{file}: {part.name} has no time axis; add one, in hours since a date")
    units = str(axis.attrs.get("units", ""))
    found = SINCE.fullmatch(units.strip())
    calendar = str(axis.attrs.get("calendar", "standard")).lower()
    if found is None or calendar not in CALENDARS:
        raise ValueError(
            f"{file}: {axis.name} is in {units or 'no units'} ({calendar} calendar); give hours "
            "since a date"
        )
    since = _instant(found[2], file)
    instants = np.asarray(axis.values, dtype=float) * SECONDS.get(found[1].lower(), 86400.0)
    if not (instants.size and np.isfinite(instants).all() and (np.diff(instants) > 0).all()):
        raise ValueError(f"{file}: {axis.name} must rise and have no gaps")
    start = instants[0] if asked.start is None else (_instant(asked.start, "") - since)
    times = instants - start
    lasts = asked.lasts_s if np.isfinite(asked.lasts_s) else min(times[-1], 0.0)
    is_steady = times.size == 1 and asked.start is None
    if not is_steady and (times[0] > 0.0 or times[-1] < lasts):
        first, last = (
            datetime.fromtimestamp(since + float(part), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
            for part in (instants[0], instants[-1])
        )
        raise ValueError(
            f"{file}: tells of {first} to {last}, not of all {asked.lasts_s:g} s from "
            f"{asked.start or first}; set environment.current.start, or a shorter duration_s"
        )
    begin = max(int(np.searchsorted(times, 0.0, side="right")) - 1, 0)
    end = min(int(np.searchsorted(times, asked.lasts_s)) + 1, times.size)
    return slice(begin, end), times[begin:end]


def _instant(text: str, file: str) -> float:
    """Return an instant (s, POSIX) of a date, which is UTC unless it says otherwise."""
    try:
        found = datetime.fromisoformat(text.strip().removesuffix("UTC").strip())
    except ValueError:
        own = f"{file}: " if file else ""
        raise ValueError(f"{own}{text!r} is no date such as 2026-06-01T08:00:00Z") from None
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def _near(lat: Floats, lon: Floats, asked: Asked) -> tuple[Floats, Floats]:
    """Return how far (deg) points lie north and east of the origin, the short way round."""
    return lat - asked.origin[0], (lon - asked.origin[1] + 180.0) % 360.0 - 180.0


def _around(offsets: Floats, extent_deg: float, file: str, what: str) -> np.ndarray:
    """Return the indices of an axis (deg off the origin) around +-extent_deg, rising."""
    order = np.argsort(offsets, kind="stable")
    ranked = offsets[order]
    low = int(np.searchsorted(ranked, -extent_deg, side="right")) - 1
    high = int(np.searchsorted(ranked, extent_deg))
    if low < 0 or high >= ranked.size:
        raise ValueError(
            f"{file}: {what} ends within {extent_deg * DEGREE_M / 1e3:.3g} km of the origin, so "
            "that the survey is not all inside; take a larger part of the model"
        )
    return order[low : high + 1]


def _room(file: str, *sizes: int) -> None:
    """Refuse a window that is too large to keep."""
    if float(np.prod(sizes, dtype=float)) > MOST_NUMBERS:
        raise ValueError(
            f"{file}: the mission's part of it has {' x '.join(map(str, sizes))} numbers; shorten "
            "the mission, or make the grid coarser"
        )


def _degrees(asked: Asked) -> tuple[float, float]:
    """Return how far that is in degrees of latitude and longitude."""
    north = asked.reach_m / DEGREE_M
    return north, north / max(np.cos(np.radians(asked.origin[0])), 0.01)


def _levels(depths: Floats, file: str, asked: Asked) -> int:
    """Return how many levels (m, rising) lead down to the mission."""
    if depths[-1] < asked.deepest_m:
        raise ValueError(
            f"{file}: ends at a depth of {depths[-1]:g} m, and AUVs go down to "
            f"{asked.deepest_m:g} m; take more levels"
        )
    return int(np.searchsorted(depths, asked.deepest_m)) + 1


def _wet(values: Any) -> Floats:
    """Return velocities with NaN on land, which files may fill with numbers of their own."""
    found = np.array(values, dtype=float)
    found[np.abs(found) > FASTEST_M_PER_S] = np.nan
    return found


Read = tuple[Floats, Floats, Floats, Floats]


def _on_axes(data: Any, parts: tuple[Any, Any], when: slice, asked: Asked, file: str) -> Read:
    """Return depths, xs, ys (m) and velocities of a grid of longitude and latitude."""
    lat = _axis(data, parts[0], ("latitude", "lat"))
    lon = _axis(data, parts[0], ("longitude", "lon"))
    if lat is None or lon is None:
        raise ValueError(f"{file}: {parts[0].name} has no axes latitude and longitude, nor s_rho")
    lats, lons = (np.asarray(part.values, dtype=float) for part in (lat, lon))
    north, east = _near(lats, lons, asked)
    extent_deg = _degrees(asked)
    rows = _around(north, extent_deg[0], file, "latitude")
    columns = _around(east, extent_deg[1], file, "longitude")
    level = _axis(data, parts[0], ("depth", "lev", "level"))
    window: dict[Any, Any] = {lat.name: rows, lon.name: columns}
    depths, count = np.zeros(1), 1
    if level is not None:
        depths = np.abs(np.asarray(level.values, dtype=float))
        if not (np.diff(depths) > 0).all():
            raise ValueError(f"{file}: {level.name} must go from the surface down")
        count = _levels(depths, file, asked)
        window[level.name] = slice(0, count)
    time = _axis(data, parts[0], ("time", "ocean_time"))
    window[time.name] = when
    _room(file, when.stop - when.start, count, rows.size, columns.size)
    order = [time.name, *([] if level is None else [level.name]), lat.name, lon.name]
    read = [_wet(part.isel(window).transpose(*order).values) for part in parts]
    shape = when.stop - when.start, count, rows.size, columns.size
    values = np.stack([read[1].reshape(shape), read[0].reshape(shape)], axis=-1)
    at, on = asked.origin[0], asked.origin[1]
    xs = ned_at_depth(at + north[rows], np.full(rows.size, on), np.zeros(rows.size), asked.origin)
    ys = ned_at_depth(
        np.full(columns.size, at), on + east[columns], np.zeros(columns.size), asked.origin
    )
    return depths[:count], xs[:, 0], ys[:, 1], values


def _on_curves(data: Any, parts: tuple[Any, Any], when: slice, asked: Asked, file: str) -> Read:
    """Return depths, xs, ys (m) and velocities of a ROMS grid.

    Source: https://www.myroms.org/wiki/Vertical_S-coordinate, its two transforms; velocities lie on
    the faces of cells, and `angle` turns their axes (Arakawa C grid).
    """
    lacks = [
        part for part in ("lon_rho", "lat_rho", "h", "s_rho", "Cs_r", "hc") if part not in data
    ]
    if lacks:
        raise ValueError(f"{file}: lacks {', '.join(lacks)}, which place a ROMS grid")
    lat, lon = (np.asarray(data[name].values, dtype=float) for name in ("lat_rho", "lon_rho"))
    north, east = _near(lat, lon, asked)
    extent_deg = _degrees(asked)
    inside = (np.abs(north) <= extent_deg[0]) & (np.abs(east) <= extent_deg[1])
    if not inside.any():
        steps = np.hypot(north, east * np.cos(np.radians(asked.origin[0])))
        inside.ravel()[steps.argmin()] = True
    rows, columns = np.nonzero(inside)
    j = slice(max(rows.min() - 2, 1), min(rows.max() + 3, lat.shape[0] - 1))
    i = slice(max(columns.min() - 2, 1), min(columns.max() + 3, lat.shape[1] - 1))
    along, down = i.stop - i.start, j.stop - j.start
    depth_count, count = data.sizes["s_rho"], when.stop - when.start
    _room(file, count, depth_count, down, along)
    time = {str(parts[0].dims[0]): when}

    def read(part: Any, eta: slice, xi: slice) -> Floats:
        dims = part.dims
        return _wet(part.isel({**time, dims[-2]: eta, dims[-1]: xi}).values)

    staggered = parts[0].dims[-1] != parts[1].dims[-1]
    if staggered:
        u = _mean(read(parts[0], j, slice(i.start - 1, i.stop)), -1)
        v = _mean(read(parts[1], slice(j.start - 1, j.stop), i), -2)
        angle = np.asarray(data["angle"].values, dtype=float)[j, i] if "angle" in data else 0.0
        flow_e, flow_n = (
            u * np.cos(angle) - v * np.sin(angle),
            u * np.sin(angle) + v * np.cos(angle),
        )
    else:
        flow_e, flow_n = read(parts[0], j, i), read(parts[1], j, i)
    depth = _roms_depths(data, time, j, i)
    top = min(asked.deepest_m, float(np.nanmax(depth))) or 1.0
    depths = np.linspace(0.0, top, LEVELS)
    places = ned_at_depth(
        asked.origin[0] + north[j, i].ravel(), asked.origin[1] + east[j, i].ravel(),
        np.zeros(down * along), asked.origin,
    )[:, :2]  # fmt: skip
    at_depths = _beside_water(_to_depths(np.stack([flow_n, flow_e], axis=-1), depth, depths))
    from scipy.interpolate import LinearNDInterpolator

    extent = asked.reach_m
    span = np.hypot(*np.ptp(places, axis=0)) / max(np.hypot(down - 1, along - 1), 1.0)
    axis = np.linspace(-extent, extent, int(np.clip(np.ceil(2.0 * extent / span), 1, 400)) + 1)
    _room(file, count, LEVELS, axis.size, axis.size)
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    flat = np.moveaxis(at_depths.reshape(count, LEVELS, down * along, 2), 2, 0)
    found = LinearNDInterpolator(places, flat.reshape(down * along, -1))(grid)
    values = np.moveaxis(found.reshape(axis.size, axis.size, count, LEVELS, 2), (2, 3), (0, 1))
    return depths, axis, axis, values


def _mean(pairs: Floats, axis: int) -> Floats:
    """Return the means of neighbours along an axis; of a pair with one dry face the other."""
    count = pairs.shape[axis]
    two = np.stack([pairs.take(range(count - 1), axis), pairs.take(range(1, count), axis)])
    wet = np.isfinite(two)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(wet, two, 0.0).sum(axis=0) / wet.sum(axis=0))


def _roms_depths(data: Any, time: dict[str, slice], j: slice, i: slice) -> Floats:
    """Return the depths (m) below the surface of the levels, (t, level, eta, xi), surface last."""
    s, stretched, critical = (
        np.asarray(data[name].values, dtype=float) for name in ("s_rho", "Cs_r", "hc")
    )
    floor = np.asarray(data["h"].values, dtype=float)[..., j, i].reshape(-1, *_size(j, i))[0]
    instants = next(iter(time.values()))
    surface = np.zeros((instants.stop - instants.start, *floor.shape))
    if "zeta" in data:
        part = data["zeta"]
        read = part.isel({**time, part.dims[-2]: j, part.dims[-1]: i}).values
        surface = np.nan_to_num(np.asarray(read, dtype=float))
    s, stretched = s[:, None, None], stretched[:, None, None]
    surface = surface[:, None]
    if int(data["Vtransform"].values if "Vtransform" in data else 2) == 1:
        level = critical * (s - stretched) + floor * stretched
        return np.asarray(surface - (level + surface * (1.0 + level / floor)))
    share = (critical * s + floor * stretched) / (critical + floor)
    return np.asarray(-(surface + floor) * share)


def _size(j: slice, i: slice) -> tuple[int, int]:
    return j.stop - j.start, i.stop - i.start


def _to_depths(values: Floats, depth: Floats, depths: Floats) -> Floats:
    """Return values (t, level, n, m, 2) at fixed depths (m); constant above the first level, and
    NaN below the last.
    """
    count, levels, down, along, _ = values.shape
    found = np.full((count, depths.size, down, along, 2), np.nan)
    for t, n, m in np.ndindex(count, down, along):
        rising = depth[t, ::-1, n, m]
        if np.isfinite(values[t, :, n, m]).all():
            reached = depths <= rising[-1] + (rising[-1] - rising[-2] if levels > 1 else 1e9) / 2
            for axis in range(2):
                line = np.interp(depths, rising, values[t, ::-1, n, m, axis])
                found[t, :, n, m, axis] = np.where(reached, line, np.nan)
    return found


def _beside_water(values: Floats) -> Floats:
    """Return values (t, k, n, m, 2) with dry cells beside water filled: from the level above, then
    by the mean of the wet cells around them.
    """
    filled = values.copy()
    above = np.isnan(values[:, 1:]) & np.isfinite(values[:, :-1])
    filled[:, 1:][above] = values[:, :-1][above]
    padded = np.pad(filled, ((0, 0), (0, 0), (1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    n, m = values.shape[2:4]
    total, wet = np.zeros(values.shape), np.zeros(values.shape)
    for down in range(3):
        for along in range(3):
            part = padded[:, :, down : down + n, along : along + m]
            total += np.nan_to_num(part)
            wet += np.isfinite(part)
    dry = np.isnan(filled) & (wet > 0)
    filled[dry] = total[dry] / wet[dry]
    return filled
