"""Modems on a wire: hosts outside speak with the modems of vehicles, over a port or a terminal.

What a host says is obeyed at the instant of the mission at which it comes, and put on record; what
its modem says is sent at once.  A port serves several hosts of one modem, each by lines of its own.
"""

import socket
from collections.abc import Callable, Mapping
from typing import NamedTuple

from ..protocol.access.hosted import Modem
from .sinks import Port, Say, Sink, Terminal

# A line whose end has not come is cut where it is longer (bytes).
LONGEST_LINE = 4096

# Lines that one look takes from a host; what else it says waits.
LINES = 64


class Lines:
    """The lines (bytes, without their ends) of one host, as its bytes come."""

    def __init__(self, obey: Callable[[bytes], None]) -> None:
        self._obey, self._rest = obey, b""

    def feed(self, data: bytes) -> None:
        """Take bytes; each line that is whole is obeyed."""
        *lines, rest = (self._rest + data).split(b"\n")
        self._rest = rest[-LONGEST_LINE:]
        for line in lines:
            self._obey(line.strip(b"\r"))
