"""How sure an AUV is of where it is, as a viewer shows it: the ellipse of each estimate."""

from collections.abc import Mapping
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from .drawing import ELLIPSE_SCALE, auv_colour, disc, update
from .messages import FRAMES, MAP, Message, Messages, timestamp

if TYPE_CHECKING:
    from ..results.result import Result

OPACITY = 0.3

SPREAD = ("estimate_sd_x_m", "estimate_sd_y_m", "estimate_cov_xy_m2")


def certainty(result: "Result") -> Messages:
    """Yield, for each instant of `tracks`, the ellipses that hold AUVs with 95 %, at their depths.

    Each replaces that of the instant before.  There are none while no AUV is ever unsure.
    """
    rows = [row for row in result.arrow["tracks"].to_pylist() if row[SPREAD[0]] is not None]
    if not any(row[name] for row in rows for name in SPREAD):
        return
    for at_s, together in groupby(sorted(rows, key=itemgetter("time_s")), key=itemgetter("time_s")):
        drawn = [_around(row) for row in together]
        yield Message(at_s, "/scene/certainty", update(*drawn))


def _around(row: Mapping[str, Any]) -> dict[str, Any]:
    sd_x, sd_y, xy = (row[name] for name in SPREAD)
    place = [row[name] for name in FRAMES["{}/estimate"]]
    name, covariance = row["vehicle"], np.array([[sd_x**2, xy], [xy, sd_y**2]])
    return {
        "timestamp": timestamp(row["time_s"]),
        "frame_id": MAP,
        "id": name,
        "cylinders": [disc(place, covariance, ELLIPSE_SCALE, auv_colour(name, OPACITY))],
    }
