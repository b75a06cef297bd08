"""Charts of the bottom: the part of a grid of depths, or of soundings, that a survey needs.

Of a file only what surrounds the survey is read.  Grids in degrees or in a projection are turned
into one that runs north and east, at half their spacing, by bilinear interpolation; a chart in
metres of the survey keeps its nodes.  GDAL (rasterio) reads GeoTIFF and other grids, xarray NetCDF.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...support.arrays import Floats
from .positions import grid_of

KEY = "environment.bathymetry"
GRIDS_NEED = "needs rasterio and pyproj: pip install 'bindusbl-des[gis]'"
NETCDF_NEEDS = "needs xarray and netCDF4: pip install 'bindusbl-des[ocean]'"
SCATTER_NEEDS = "has no regular grid, which needs scipy: pip install 'bindusbl-des[analysis]'"

# How far around the survey a chart is read, since AUVs turn there: metres, and turning radii
AROUND_M, RADII = 20.0, 3.0
# The largest grid that is made, and the longest text that is read
MOST_NODES, MOST_POINTS = 4_000_000, 20_000_000
# Names of variables of depth and height, and of columns
DEPTHS = ("depth", "deptho", "bathymetry", "depth_m", "h", "bathy")
HEIGHTS = ("elevation", "z", "height", "height_m", "elevation_m", "altitude", "topo", "band1")
EASTS = ("lon", "longitude", "lon_deg", "x", "east", "easting", "east_m", "y_m")
NORTHS = ("lat", "latitude", "lat_deg", "y", "north", "northing", "north_m", "x_m")
TEXTS, NETCDFS = (".xyz", ".csv", ".txt"), (".nc", ".nc4", ".cdf", ".grd")
DEGREES, LOCAL = "EPSG:4326", "local"
# Higher than any mountain, deeper than any trench: not what such a number means
HIGHEST_M = 12_000.0
# Metres for each degree of latitude, roughly
DEGREE_M = 111_000.0


# x (n,) and y (m,), rising, and depths (n, m), m
Nodes = tuple[Floats, Floats, Floats]


# Returns north and east, (n, 2 or more), m, of latitudes and longitudes (deg) at depths (m), about
# an origin
ToMetres = Callable[[Floats, Floats, Floats, Sequence[float]], Floats]


class Around(NamedTuple):
    """The box (m) in which a mission needs the bottom: least and greatest x, then y; where its
    origin is (deg, height in m; None: not on Earth), the height of its water (m), and what turns
    degrees into metres.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    origin: tuple[float, float, float] | None
    surface_m: float
    to_metres: ToMetres

    @classmethod
    def of(
        cls,
        places: Sequence[tuple[float, float]],
        radius: float,
        origin: tuple[float, float, float] | None,
        surface_m: float,
        to_metres: ToMetres,
    ) -> Around:
        """Return the box around positions [x, y] (m), about which AUVs turn with a radius (m)."""
        x, y = ([place[axis] for place in places] for axis in (0, 1))
        more = AROUND_M + RADII * radius
        (south, north), (west, east) = ((min(axis) - more, max(axis) + more) for axis in (x, y))
        return cls((south, north), (west, east), origin, surface_m, to_metres)


class Chart(NamedTuple):
    """A chart of depths or heights as a file has it.

    Its grid is that of `crs`; `found_at` turns places east and north in that, (n,) each, into
    fractional rows and columns of `shape`; `read` returns a window, NaN where nothing is known.
    Numbers are heights if `is_up`, None: unknown.  `nodes` are x and y of a grid in metres of the
    survey, whose rows go north.
    """

    crs: str
    found_at: Callable[[Floats, Floats], tuple[Floats, Floats]]
    shape: tuple[int, int]
    read: Callable[[slice, slice], Floats]
    is_up: bool | None
    step: float
    nodes: tuple[Floats, Floats] | None = None


