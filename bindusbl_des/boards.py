"""What the surface fleet does with the pings it has heard: collect them, or answer at once."""

from .downlink import MfDownlink
from .events import Broadcast, Fix
from .fixing import UsblFleet
from .propagation import ARRIVED_AT
from .recorder import Recorder
from .uplink import Flight


class Board:
    """The fleet's shared board: heard pings wait here for the next broadcast."""

    def __init__(self, usbls: UsblFleet) -> None:
        self._usbls = usbls
        self._heard: list[Flight] = []

    def settled(self, flight: Flight) -> None:
        """Note a ping once its fate at every ASV in range is known."""
        if flight.pending == 0 and flight.heard:
            self._heard.append(flight)

    def take(self) -> list[Fix]:
        """Return the fixes of all pings on the board and clear it."""
        flights, self._heard = self._heard, []
        return self._usbls.fix(flights)


class ReplyBoard:
    """No waiting: the first ASV that decodes a ping answers it with a fix of its own."""

    def __init__(self, usbls: UsblFleet, downlink: MfDownlink, record: Recorder) -> None:
        self._usbls, self._downlink, self._record = usbls, downlink, record

    def settled(self, flight: Flight) -> None:
        """Answer a ping when it has just been heard for the first time."""
        if len(flight.heard) != 1 or flight.answered:
            return
        flight.answered = True
        [fix] = self._usbls.fix([flight])
        asv, row, *_ = flight.heard[0]
        time = float(self._record.receptions.array[row, ARRIVED_AT])
        self._record.broadcasts.append(Broadcast(flight.round, asv, time, 0.0, 0, 1))
        self._record.rounds[flight.round].fixes += 1
        self._downlink.reply(fix, asv, time)

    def take(self) -> list[Fix]:
        """Return no fixes: none has to wait."""
        return []
