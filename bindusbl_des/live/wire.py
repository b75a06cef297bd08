"""Modems on a wire: hosts outside speak with the modems of vehicles, over ports or terminals.

What a host says is heard at the instant of the mission at which it comes; what its modem says is
sent at once.  A port serves several hosts of one modem, each by lines of its own.
"""

from collections.abc import Callable, Sequence

from ..mission.mission import Mission
from ..protocol.access.hosted import Modem
from .readings import Earth, Reading
from .sinks import Ear, Sink

# A line whose end has not come is cut where it is longer (bytes).
LONGEST_LINE = 4096


class Wire:
    """The wire of one vehicle's modem; `catch_up` brings its mission to now."""

    def __init__(self, vehicle: str, make: str) -> None:
        self.vehicle, self.make, self.sent = vehicle, make, 0
        self._modem: Modem | None = None
        self._catch_up: Callable[[], None] = lambda: None

    def connect(
        self, mission: Mission, sink: Sink, catch_up: Callable[[], None],
        note: Callable[[float], None],
    ) -> None:  # fmt: skip
        """Join a modem of a mission to a sink.  Before a line is heard the mission is brought to
        now; of each line that is sent the instant is noted.
        """
        modem = self._modem = mission.modems[self.vehicle]
        self._catch_up = catch_up

        def say(line: bytes) -> None:
            note(modem.node.clock)
            sink.send(line)
            self.sent += 1

        modem.on_say = say

    def ear(self) -> Ear:
        """Return what takes the bytes of one host."""
        rest = b""

        def hear(data: bytes) -> None:
            nonlocal rest
            *lines, rest = (rest + data).split(b"\n")
            rest = rest[-LONGEST_LINE:]
            if self._modem is not None and lines:
                self._catch_up()
                for line in lines:
                    self._modem.hear(line.strip(b"\r"))

        return hear

    def __call__(self, reading: Reading, earth: Earth) -> Sequence[bytes]:
        """Say nothing of a reading: a modem knows what it measures."""
        return ()
