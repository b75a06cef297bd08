"""Where on Earth a survey lies (WGS-84), and the change from north-east-down to east-north-up.

Inside the package every position is in the survey frame: x north, y east, z down (NED), headings
from +x towards +y.  Viewers get east-north-up (ENU, ROS REP 103); only this module converts.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats

# World Geodetic System 1984 (NGA.STND.0036, table 3.1): semi-major axis (m), flattening
SEMI_MAJOR, FLATTENING = 6_378_137.0, 1 / 298.257_223_563
ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING)

# Swaps x and y and negates z: its own inverse.
NED_TO_ENU: Floats = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def enu_from_ned(positions: ArrayLike) -> Floats:
    """Return positions (..., 3), m, from north-east-down in east-north-up, or the reverse.

    >>> enu_from_ned([3.0, 1.0, 10.0]).tolist()
    [1.0, 3.0, -10.0]
    """
    return np.asarray(positions, dtype=np.float64) @ NED_TO_ENU


def east_north(places: ArrayLike) -> Floats:
    """Return positions x, y (..., 2), m, as a map's coordinates: east to the right, north up.

    >>> east_north([[3.0, 1.0]]).tolist()
    [[1.0, 3.0]]
    """
    return np.asarray(places, dtype=np.float64)[..., ::-1]


def enu_covariance(covariance: ArrayLike) -> Floats:
    """Return a position's covariance (..., 3, 3), m2, from NED in ENU.

    >>> enu_covariance(np.diag([4.0, 1.0, 9.0])).diagonal().tolist()
    [1.0, 4.0, 9.0]
    """
    turned: Floats = NED_TO_ENU @ np.asarray(covariance, dtype=np.float64) @ NED_TO_ENU
    return turned


def enu_yaw(yaw: float) -> float:
    """Return a heading, from north to east (rad), as an angle from east to north, or the reverse.

    The result lies in (-pi, pi].

    >>> enu_yaw(0.0) == math.pi / 2  # north
    True
    >>> enu_yaw(math.pi / 2)  # east
    0.0
    """
    turned = math.remainder(math.pi / 2 - yaw, math.tau)
    return math.pi if turned == -math.pi else turned


def ecef_from_geodetic(lat_deg: float, lon_deg: float, height: float = 0.0) -> Floats:
    """Return the Earth-centred, Earth-fixed position [x, y, z] (m) of geodetic coordinates.

    >>> ecef_from_geodetic(0.0, 90.0).round(6).tolist()
    [0.0, 6378137.0, 0.0]
    """
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    normal = _prime_vertical_radius(lat)
    across = (normal + height) * math.cos(lat)
    along = (normal * (1 - ECCENTRICITY_SQUARED) + height) * math.sin(lat)
    return np.array([across * math.cos(lon), across * math.sin(lon), along])


def geodetic_from_ecef(position: ArrayLike) -> tuple[float, float, float]:
    """Return latitude (deg), longitude (deg) and height (m) of an Earth-centred position (m).

    Bowring's closed form (1976), from the reduced latitude, applied twice: the error is below 1e-9
    m for heights from the sea floor to the stratosphere.

    >>> lat, lon, height = geodetic_from_ecef(ecef_from_geodetic(54.33, 10.18, -10.0))
    >>> round(lat, 12), round(lon, 12), round(height, 6)
    (54.33, 10.18, -10.0)
    """
    x, y, z = (float(part) for part in np.asarray(position))
    across = math.hypot(x, y)
    semi_minor = SEMI_MAJOR * (1 - FLATTENING)
    second_eccentricity_squared = ECCENTRICITY_SQUARED / (1 - ECCENTRICITY_SQUARED)
    reduced = math.atan2(z, across * (1 - FLATTENING))
    lat = 0.0
    for _ in range(2):
        lat = math.atan2(
            z + second_eccentricity_squared * semi_minor * math.sin(reduced) ** 3,
            across - ECCENTRICITY_SQUARED * SEMI_MAJOR * math.cos(reduced) ** 3,
        )
        reduced = math.atan2((1 - FLATTENING) * math.sin(lat), math.cos(lat))
    # This form is valid at the poles, too; across / cos(lat) is not.
    height = (
        across * math.cos(lat) + z * math.sin(lat) - SEMI_MAJOR**2 / _prime_vertical_radius(lat)
    )
    return math.degrees(lat), math.degrees(math.atan2(y, x)), height


def geodetic_from_ned(
    position: ArrayLike, lat_deg: float, lon_deg: float, surface_m: float = 0.0
) -> tuple[float, float, float]:
    """Return where on Earth a position of the survey lies.

    The survey frame is the plane that touches the ellipsoid at the survey's centre.  10 km from
    there the sea is 7.8 m below that plane, which the returned height contains.

    Args:
        position: north, east, down (m).
        lat_deg: latitude of the survey's centre.
        lon_deg: longitude of the survey's centre.
        surface_m: height of the water above the ellipsoid.

    Returns:
        Latitude (deg), longitude (deg), height above the ellipsoid (m).

    >>> round(geodetic_from_ned([0.0, 0.0, 10.0], 54.33, 10.18)[2], 6)
    -10.0
    """
    ned = np.asarray(position, dtype=np.float64)
    centre = ecef_from_geodetic(lat_deg, lon_deg, surface_m)
    return geodetic_from_ecef(centre + ned @ _north_east_down(lat_deg, lon_deg))


def ned_from_geodetic(
    lat: ArrayLike,
    lon: ArrayLike,
    height: ArrayLike,
    lat_deg: float,
    lon_deg: float,
    surface_m: float = 0.0,
) -> Floats:
    """Return positions on Earth, each coordinate of shape (...), as north, east, down (..., 3), m.

    The inverse of :func:`geodetic_from_ned`: heights (m) are above the ellipsoid, down is counted
    from the survey's plane.

    >>> there = geodetic_from_ned([60.0, -70.0, 10.0], 54.33, 10.18)
    >>> ned_from_geodetic(*there, 54.33, 10.18).round(6).tolist()
    [60.0, -70.0, 10.0]
    """
    on_ellipsoid, up = _on_ellipsoid(lat, lon)
    places = on_ellipsoid + up * np.asarray(height, dtype=np.float64)[..., None]
    centre = ecef_from_geodetic(lat_deg, lon_deg, surface_m)
    ned: Floats = (places - centre) @ _north_east_down(lat_deg, lon_deg).T
    return ned


def ned_at_depth(
    lat_deg: ArrayLike, lon_deg: ArrayLike, depth_m: ArrayLike, origin: Sequence[float]
) -> Floats:
    """Return north, east, down (n, 3), m, of positions on Earth, at a given depth (m) each.

    A position lies where the plumb line of its latitude and longitude meets the plane of its depth,
    so that :func:`geodetic_from_ned` returns the same latitude and longitude.

    Args:
        lat_deg: latitudes; within a quarter of the Earth of the origin.
        lon_deg: longitudes.
        depth_m: depths below the survey's plane.
        origin: latitude and longitude of the survey's centre (deg), and the height of the water
            (m), 0 where it is left out.

    >>> lat, lon, _ = geodetic_from_ned([60.0, -70.0, 10.0], 54.33, 10.18)
    >>> ned_at_depth([lat], [lon], [10.0], (54.33, 10.18)).round(6).tolist()
    [[60.0, -70.0, 10.0]]
    """
    on_ellipsoid, up = _on_ellipsoid(lat_deg, lon_deg)
    lat, lon, *_ = origin
    axes = _north_east_down(lat, lon).T
    places = (on_ellipsoid - ecef_from_geodetic(*origin)) @ axes
    plumb = up @ axes
    down = np.asarray(depth_m, dtype=np.float64)
    ned: Floats = places + plumb * ((down - places[:, 2]) / plumb[:, 2])[:, None]
    ned[:, 2] = down
    return ned


def far_apart_m(lat_deg: ArrayLike, lon_deg: ArrayLike, origin: Sequence[float]) -> Floats:
    """Return the straight distances (n,), m, from the survey's centre to positions (n,), deg.

    >>> far_apart_m([54.33], [10.18], (54.33, 10.18)).round(6).tolist()
    [0.0]
    """
    on_ellipsoid, _ = _on_ellipsoid(lat_deg, lon_deg)
    return np.asarray(np.linalg.norm(on_ellipsoid - ecef_from_geodetic(*origin), axis=1))


def degrees_text(lat_deg: float, lon_deg: float) -> str:
    """Return a position on Earth as text in degrees, to 0.1 m.

    >>> degrees_text(54.33, -10.1800004)
    '54.330000 N, 10.180000 W'
    """
    north, east = "NS"[lat_deg < 0], "EW"[lon_deg < 0]
    return f"{abs(lat_deg):.6f} {north}, {abs(lon_deg):.6f} {east}"


def minutes_text(lat_deg: float, lon_deg: float) -> str:
    """Return a position on Earth as text in degrees and minutes, as plotters show it, to 0.2 m.

    >>> minutes_text(54.33, -10.18), minutes_text(-0.99999999, 179.99999999)
    ("54 19.8000' N, 010 10.8000' W", "01 00.0000' S, 180 00.0000' E")
    """
    north, east = "NS"[lat_deg < 0], "EW"[lon_deg < 0]
    (lat, of_lat), (lon, of_lon) = (
        divmod(round(600_000 * abs(angle)), 600_000) for angle in (lat_deg, lon_deg)
    )
    return f"{lat:02d} {of_lat / 1e4:07.4f}' {north}, {lon:03d} {of_lon / 1e4:07.4f}' {east}"


def _on_ellipsoid(lat_deg: ArrayLike, lon_deg: ArrayLike) -> tuple[Floats, Floats]:
    """Return Earth-centred positions (..., 3), m, on the ellipsoid, and unit vectors up."""
    lat, lon = np.radians(np.asarray(lat_deg)), np.radians(np.asarray(lon_deg))
    up = np.stack((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)), axis=-1)
    normal = SEMI_MAJOR / np.sqrt(1 - ECCENTRICITY_SQUARED * np.sin(lat) ** 2)
    return normal[..., None] * up * np.array([1.0, 1.0, 1 - ECCENTRICITY_SQUARED]), up


def _prime_vertical_radius(lat: float) -> float:
    return SEMI_MAJOR / math.sqrt(1 - ECCENTRICITY_SQUARED * math.sin(lat) ** 2)


def _north_east_down(lat_deg: float, lon_deg: float) -> Floats:
    """Return the unit vectors north, east and down in the Earth-centred frame, as rows (3, 3)."""
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    north = [-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat)]
    east = [-math.sin(lon), math.cos(lon), 0.0]
    down = [-math.cos(lat) * math.cos(lon), -math.cos(lat) * math.sin(lon), -math.sin(lat)]
    return np.array([north, east, down])
