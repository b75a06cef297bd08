"""Messages on a band: how long each is on the air, when it is delivered, and what it holds."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from ...models.presets.modems import AirtimeTable, airtime_table
from ..scenario.sections.acoustics import Downlink


def payload_bytes(fix_count: int, header: int = 8, record: int = 16) -> int:
    """Return the bytes of a broadcast of `fix_count` fixes (eq. payload).

    >>> payload_bytes(3)
    56
    """
    return header + fix_count * record


def airtime(size_bytes: int, bit_rate: float = 2000.0, overhead: float = 2.0) -> float:
    """Return how long (s) a payload (bytes) occupies the downlink (bit/s), T_tx (eq. Ttx).

    `overhead` is how many bits are sent for each bit of the payload.

    >>> airtime(payload_bytes(3))
    0.448
    """
    return size_bytes * 8 * overhead / bit_rate


@dataclass(frozen=True)
class Modem:
    """A modem by its bit rate (bit/s) and overhead, or by a table of airtimes if it has one.

    A receiver's modem delivers a message `processing` (s) after its end; None: as the table says.
    """

    bit_rate: float
    overhead: float
    table: AirtimeTable | None = None
    processing: float | None = None

    def airtime(self, size_bytes: int) -> float:
        """Return how long (s) a message is on the air; an empty one counts as one byte."""
        if self.table is not None:
            return self.table.airtime(max(size_bytes, 1))
        return airtime(size_bytes, self.bit_rate, self.overhead)

    def delay(self, size_bytes: int) -> float:
        """Return how long (s) after its end the modem delivers a message."""
        if self.processing is not None:
            return self.processing
        return 0.0 if self.table is None else self.table.delay(max(size_bytes, 1))


class Message(NamedTuple):
    """One message: the number of fixes that it carries, and of AUVs whose slots it announces; its
    size (B), its airtime (s), and how long after its end the modem delivers it (s).
    """

    fixes: int
    named: int
    size_bytes: int
    airtime_s: float
    delay_s: float


@dataclass(frozen=True)
class Messages:
    """The messages in which fixes are broadcast: a header and a record for each fix.

    With more fixes than `most` (None: no limit) a broadcast is several messages in a row, if it
    `splits`; else it carries the oldest and leaves the rest to the next.  Records of
    `assignment_bytes`, which announce slots, precede the fixes; a message holds `room` (B) for
    both.
    """

    modem: Modem
    header_bytes: int
    fix_bytes: int
    most: int | None
    splits: bool
    room: int | None = None
    assignment_bytes: int = 0
    _packed: dict[tuple[int, int], tuple[Message, ...]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def of(self, fix_count: int) -> list[int]:
        """Return the number of fixes in each message of a broadcast."""
        if self.most is None or fix_count <= self.most:
            return [fix_count]
        if not self.splits:
            return [self.most]
        full, rest = divmod(fix_count, self.most)
        return [self.most] * full + [rest] * (rest > 0)

    def packed(self, fixes: int, named: int = 0) -> tuple[Message, ...]:
        """Return the messages of a broadcast that announces the slots of `named` AUVs.

        >>> messages = Messages(Modem(2000.0, 2.0), 8, 16, 3, True, room=50, assignment_bytes=4)
        >>> [(sent.fixes, sent.named, sent.size_bytes) for sent in messages.packed(4, 5)]
        [(1, 5, 44), (3, 0, 56)]
        """
        found = self._packed.get((fixes, named))  # the same for many broadcasts
        if found is None:
            found = self._packed[fixes, named] = tuple(self._filled(fixes, named))
        return found

    def _filled(self, fixes: int, named: int) -> Iterator[Message]:
        parts = [(carried, named) for carried in self.of(fixes)]
        if named and self.room is not None:
            parts, each = [], self.assignment_bytes
            while fixes or named:
                now = min(named, self.room // each) if each else named
                carried = min(fixes, (self.room - now * each) // self.fix_bytes)
                parts.append((carried, now))
                fixes, named = fixes - carried, named - now
        for carried, now in parts:
            size = self.payload_bytes(carried, now)
            yield Message(carried, now, size, self.modem.airtime(size), self.modem.delay(size))

    def payload_bytes(self, fixes: int, named: int = 0) -> int:
        """Return the bytes of one message of `fixes` fixes and the slots of `named` AUVs."""
        assigned = named * self.assignment_bytes
        return payload_bytes(fixes, self.header_bytes, self.fix_bytes) + assigned

    def airtime(self, fixes: int, named: int = 0) -> float:
        """Return the airtime (s) of one such message."""
        return self.modem.airtime(self.payload_bytes(fixes, named))

    def delay(self, fixes: int, named: int = 0) -> float:
        """Return how long (s) after its end the modem delivers one such message."""
        return self.modem.delay(self.payload_bytes(fixes, named))


def messages_of(mf: Downlink, assignment_bytes: int = 0, told: int = 0) -> Messages:
    """Return the messages of a downlink, which announce the slots of `told` AUVs by records of
    `assignment_bytes` each.
    """
    table = None if mf.airtimes is None else airtime_table(mf.airtimes)
    modem = Modem(mf.bit_rate_bps, mf.overhead, table, mf.processing_s)
    size = mf.payload_bytes if table is None else mf.payload_bytes or table.most_bytes
    splits, room, most = mf.overfull == "split", None, None
    if size is not None:
        room = size - mf.header_bytes
        # a broadcast that is not split announces all slots in its one message
        reserved = 0 if splits else assignment_bytes * told
        most = (room - reserved) // mf.fix_bytes
    return Messages(modem, mf.header_bytes, mf.fix_bytes, most, splits, room, assignment_bytes)
