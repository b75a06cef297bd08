"""What happened, row by row, in the order in which it happened."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core.growing import lengthened
from ..core.handed import Handed
from .events import Broadcast, Round
from .frames import Assignment
from .rows import FIX, FRAME_RECEPTION, PING, RECEPTION, Rows

# Rows for which a buffer has room at first; it doubles when it is full.
ROOM = 2048


class EventBuffer:
    """Records of one kind in one array, which compiled equations write to.

    The array begins with the rows so far and is a new one when it has had to grow.
    """

    def __init__(self, kind: np.dtype[Any]) -> None:
        self.array: Rows = np.empty(ROOM, dtype=kind)
        self.count = 0
        self._handed: list[tuple[Handed, str]] = []

    def hand_on(self, to: Handed, name: str) -> None:
        """Keep a field of what compiled code is handed what the array is."""
        self._handed.append((to, name))

    @property
    def rows(self) -> Rows:
        """The rows so far, shape (count,)."""
        return self.array[: self.count]

    def room_for(self, count: int) -> Rows:
        """Return the array with room for further rows after the first `self.count`."""
        if self.count + count > len(self.array):
            length = len(self.array)
            while self.count + count > length:
                length *= 2
            self.array = lengthened(self.rows, length)
            for handed, name in self._handed:
                handed.renew(name, self.array)
        return self.array


class Levers:
    """How fixes, row by row, depend on k errors that outlast them, where such errors are told.

    J along x and y, with its derivatives along x, along y and by each error behind it (n, 2, 4 k),
    and the covariance xx, yy, xy (n, 3), m2, that is not due to them.
    """

    def __init__(self, columns: int) -> None:
        """Have J of k columns."""
        self.columns = columns
        self.of, self.left = np.empty((0, 2, 4 * columns)), np.empty((0, 3))
        self._handed: list[Handed] = []

    def hand_on(self, to: Handed) -> None:
        """Keep the fields `levers` and `left` of what compiled code is handed what both are."""
        self._handed.append(to)

    def make_room(self, rows: int) -> None:
        """Have room for so many rows."""
        if rows > len(self.of):
            self.of, self.left = lengthened(self.of, rows), lengthened(self.left, rows)
            for handed in self._handed:
                handed.renew("levers", self.of)
                handed.renew("left", self.left)


@dataclass
class Recorder:
    """The event rows of one mission; it is told, it never asks.

    Pings, receptions and fixes are many: they are kept as records (:mod:`.rows`).  Without
    `everything` receptions out of range are not kept, and of frames only those destroyed.
    """

    everything: bool = True
    rounds: list[Round] = field(default_factory=list)
    pings: EventBuffer = field(default_factory=lambda: EventBuffer(PING))
    receptions: EventBuffer = field(default_factory=lambda: EventBuffer(RECEPTION))
    broadcasts: list[Broadcast] = field(default_factory=list)
    frame_receptions: EventBuffer = field(default_factory=lambda: EventBuffer(FRAME_RECEPTION))
    assignments: list[Assignment] = field(default_factory=list)
    fixes: EventBuffer = field(default_factory=lambda: EventBuffer(FIX))
    levers: Levers = field(default_factory=lambda: Levers(0))
