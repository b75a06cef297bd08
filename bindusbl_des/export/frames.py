"""Where every vehicle is, as frames of a viewer: truth, estimate and dead reckoning apart."""

import math
from collections.abc import Mapping
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from foxglove.messages import FrameTransform, FrameTransforms, Quaternion, Vector3

from ..geometry.geodesy import enu_from_ned, enu_yaw
from .messages import MAP, Message, Messages, timestamp

if TYPE_CHECKING:
    from ..results.result import Result

Row = Mapping[str, Any]

# What a vehicle's child frames are called, and the columns of `tracks` that place them.
FRAMES = {
    "{}": ("x_m", "y_m", "z_m"),
    "{}/estimate": ("estimate_x_m", "estimate_y_m", "estimate_z_m"),
    "{}/imu": ("imu_x_m", "imu_y_m", "estimate_z_m"),
}


def transforms(result: "Result") -> Messages:
    """Yield, for each instant of `tracks`, the frames of all vehicles in the map.

    A vehicle's own frame has x forward, y to port and z up (ROS REP 103); estimate and dead
    reckoning share the true heading, since only positions drift.
    """
    rows = sorted(result.arrow["tracks"].to_pylist(), key=itemgetter("time_s"))
    for at_s, together in groupby(rows, key=itemgetter("time_s")):
        placed = [transform for row in together for transform in _frames(row)]
        yield Message(at_s, "/tf", FrameTransforms(transforms=placed))


def _frames(row: Row) -> list[FrameTransform]:
    return [
        _transform(row, name.format(row["vehicle"]), columns)
        for name, columns in FRAMES.items()
        if all(row[column] is not None for column in columns)
    ]


def _transform(row: Row, name: str, columns: tuple[str, ...]) -> FrameTransform:
    x, y, z = enu_from_ned([row[column] for column in columns])
    half = enu_yaw(row["yaw_rad"]) / 2
    return FrameTransform(
        timestamp=timestamp(row["time_s"]),
        parent_frame_id=MAP,
        child_frame_id=name,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(z=math.sin(half), w=math.cos(half)),
    )