def plane(depth: float, slope_deg: float, towards_deg: float, around: Around) -> Nodes:
    """Return a plane of a depth (m) at the origin, which falls away at an angle in a direction."""
    fall, towards = math.tan(math.radians(slope_deg)), math.radians(towards_deg)
    xs, ys = np.array(around.x), np.array(around.y)
    deeper = fall * (math.cos(towards) * xs[:, np.newaxis] + math.sin(towards) * ys)
    return xs, ys, np.ascontiguousarray(depth + deeper)


def read_bottom(file: str, crs: str | None, positive: str | None, around: Around) -> Nodes:
    """Return the part of a chart around a survey as x (n,) and y (m,) of a grid, and depths (n, m).

    `crs` and `positive` are keys of `environment.bathymetry`.

    Raises:
        ValueError: with the file, the reason and the remedy.
    """
    if not Path(file).is_file():
        raise ValueError(f"no such file: {file}")
    return _read(file, Path(file).stat().st_mtime_ns, crs, positive, around)


@lru_cache(maxsize=8)
def _read(file: str, changed: int, crs: str | None, positive: str | None, around: Around) -> Nodes:
    """Return the bottom of a file that was changed last at an instant (ns)."""
    ending = Path(file).suffix.lower()
    if ending in TEXTS:
        return _wet(*_of_text(file, crs, around), positive, around, file)
    if ending in NETCDFS:
        import_of = _netcdf(file)
        with import_of as data:
            return _wet(*_on_survey(_chart_of_netcdf(data, file, crs), around, file), positive,
                        around, file)  # fmt: skip
    with _gdal(file) as data:
        chart = _chart_of_gdal(data, file, crs)
        return _wet(*_on_survey(chart, around, file), positive, around, file)


def _wet(
    xs: Floats,
    ys: Floats,
    values: Floats,
    is_up: bool | None,
    positive: str | None,
    around: Around,
    file: str,
) -> Nodes:
    """Return the bottom of depths or heights, by what the file or the scenario says of them."""
    if not np.isfinite(values).any():
        raise ValueError(f"{file}: has no depths around the survey (no data); use another chart")
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if max(-low, high) > HIGHEST_M:
        wrong = low if -low > high else high
        raise ValueError(
            f"{file}: has a depth or height of {wrong:g} m; declare that number as no data, or "
            "convert it to metres"
        )
    if positive is not None:
        is_up = positive == "up"
    if is_up is None:
        if low < 0.0 < high or around.surface_m:
            raise ValueError(
                f"{file}: has numbers of {low:g} to {high:g} around the survey, and does not say "
                f"whether these are depths or heights; set {KEY}.positive to down or up"
            )
        is_up = high <= 0.0
    depths = around.surface_m - values if is_up else values
    return xs, ys, np.ascontiguousarray(depths, dtype=np.float64)


On = tuple[Floats, Floats, Floats, "bool | None"]


def _on_survey(chart: Chart, around: Around, file: str) -> On:
    """Return x, y (m), and the numbers of a chart around the survey."""
    if chart.nodes is not None:
        return _own_nodes(chart, around, file)
    xs, ys = (_axis(*ends, chart.step / 2.0, file) for ends in (around.x, around.y))
    places = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
    rows, columns = chart.found_at(*_in_grid(places, chart.crs, around, file))
    inside = (rows >= 0.0) & (rows <= chart.shape[0] - 1.0)
    inside &= (columns >= 0.0) & (columns <= chart.shape[1] - 1.0)
    if not inside.any():
        raise ValueError(f"{file}: is of another place, {_off(chart, places, around, file)}")
    j, i = (_window(index[inside], size) for index, size in
            zip((rows, columns), chart.shape, strict=True))  # fmt: skip
    if (j.stop - j.start) * (i.stop - i.start) > MOST_NODES:
        raise ValueError(
            f"{file}: has {j.stop - j.start} x {i.stop - i.start} depths around the survey; make "
            "the grid coarser"
        )
    window, found = chart.read(j, i), np.full(len(places), np.nan)
    found[inside] = _between(window, rows[inside] - j.start, columns[inside] - i.start)
    return xs, ys, found.reshape(len(xs), len(ys)), chart.is_up


