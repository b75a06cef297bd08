"""Modems on a wire: hosts outside speak with the modems of vehicles, over ports or terminals.

What a host says is heard at the instant of the mission at which it comes; what its modem says is
sent at once.  A port serves several hosts of one modem, each by lines of its own.
"""

from collections.abc import Callable, Sequence

from ...core.protocol.access.hosted import Modem
from .readings import Earth, Reading
from .sinks import Ear

# A line whose end has not come is cut where it is longer (bytes).
LONGEST_LINE = 4096


class Wire:
    """The wire of one vehicle's modem.  Nothing is heard before it is connected."""

    def __init__(self, vehicle: str) -> None:
        self.vehicle = vehicle
        self._modem: Modem | None = None
        self._catch_up: Callable[[], None] = lambda: None

    def connect(
        self, modem: Modem, send: Callable[[bytes, float], None], catch_up: Callable[[], None]
    ) -> None:
        """Join it to a modem, which sends lines, each at an instant (s) of its mission; `catch_up`
        brings that to now, before a line is heard.
        """
        self._modem, self._catch_up = modem, catch_up
        modem.on_say = lambda line: send(line, modem.node.clock)

    def ear(self) -> Ear:
        """Return what takes the bytes of one host."""
        rest = b""

        def hear(data: bytes) -> None:
            nonlocal rest
            if self._modem is None:
                return
            lines, rest = self._modem.lines_of(rest + data)
            rest = rest[-LONGEST_LINE:]
            if lines:
                self._catch_up()
            for line in filter(None, lines):
                self._modem.hear(line)

        return hear

    def __call__(self, reading: Reading, earth: Earth) -> Sequence[bytes]:
        """Say nothing of a reading: a modem says what it measures itself."""
        return ()
