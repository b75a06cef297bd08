"""A mission as one MCAP file, for Foxglove, Lichtblick and PlotJuggler."""

import errno
import heapq
import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import foxglove
from foxglove import Channel, Context
from foxglove.mcap import MCAPWriteOptions

from ..core.files import draft_of
from ..core.kept_files import portable
from ..results.result import scenario_sha256
from .messages import (
    ViewerMessage,
    json_schema,
    location_streams,
    nanoseconds,
    row_streams,
    transforms,
)
from .scenery import certainty, scenery
from .sound import sound_streams

if TYPE_CHECKING:
    from ..results.result import Result

FRAMES_TOLD = (
    "Messages with a Foxglove schema: east, north, up (ENU, m) in the frame 'map', whose origin is "
    "x = y = 0 at the surface; vehicles x forward, y to port, z up. JSON rows: the "
    "tables' columns, north, east, down (NED)."
)


def write_mcap(result: "Result", path: Path, *, replace: bool = True) -> Mapping[str, int]:
    """Write a mission as an MCAP file; return the number of messages on each topic.

    Log times are mission times in nanoseconds from 0; on one topic they rise strictly, what falls
    on the same instant follows in steps of 1 ns.  The file appears when it is whole.

    Raises:
        KeyError: when the result holds metrics only (`record.detail: summary`).
        FileExistsError: when the file is there, and not to be replaced.
        OSError: when it cannot be written.
    """
    streams = [scenery(result), transforms(result), certainty(result), *sound_streams(result)]
    streams += [*location_streams(result), *row_streams(result)]
    with draft_of(path, replace=replace) as draft:
        log = _Log(draft)
        try:
            for message in heapq.merge(*streams, key=lambda message: message.at_s):
                log.write(message)
            log.describe(result)
        finally:
            log.close()
    return log.counts


class _Log:
    """An MCAP file that is being written: one channel per topic."""

    def __init__(self, path: Path) -> None:
        # A context of our own: no other sink of this process hears of the mission.
        self._context = Context()
        self._file = foxglove.open_mcap(
            path,
            allow_overwrite=True,
            context=self._context,
            writer_options=MCAPWriteOptions(profile="", compression_threads=0),
        )
        self._channels: dict[str, Channel] = {}
        self._latest: dict[str, int] = {}
        self.counts: Counter[str] = Counter()

    def write(self, message: ViewerMessage) -> None:
        topic, content = message.topic, message.content
        if topic not in self._channels:
            self._channels[topic] = self._channel(topic, content)
        at = max(nanoseconds(message.at_s), self._latest.get(topic, -1) + 1)
        self._latest[topic] = at
        self.counts[topic] += 1
        data = content if isinstance(content, dict) else content.encode()
        self._channels[topic].log(data, log_time=at)

    def _channel(self, topic: str, content: Any) -> Channel:
        if isinstance(content, dict):
            schema = json_schema(topic.rpartition("/")[2])
            return Channel(topic, schema=schema, context=self._context)
        schema = type(content).get_schema()
        return Channel(topic, schema=schema, message_encoding="protobuf", context=self._context)

    def describe(self, result: "Result") -> None:
        """Say in the file what it shows, and with it the scenario."""
        self._file.write_metadata(
            "bindusbl",
            {
                "scenario": result.scenario.name,
                "scenario_sha256": scenario_sha256(result.scenario),
                "seed": str(result.seed),
                "time": "log time is mission time in nanoseconds; the mission begins at 0",
                "frames": FRAMES_TOLD,
            },
        )
        self._file.attach(
            log_time=0,
            create_time=0,
            name="scenario.json",
            media_type="application/json",
            data=json.dumps(portable(result.scenario.model_dump(mode="json")), indent=2).encode(),
        )

    def close(self) -> None:
        for channel in self._channels.values():
            channel.close()
        try:
            self._file.close()
        except RuntimeError as error:  # what could not be written before is told here alone
            raise OSError(errno.EIO, f"is the disk full? {error}") from error
