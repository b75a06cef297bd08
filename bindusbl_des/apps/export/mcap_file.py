"""A mission as one MCAP file, for Foxglove, Lichtblick and PlotJuggler: the vehicles, and what is
heard (rays of pings, broadcasts, fixes with their uncertainty).
"""

import heapq
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from foxglove import Channel, Context
from foxglove.mcap import MCAPWriteOptions
from foxglove.messages import Duration, SpherePrimitive, Vector3

from ...core.results.result import scenario_sha256
from ...support.files import draft_of
from ...support.kept_files import portable
from ...support.mcap_log import McapLog
from ...support.palette import MF_ON_DARK
from .messages import (
    MAP,
    Messages,
    ViewerMessage,
    colour,
    fix_covariance,
    json_schema,
    location_streams,
    nanoseconds,
    order_by,
    row_streams,
    rows_in_time,
    timestamp,
    transforms,
)
from .scenery import (
    ELLIPSE_SCALE,
    auv_colour,
    certainty,
    ellipse,
    line,
    rays,
    ring,
    scenery,
    update,
    upright,
)

if TYPE_CHECKING:
    from ...core.results.result import Result


FRAMES_TOLD = (
    "Messages with a Foxglove schema: east, north, up (ENU, m) in the frame 'map', whose origin is "
    "x = y = 0 at the surface; vehicles x forward, y to port, z up. JSON rows: the "
    "tables' columns, north, east, down (NED)."
)

# How long a ping and a fix stay in sight (s): sound crosses the HF range within a frame of video.
PING_LASTS, FIX_LASTS = 0.5, 5.0

# What became of a ping at an ASV, and at all: Okabe-Ito colours
OUTCOMES = {"heard": "#009E73", "lost": "#D55E00", "collided": "#CC79A7", "in_flight": "#F0E442"}
UNHEARD = "#808080"


def write_mcap(result: "Result", path: Path, *, replace: bool = True) -> Mapping[str, int]:
    """Write a mission as an MCAP file; return the number of messages on each topic.

    Log times are mission times in nanoseconds from 0; on one topic they rise strictly, what falls
    on the same instant follows in steps of 1 ns.  The file appears when it is whole.

    Raises:
        KeyError: when the result holds metrics only (`record.detail: summary`).
        FileExistsError: when the file is there, and not to be replaced.
        OSError: when it cannot be written.
    """
    streams = [scenery(result), transforms(result), certainty(result)]
    streams += [_pings(result), _broadcasts(result), _fixes(result)]
    streams += [*location_streams(result), *row_streams(result)]
    with draft_of(path, replace=replace) as draft:
        log = McapLog(draft, MCAPWriteOptions(profile="", compression_threads=0), apart_ns=1)
        try:
            for message in heapq.merge(*streams, key=lambda message: message.at_s):
                _write(log, message)
            _describe(log, result)
        finally:
            log.close()
    return log.counts


def _pings(result: "Result") -> Messages:
    """Yield each ping as it is sent: a dot, and a ray to whoever is in range by its outcome."""
    where, protocol = _vehicles(result), result.scenario.protocol
    drawn_to = pc.is_in(result.arrow["receptions"]["outcome"], pa.array(list(OUTCOMES)))
    columns = ["ping", protocol.listening, "outcome", "arrived_at_s"]
    arrivals = result.arrow["receptions"].select(columns).filter(drawn_to)
    arrivals = arrivals.filter(arrivals["arrived_at_s"].is_valid())
    arrivals = arrivals.combine_chunks().take(order_by(arrivals, "ping"))
    numbers = arrivals["ping"].to_numpy()
    size = Vector3(x=1.5, y=1.5, z=1.5)
    for row in rows_in_time(result.arrow["pings"], "sent_at_s"):
        at_s, source = row["sent_at_s"], [row["x_m"], row["y_m"], row["z_m"]]
        first, end = np.searchsorted(numbers, [row["ping"], row["ping"] + 1]).tolist()
        heard = arrivals.slice(first, end - first).to_pylist()
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
    circle = ring(result.setup.horizontal_mf_reach_m, colour(MF_ON_DARK), width=3.0)
    for row in rows_in_time(result.arrow["broadcasts"], "sent_at_s"):
        at_s, name, lasts = row["sent_at_s"], row["asv"], row["airtime_s"]
        yield _shown(at_s, "/scene/broadcasts", name, name, lasts, {"lines": [circle]})


def _fixes(result: "Result") -> Messages:
    """Yield each fix at its ping: the ellipse that holds the AUV with 95 %, grey if it was lost."""
    for row in rows_in_time(result.arrow["fixes"], "pinged_at_s"):
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


def _write(log: McapLog, message: ViewerMessage) -> None:
    """Write a message of Foxglove's, or a row as JSON."""
    topic, at_ns, content = message.topic, nanoseconds(message.at_s), message.content

    def begin(topic: str, context: Context) -> Channel:
        if isinstance(content, dict):
            schema = json_schema(topic.rpartition("/")[2])
            return Channel(topic, schema=schema, context=context)
        schema = type(content).get_schema()
        return Channel(topic, schema=schema, message_encoding="protobuf", context=context)

    log.write(topic, at_ns, content if isinstance(content, dict) else content.encode(), begin)


def _describe(log: McapLog, result: "Result") -> None:
    """Say in the file what it shows, and with it the scenario."""
    log.file.write_metadata(
        "bindusbl",
        {
            "scenario": result.scenario.name,
            "scenario_sha256": scenario_sha256(result.scenario),
            "seed": str(result.seed),
            "time": "log time is mission time in nanoseconds; the mission begins at 0",
            "frames": FRAMES_TOLD,
        },
    )
    log.file.attach(
        log_time=0,
        create_time=0,
        name="scenario.json",
        media_type="application/json",
        data=json.dumps(portable(result.scenario.model_dump(mode="json")), indent=2).encode(),
    )
