"""Where vehicles and fixes are on Earth, for map panels; only of a survey that has an origin."""

from collections.abc import Iterator, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from foxglove.messages import LocationFix, LocationFixPositionCovarianceType

from ..geometry.geodesy import Floats, enu_covariance, geodetic_from_ned
from ..scenario.on_earth import origin_of
from .messages import FRAMES, Message, Messages, timestamp

if TYPE_CHECKING:
    from ..results.result import Result

KNOWN = LocationFixPositionCovarianceType.Known
NAMES = {"{}": "location", "{}/estimate": "location/estimate", "{}/imu": "location/imu"}


def location_streams(result: "Result") -> Iterator[Messages]:
    """Yield the positions of all vehicles and the fixes, WGS-84; none if there is no origin."""
    origin = origin_of(result.scenario)
    if origin is not None:
        yield _vehicles(result, origin)
        yield _fixes(result, origin)


def fix_covariance(row: dict[str, Any]) -> Floats:
    """Return the covariance (m2) of a row of `fixes`, in the survey frame (NED)."""
    xy, xz, yz = row["cov_xy_m2"], row["cov_xz_m2"], row["cov_yz_m2"]
    variance = [row[f"sd_{axis}_m"] ** 2 for axis in "xyz"]
    return np.array([[variance[0], xy, xz], [xy, variance[1], yz], [xz, yz, variance[2]]])


def _vehicles(result: "Result", origin: tuple[float, float]) -> Messages:
    rows = result.arrow["tracks"].to_pylist()
    for row in sorted(rows, key=itemgetter("time_s")):
        for frame, columns in FRAMES.items():
            place = [row[column] for column in columns]
            if None not in place:
                name, at_s = row["vehicle"], row["time_s"]
                location = _location(place, origin, at_s, frame.format(name))
                yield Message(at_s, f"/{name}/{NAMES[frame]}", location)


def _fixes(result: "Result", origin: tuple[float, float]) -> Messages:
    rows = result.arrow["fixes"].to_pylist()
    for row in sorted(rows, key=itemgetter("pinged_at_s")):
        name, at_s = row["auv"], row["pinged_at_s"]
        place = [row["x_m"], row["y_m"], row["z_m"]]
        covariance = enu_covariance(fix_covariance(row)).ravel().tolist()
        location = _location(place, origin, at_s, name, covariance)
        yield Message(at_s, f"/{name}/location/fix", location)


def _location(
    place: Sequence[float],
    origin: tuple[float, float],
    at_s: float,
    frame: str,
    covariance: Sequence[float] | None = None,
) -> LocationFix:
    lat, lon, height = geodetic_from_ned(place, *origin)
    known = {} if covariance is None else _known(covariance)
    return LocationFix(
        timestamp=timestamp(at_s),
        frame_id=frame,
        latitude=lat,
        longitude=lon,
        altitude=height,
        **known,
    )


def _known(covariance: Sequence[float]) -> dict[str, Any]:
    return {"position_covariance": list(covariance), "position_covariance_type": KNOWN}
