"""What the surface fleet does with the pings it has heard: collect them, or answer at once."""

from collections.abc import Sequence

from .downlink import MfDownlink
from .events import Broadcast, Fix
from .fixing import UsblFleet
from .fleet import Asv
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
        return [self._usbls.fix(flight, flight.heard) for flight in flights]


class ReplyBoard:
    """No waiting: the first ASV that decodes a ping answers it with a fix of its own."""

    def __init__(
        self, usbls: UsblFleet, asvs: Sequence[Asv], downlink: MfDownlink, record: Recorder
    ) -> None:
        self._usbls, self._asvs = usbls, asvs
        self._downlink, self._record = downlink, record

    def settled(self, flight: Flight) -> None:
        """Answer a ping when it has just been heard for the first time."""
        if flight.ping.heard_by != 1 or flight.answered:
            return
        flight.answered = True
        arrival, noise = flight.heard[0]
        fix = self._usbls.fix(flight, [(arrival, noise)])
        time, asv = arrival.arrived_at_s, self._asvs[arrival.asv]
        self._record.broadcasts.append(Broadcast(flight.ping.round, asv.index, time, 0.0, 0, 1))
        self._record.rounds[flight.ping.round].fixes += 1
        self._downlink.reply(fix, asv, time)

    def take(self) -> list[Fix]:
        """Return no fixes: none has to wait."""
        return []
