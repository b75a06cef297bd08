"""What is heard, as a viewer shows it: rays of pings, broadcasts, fixes with their uncertainty."""

from collections import defaultdict
from collections.abc import Iterator
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from foxglove.messages import Duration, SpherePrimitive, Vector3

from ..core.palette import MF_ON_DARK
from .messages import MAP, Messages, ViewerMessage, colour, fix_covariance, timestamp
from .scenery import ELLIPSE_SCALE, auv_colour, ellipse, line, rays, ring, update, upright

if TYPE_CHECKING:
    from ..results.result import Result

# How long a ping and a fix stay in sight (s): sound crosses the HF range within a frame of video.
PING_LASTS, FIX_LASTS = 0.5, 5.0

# What became of a ping at an ASV, and at all: Okabe-Ito colours
OUTCOMES = {"heard": "#009E73", "lost": "#D55E00", "collided": "#CC79A7", "in_flight": "#F0E442"}
UNHEARD = "#808080"


def sound_streams(result: "Result") -> Iterator[Messages]:
    """Yield the pings, the broadcasts and the fixes of a mission, each in the order of time."""
    yield _pings(result)
    yield _broadcasts(result)
    yield _fixes(result)


def _pings(result: "Result") -> Messages:
    """Yield each ping as it is sent: a dot, and a ray to whoever is in range by its outcome."""
    where, protocol = _vehicles(result), result.scenario.protocol
    arrivals: dict[int, list[dict[str, Any]]] = defaultdict(list)
    for row in result.arrow["receptions"].to_pylist():
        if row["outcome"] in OUTCOMES and row["arrived_at_s"] is not None:
            arrivals[row["ping"]].append(row)
    size = Vector3(x=1.5, y=1.5, z=1.5)
    for row in sorted(result.arrow["pings"].to_pylist(), key=itemgetter("sent_at_s")):
        at_s, source = row["sent_at_s"], [row["x_m"], row["y_m"], row["z_m"]]
        heard = arrivals[row["ping"]]
        ends = [where(arrival[protocol.listening], at_s) for arrival in heard]
        codes = [colour(OUTCOMES[arrival["outcome"]]) for arrival in heard]
        dot = SpherePrimitive(
            pose=upright(source),
            size=size,
            color=colour(OUTCOMES["heard"] if row["heard_by"] else UNHEARD),
        )
        drawn = {"spheres": [dot], "lines": [rays(source, ends, codes)] if ends else []}
        yield _shown(at_s, "/scene/pings", row[protocol.pinging], MAP, PING_LASTS, drawn)


def _broadcasts(result: "Result") -> Messages:
    """Yield each broadcast: the circle that it reaches, for as long as it is on the air."""
    circle = ring(result.scenario.acoustics.mf.range_m, colour(MF_ON_DARK), width=3.0)
    rows = result.arrow["broadcasts"].to_pylist()
    for row in sorted(rows, key=itemgetter("sent_at_s")):
        at_s, name, lasts = row["sent_at_s"], row["asv"], row["airtime_s"]
        yield _shown(at_s, "/scene/broadcasts", name, name, lasts, {"lines": [circle]})


def _fixes(result: "Result") -> Messages:
    """Yield each fix at its ping: the ellipse that holds the AUV with 95 %, grey if it was lost."""
    for row in sorted(result.arrow["fixes"].to_pylist(), key=itemgetter("pinged_at_s")):
        place = [row["x_m"], row["y_m"], row["z_m"]]
        code = auv_colour(row["auv"]) if row["outcome"] == "delivered" else colour(UNHEARD)
        around = line(ellipse(place, fix_covariance(row), ELLIPSE_SCALE), code, closed=True)
        name = f"fix {row['fix']}"
        yield _shown(row["pinged_at_s"], "/scene/fixes", name, MAP, FIX_LASTS, {"lines": [around]})


def _shown(
    at_s: float, topic: str, name: str, frame: str, lasts: float, drawn: dict[str, Any]
) -> ViewerMessage:
    entity = {
        "timestamp": timestamp(at_s),
        "frame_id": frame,
        "id": name,
        "lifetime": Duration.from_secs(lasts),
        "frame_locked": True,
        **drawn,
    }
    return ViewerMessage(at_s, topic, update(entity))


def _vehicles(result: "Result") -> Any:
    """Return a function that says where a vehicle is at an instant, between rows of `tracks`."""
    tracks = result.tables["tracks"]
    lines = {
        str(name): track[["time_s", "x_m", "y_m", "z_m"]].to_numpy().T
        for name, track in tracks.groupby("vehicle")
    }

    def where(name: str, at_s: float) -> list[float]:
        times, *axes = lines[name]
        return [float(np.interp(at_s, times, axis)) for axis in axes]

    return where