def _off(chart: Chart, places: Floats, around: Around, file: str) -> str:
    """Return in words where a survey lies in the grid of a chart, for one that lies elsewhere."""
    east, north = _in_grid(places[len(places) // 2][np.newaxis], chart.crs, around, file)
    return (
        f"the survey is at {east[0]:.7g}, {north[0]:.7g} in {chart.crs}; use a chart of its bay, "
        f"or set {KEY}.crs"
    )


def _own_nodes(chart: Chart, around: Around, file: str) -> On:
    """Return a chart in metres of the survey at its own nodes, as far as it reaches."""
    assert chart.nodes is not None
    kept = []
    for axis, (low, high) in zip(chart.nodes, (around.x, around.y), strict=True):
        begin = max(int(np.searchsorted(axis, low, side="right")) - 1, 0)
        end = min(int(np.searchsorted(axis, high)) + 1, axis.size)
        if end - begin < 2:
            raise ValueError(
                f"{file}: reaches from {axis[0]:g} to {axis[-1]:g} m, the survey from {low:g} to "
                f"{high:g} m; use a chart of its place, or set {KEY}.crs"
            )
        kept.append(slice(begin, end))
    (xs, ys), (j, i) = chart.nodes, kept
    return xs[j], ys[i], chart.read(j, i), chart.is_up


def _window(index: Floats, size: int) -> slice:
    return slice(max(int(index.min()), 0), min(int(index.max()) + 2, size))


def _axis(low: float, high: float, step: float, file: str) -> Floats:
    count = math.ceil((high - low) / step) + 1
    return np.linspace(low, high, min(max(count, 2), int(MOST_NODES**0.5)))


def _between(values: Floats, rows: Floats, columns: Floats) -> Floats:
    """Return a grid (r, c) between its nodes, bilinear, at fractional rows and columns (n,)."""
    j = np.clip(rows.astype(np.int64), 0, max(values.shape[0] - 2, 0))
    i = np.clip(columns.astype(np.int64), 0, max(values.shape[1] - 2, 0))
    down, along = rows - j, columns - i
    found = np.zeros(len(rows))
    for n, share in ((0, 1.0 - down), (1, down)):
        for m, part in ((0, 1.0 - along), (1, along)):
            weight = share * part
            own = values[np.minimum(j + n, len(values) - 1),
                         np.minimum(i + m, values.shape[1] - 1)]  # fmt: skip
            found += np.where(weight > 0.0, weight * own, 0.0)
    return found


def _in_grid(places: Floats, crs: str, around: Around, file: str) -> tuple[Floats, Floats]:
    """Return positions (n, 2), m, as east and north of a grid, or longitude and latitude (deg)."""
    if crs == LOCAL:
        return places[:, 1], places[:, 0]
    if around.origin is None:
        raise ValueError(
            f"{file}: is in {crs}, and nothing says where on Earth x = y = 0 is; add "
            "environment.origin.lat_deg and lon_deg"
        )
    lat, lon = _degrees(places, around.origin, around.to_metres)
    if crs == DEGREES:
        return lon, lat
    east, north = grid_of(crs)[1].transform(lon, lat, direction="INVERSE")
    return np.asarray(east), np.asarray(north)


def _degrees(places: Floats, origin: Sequence[float], to_metres: ToMetres) -> tuple[Floats, Floats]:
    """Return latitudes and longitudes (deg) of positions (n, 2), m, at the surface: the inverse of
    `to_metres`, by Newton's method.
    """
    scale = math.cos(math.radians(origin[0]))
    lat = np.full(len(places), origin[0])
    lon, level = np.full(len(places), origin[1]), np.zeros(len(places))
    for _ in range(4):  # each leaves a thousandth; the fourth leaves rounding
        off = places - to_metres(lat, lon, level, origin)[:, :2]
        lat = lat + off[:, 0] / DEGREE_M
        lon = lon + off[:, 1] / DEGREE_M / scale
    return lat, lon


def _spacing(east: float, north: float, crs: str, around_deg: float) -> float:
    """Return the spacing (m) of a grid whose steps are in its units."""
    if crs != DEGREES:
        return min(east, north)
    return DEGREE_M * min(north, east * math.cos(math.radians(around_deg)))


# GDAL


def _gdal(file: str) -> Any:
    try:
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioIOError
    except ImportError:
        raise ValueError(f"{file}: {GRIDS_NEED}") from None
    try:
        with warnings.catch_warnings():  # of a file without georeference, which is told below
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            return rasterio.open(file)
    except RasterioIOError as error:
        reason = str(error).splitlines()[0][:200]
        raise ValueError(f"{file}: cannot be read as a grid ({reason})") from None


def _chart_of_gdal(data: Any, file: str, crs: str | None) -> Chart:
    from rasterio.windows import Window

    if data.transform.is_identity or not (data.crs or crs):
        raise ValueError(
            f"{file}: does not say where on Earth it is (no georeference); set {KEY}.crs to its "
            "code, such as EPSG:32760, or to local"
            if not data.transform.is_identity
            else f"{file}: has no georeference at all; export it as a GeoTIFF with its grid"
        )
    named = crs or (data.crs.to_string() if data.crs else LOCAL)
    if crs is None and data.crs is not None and data.crs.is_geographic:
        named = DEGREES
    back = ~data.transform
    a, b, c, d, e, f = (back.a, back.b, back.c, back.d, back.e, back.f)

    def index(east: Floats, north: Floats) -> tuple[Floats, Floats]:
        return d * east + e * north + f - 0.5, a * east + b * north + c - 0.5

    def read(rows: slice, columns: slice) -> Floats:
        part = Window(columns.start, rows.start, columns.stop - columns.start,
                      rows.stop - rows.start)  # fmt: skip
        found = data.read(1, window=part, masked=True).astype(np.float64).filled(np.nan)
        return np.asarray(found) * (data.scales[0] or 1.0) + (data.offsets[0] or 0.0)

    middle = data.transform.f + data.transform.e * data.height / 2.0
    across = math.hypot(data.transform.a, data.transform.d)
    along = math.hypot(data.transform.b, data.transform.e)
    said = (data.descriptions[0] or "").lower()
    return Chart(
        named, index, (data.height, data.width), read, _is_up(said, ""),
        _spacing(across, along, named, middle),
    )  # fmt: skip


# NetCDF


def _netcdf(file: str) -> Any:
    try:
        import xarray
    except ImportError:
        raise ValueError(f"{file}: {NETCDF_NEEDS}") from None
    try:
        return xarray.open_dataset(file, decode_times=False)
    except (OSError, ValueError, RuntimeError) as error:
        reason = str(error).splitlines()[0][:200]
        raise ValueError(f"{file}: cannot be read as NetCDF ({reason})") from None


def _is_up(*said: str) -> bool | None:
    """Return whether numbers are heights, by their name or what is said of them; None: unknown."""
    for text in said:
        if text in ("down", *DEPTHS) or "depth" in text:
            return False
        if text in ("up", *HEIGHTS) or "altitude" in text or "height" in text:
            return True
    return None


def _chart_of_netcdf(data: Any, file: str, crs: str | None) -> Chart:
    flat = {
        str(name).lower(): part
        for name, part in data.data_vars.items()
        if sum(size > 1 for size in part.shape) == 2
    }
    part = next((flat[name] for name in (*HEIGHTS, *DEPTHS) if name in flat), None)
    if part is None and len(flat) == 1:
        part = next(iter(flat.values()))
    if part is None:
        held = ", ".join(map(str, data.data_vars)) or "nothing"
        raise ValueError(
            f"{file}: has no grid named elevation or depth, but {held}; rename the one that is the "
            "bottom"
        )
    part = part.squeeze(drop=True)
    axes = []
    for names in (NORTHS[:-1], EASTS[:-1]):
        axis = next(
            (part[dim] for dim in part.dims if str(dim).lower() in names and dim in part.coords),
            None,
        )
        if axis is None:
            raise ValueError(
                f"{file}: {part.name} has no axes lat and lon, or y and x, in one line"
            )
        axes.append(axis)
    (north, norths), (east, easts) = (
        (axis.name, np.asarray(axis.values, dtype=np.float64)) for axis in axes
    )
    for name, values in ((north, norths), (east, easts)):
        steps = np.diff(values)
        if values.size < 2 or not ((steps > 0).all() or (steps < 0).all()):
            raise ValueError(f"{file}: {name} must rise or fall throughout; sort it")
    in_degrees = str(axes[0].attrs.get("units", "")).startswith("degree") or str(
        north
    ).lower().startswith("lat")
    if crs is None and not in_degrees:
        raise ValueError(
            f"{file}: does not say in which grid {north} and {east} are; set {KEY}.crs to its "
            "code, such as EPSG:32760, or to local"
        )
    named = crs or DEGREES
    rising = tuple(values[-1] > values[0] for values in (norths, easts))

    def index(x: Floats, y: Floats) -> tuple[Floats, Floats]:
        found = []
        for at, values, rises in ((y, norths, rising[0]), (x, easts, rising[1])):
            axis = values if rises else values[::-1]
            if named == DEGREES and values is easts:  # 0 to 360, or -180 to 180
                at = (at - axis[0]) % 360.0 + axis[0]
            at = np.interp(at, axis, np.arange(axis.size), left=-1.0, right=axis.size)
            found.append(at if rises else axis.size - 1.0 - at)
        return found[0], found[1]

    ordered = part.transpose(north, east)

    def read(rows: slice, columns: slice) -> Floats:
        return np.asarray(ordered[rows, columns].values, dtype=np.float64)

    units = str(part.attrs.get("units", "m")).lower()
    if units not in ("m", "meter", "metre", "meters", "metres", "m."):
        raise ValueError(f"{file}: {part.name} is in {units!r}; convert it to metres")
    attrs = (str(part.attrs.get(name, "")).lower() for name in ("positive", "standard_name"))
    step = _spacing(abs(float(np.diff(easts).mean())), abs(float(np.diff(norths).mean())), named,
                    float(norths.mean()))  # fmt: skip
    return Chart(named, index, ordered.shape, read, _is_up(*attrs, str(part.name).lower()), step)


# Text


def _of_text(file: str, crs: str | None, around: Around) -> On:
    """Return what a text has: a position and a depth or height a line."""
    easts, norths, values, is_up, is_geographic = _columns(file)
    named = crs
    if named is None and is_geographic is not None:
        named = DEGREES if is_geographic else LOCAL
    if named is None:
        raise ValueError(
            f"{file}: does not say in which grid its positions are; set {KEY}.crs to EPSG:4326 for "
            "longitude, latitude, to local for metres east and north, or to another code"
        )
    if named == LOCAL:
        places = np.column_stack((norths, easts))
    else:
        if around.origin is None:
            raise ValueError(
                f"{file}: is on Earth, and nothing says where x = y = 0 is; add "
                "environment.origin.lat_deg and lon_deg"
            )
        if named != DEGREES:
            easts, norths = grid_of(named)[1].transform(easts, norths)
        if not (np.isfinite(easts).all() and np.isfinite(norths).all()):
            raise ValueError(f"{file}: has positions that are nowhere in {named}; give its code")
        level = np.zeros(len(values))
        places = around.to_metres(norths, easts, level, around.origin)[:, :2]
    gridded = _gridded(places, values)
    if gridded is not None:
        xs, ys, grid = gridded
        whole = Chart(LOCAL, _nowhere, grid.shape, lambda j, i: grid[j, i], is_up, 0.0, (xs, ys))
        return _own_nodes(whole, around, file)
    return _scattered(places, values, is_up, around, file)


def _nowhere(east: Floats, north: Floats) -> tuple[Floats, Floats]:
    raise NotImplementedError  # a grid with its own nodes is not asked


def _columns(file: str) -> tuple[Floats, Floats, Floats, bool | None, bool | None]:
    """Return east, north and the numbers of a text; whether these are heights, and whether places
    are in degrees, by the names of its columns (None: it names none).
    """
    try:
        with open(file, encoding="utf-8-sig") as lines:
            found = ((n, line) for n, line in enumerate(lines) if line.strip() and line[0] != "#")
            before, first = next(found, (0, ""))
    except UnicodeDecodeError:
        raise ValueError(f"{file}: is no text; name a grid .tif or .nc") from None
    parts = first.replace(",", " ").replace(";", " ").split()
    names = [part.strip('"').lower() for part in parts]
    has_names = any(not _is_number(part) for part in parts)
    parted = next((mark for mark in ",;" if mark in first), None)
    try:
        numbers = np.loadtxt(
            file,
            delimiter=parted,
            skiprows=before + has_names,
            max_rows=MOST_POINTS,
            ndmin=2,
            encoding="utf-8-sig",
        )
    except ValueError as error:
        reason = str(error).splitlines()[0][:160]
        raise ValueError(f"{file}: a line is no three numbers ({reason})") from None
    if numbers.shape[1] < 3 or len(numbers) < 3:
        raise ValueError(f"{file}: needs three lines or more of east, north, and a depth or height")
    if not has_names:
        return numbers[:, 0], numbers[:, 1], numbers[:, 2], None, None
    east, north, depth = (
        next((names.index(name) for name in among if name in names), -1)
        for among in (EASTS, NORTHS, (*DEPTHS, *HEIGHTS))
    )
    if -1 in (east, north, depth):
        raise ValueError(
            f"{file}: has columns {', '.join(names)}; name them lon, lat, depth_m, or x_m, y_m "
            "(north, east), depth_m (or height_m)"
        )
    kind = names[east]
    is_geographic = True if kind.startswith("lon") else False if kind == "y_m" else None
    columns = numbers[:, east], numbers[:, north], numbers[:, depth]
    is_up = None if names[depth] == "z" else _is_up(names[depth])
    return *columns, is_up, is_geographic


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _gridded(places: Floats, values: Floats) -> tuple[Floats, Floats, Floats] | None:
    """Return xs, ys (m) and the numbers of positions that are nodes of a grid; None if they are
    not.
    """
    xs, ys = (np.unique(axis) for axis in places.T)
    if xs.size < 2 or ys.size < 2 or xs.size * ys.size > 4 * len(values):
        return None
    grid = np.full((xs.size, ys.size), np.nan)
    grid[np.searchsorted(xs, places[:, 0]), np.searchsorted(ys, places[:, 1])] = values
    return xs, ys, grid


def _scattered(places: Floats, values: Floats, is_up: bool | None, around: Around, file: str) -> On:
    """Return soundings between which the bottom is linear in triangles; NaN beyond them all."""
    try:
        from scipy.interpolate import LinearNDInterpolator
    except ImportError:
        raise ValueError(f"{file}: {SCATTER_NEEDS}") from None
    span = np.ptp(places, axis=0)
    step = max(float(np.sqrt(span[0] * span[1] / len(values))), 0.5)
    near = np.isfinite(values)
    for axis, (low, high) in enumerate((around.x, around.y)):
        near &= (places[:, axis] >= low - 20.0 * step) & (places[:, axis] <= high + 20.0 * step)
    if near.sum() < 3:
        raise ValueError(
            f"{file}: has no soundings around the survey; use a chart of its place, or set "
            f"{KEY}.crs"
        )
    xs, ys = (_axis(*ends, step / 2.0, file) for ends in (around.x, around.y))
    grid = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1)
    found = LinearNDInterpolator(places[near], values[near])(grid)
    return xs, ys, np.asarray(found), is_up
