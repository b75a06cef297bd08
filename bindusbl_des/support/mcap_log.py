"""An MCAP file that is being written, with messages of any kind."""

import errno
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import foxglove
from foxglove import Channel, Context
from foxglove.mcap import MCAPWriteOptions


class McapLog:
    """A file with a channel for each topic, whose log times are at least `apart_ns` apart."""

    def __init__(self, path: Path, options: MCAPWriteOptions, apart_ns: int) -> None:
        # A separate context: other sinks of this process do not get these messages.
        context = Context()
        self.file: Any = foxglove.open_mcap(
            path, allow_overwrite=True, context=context, writer_options=options
        )
        self._context, self._apart_ns = context, apart_ns
        self._channels: dict[str, Channel] = {}
        self._latest: dict[str, int] = {}
        #: The number of messages of each topic.
        self.counts: Counter[str] = Counter()

    def write(self, topic: str, at_ns: int, data: Any, begin: Callable[..., Channel]) -> None:
        """Write a message; `begin(topic, context=...)` makes the channel of a new topic."""
        if topic not in self._channels:
            self._channels[topic] = begin(topic, context=self._context)
            self._latest[topic] = -self._apart_ns
        self._latest[topic] = max(at_ns, self._latest[topic] + self._apart_ns)
        self.counts[topic] += 1
        self._channels[topic].log(data, log_time=self._latest[topic])

    def close(self) -> None:
        """End the file, so that players can open it.

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
            except RuntimeError as error:  # the only report of earlier failures to write
                raise OSError(errno.EIO, f"is the disk full? {error}") from error
