"""A line of JSON for each reading: what an instrument has, with units in the names."""

import json
import math
from dataclasses import asdict
from typing import Any

from .readings import (
    Compass,
    Delivered,
    Earth,
    Estimate,
    Gnss,
    Pinged,
    Reading,
    Sent,
    Truth,
    Usbl,
)

# What of a fix nobody at sea knows.
UNKNOWN = ("error_m",)


def line(reading: Reading, earth: Earth) -> str:
    """Return a reading as a line of JSON; of what there is not, nothing is said."""
    when = earth.utc(reading.at_s).isoformat(timespec="microseconds")
    said = {
        "time_s": reading.at_s,
        "utc": when.replace("+00:00", "Z"),
        "vehicle": reading.vehicle,
        **_content(reading, earth),
    }
    return json.dumps(said, separators=(",", ":")) + "\n"


def _content(reading: Reading, earth: Earth) -> dict[str, Any]:
    """Return the kind of a reading and its values."""
    if isinstance(reading, Gnss):
        return {
            "kind": "gnss",
            **_place(reading.place, earth),
            **_named(("v_north_m_per_s", "v_east_m_per_s"), reading.velocity or ()),
            "sd_m": reading.sd_m,
        }
    if isinstance(reading, Compass):
        return {"kind": "compass", "heading_deg": math.degrees(reading.yaw) % 360.0}
    if isinstance(reading, Usbl):
        return {"kind": "usbl", "auv": reading.auv, "ping": reading.ping, **_seen(reading, earth)}
    if isinstance(reading, Delivered):
        known = {name: it for name, it in asdict(reading.fix).items() if it is not None}
        rest = {name: it for name, it in known.items() if name not in ("auv", *UNKNOWN)}
        fix = reading.fix
        return {"kind": "fix", **rest, **_place((fix.x_m, fix.y_m, fix.z_m), earth)}
    if isinstance(reading, Estimate):
        (xx, xy), (_, yy) = reading.covariance
        spread = {"sd_x_m": math.sqrt(max(xx, 0.0)), "sd_y_m": math.sqrt(max(yy, 0.0))}
        place = _place(reading.place, earth)
        return {"kind": "estimate", **place, **spread, "cov_xy_m2": xy}
    if isinstance(reading, Pinged):
        return {"kind": "ping", "ping": reading.ping}
    if isinstance(reading, Sent):
        known = {name: it for name, it in asdict(reading.frame).items() if it is not None}
        return {"kind": "broadcast", **{name: it for name, it in known.items() if name != "asv"}}
    assert isinstance(reading, Truth)
    heading = math.degrees(reading.yaw) % 360.0
    return {"kind": "truth", **_place(reading.place, earth), "heading_deg": heading}


def _seen(reading: Usbl, earth: Earth) -> dict[str, Any]:
    """Return what a vessel has measured: where the AUV is, and how far north, east and below."""
    sight = reading.sight
    offset = [float(sight.place[axis]) - sight.own[axis] for axis in range(3)]
    spread = [math.sqrt(max(float(sight.covariance[axis, axis]), 0.0)) for axis in range(3)]
    return {
        **_place(sight.place.tolist(), earth),
        **_named(("north_m", "east_m", "down_m"), offset),
        **_named(("sd_x_m", "sd_y_m", "sd_z_m"), spread),
        "heading_deg": math.degrees(sight.yaw) % 360.0,
    }


def _place(place: Any, earth: Earth) -> dict[str, float]:
    """Return a place in the survey frame, and on Earth if it is there."""
    found = _named(("x_m", "y_m", "z_m"), place)
    if earth.origin is not None:
        found["lat_deg"], found["lon_deg"], _ = earth.geodetic(place)
    return found


def _named(names: tuple[str, ...], values: Any) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=False)}
