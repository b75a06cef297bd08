"""What the surface fleet does with the pings it has heard: collect them, or answer at once."""

from .downlink import MfDownlink
from .events import IN_FLIGHT, Broadcast, Fix
from .propagation import ARRIVED_AT, OUTCOME
from .recorder import Recorder
from .uplink import Heard, Passes


def fix_of(heard: Heard, record: Recorder) -> Fix:
    """Record the fix of a ping, of the instant at which it was sent."""
    flight, asvs = heard.flight, " ".join([f"ASV{asv}" for asv in heard.asvs])
    x, y, z, sd_x, sd_y, sd_z, xy, xz, yz, error = heard.estimate
    fix = Fix(
        len(record.fixes), flight.ping, flight.round, flight.auv, asvs, flight.sent_at,
        x, y, z, sd_x, sd_y, sd_z, xy, xz, yz, error,
    )  # fmt: skip
    record.fixes.append(fix)
    return fix


class Board:
    """The fleet's shared board: heard pings wait here for the next broadcast."""

    def __init__(self, record: Recorder) -> None:
        self._record = record
        self._heard: list[Heard] = []

    def expect(self, passes: Passes, rows: range, ends: float) -> None:
        """Wait until a ping has passed every ASV in range; they measure it together."""
        passes(rows, ends)

    def hear(self, heard: Heard) -> None:
        """Note a ping on the board."""
        self._heard.append(heard)

    def take(self) -> list[Fix]:
        """Return the fixes of all pings on the board and clear it."""
        heard, self._heard = self._heard, []
        return [fix_of(ping, self._record) for ping in heard]


class ReplyBoard:
    """No waiting: the first ASV that decodes a ping answers it with a fix of its own."""

    def __init__(self, downlink: MfDownlink, record: Recorder, ping_duration: float) -> None:
        self._downlink, self._record, self._duration = downlink, record, ping_duration

    def expect(self, passes: Passes, rows: range, ends: float) -> None:
        """Wait for a ping at each ASV in range by itself."""
        for row in rows:
            reception = self._record.receptions.array[row]
            if reception[OUTCOME] == IN_FLIGHT:
                passes(range(row, row + 1), float(reception[ARRIVED_AT]) + self._duration)

    def hear(self, heard: Heard) -> None:
        """Answer a ping when it has just been heard for the first time."""
        flight = heard.flight
        if flight.answered:
            return
        flight.answered = True
        fix, [asv] = fix_of(heard, self._record), heard.asvs
        time = float(self._record.receptions.array[heard.rows.start, ARRIVED_AT])
        self._record.broadcasts.append(Broadcast(flight.round, asv, time, 0.0, 0, 1))
        self._record.rounds[flight.round].fixes += 1
        self._downlink.reply(fix, asv, time)

    def take(self) -> list[Fix]:
        """Return no fixes: none has to wait."""
        return []
