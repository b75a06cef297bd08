"""An MCAP file that is being written, whatever its messages are."""

import errno
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import foxglove
from foxglove import Channel, Context
from foxglove.mcap import MCAPWriteOptions


class McapLog:
    """A file with a channel for each topic; on one topic log times rise by `apart_ns` at least."""

    def __init__(self, path: Path, options: MCAPWriteOptions, apart_ns: int) -> None:
        # A context of our own: no other sink of this process hears of the mission.
        context = Context()
        self.file: Any = foxglove.open_mcap(
            path, allow_overwrite=True, context=context, writer_options=options
        )
        self._context, self._apart_ns = context, apart_ns
        self._channels: dict[str, Channel] = {}
        self._latest: dict[str, int] = {}
        #: How many messages are on each topic.
        self.counts: Counter[str] = Counter()

    def write(self, topic: str, at_ns: int, data: Any, begin: Callable[..., Channel]) -> None:
        """Write a message; `begin` makes the channel of a topic, in a context."""
        if topic not in self._channels:
            self._channels[topic] = begin(topic, context=self._context)
            self._latest[topic] = -self._apart_ns
        self._latest[topic] = max(at_ns, self._latest[topic] + self._apart_ns)
        self.counts[topic] += 1
        self._channels[topic].log(data, log_time=self._latest[topic])

    def close(self) -> None:
        """End the file, so that it can be played.

        Raises:
            OSError: when the disk is full.
        """
        for channel in self._channels.values():
            channel.close()
        self._channels = {}
        done, self.file = self.file, None
        if done is not None:
            try:
                done.close()
            except RuntimeError as error:  # what could not be written before is told here alone
                raise OSError(errno.EIO, f"is the disk full? {error}") from error
