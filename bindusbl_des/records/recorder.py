"""What happened, row by row, in the order in which it happened."""

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from ..core.growing import lengthened
from .columns import FIX_COLUMNS, PING_COLUMNS
from .events import Broadcast, Fix, Ping, Reception, Round

Rows = NDArray[np.float64]

# Rows for which a buffer has room at first; it doubles when it is full.
ROOM = 512


class EventBuffer:
    """Rows of one kind of event in one array, which compiled equations write to.

    Columns are those of :mod:`.columns`: the `told` first of them go into the event's table.  The
    array begins with the rows so far and is a new one when it has had to grow.
    """

    def __init__(self, event: type, columns: int = 0) -> None:
        self.told = len(fields(event))
        self.array = np.empty((ROOM, max(columns, self.told)))
        self.count = 0

    @property
    def rows(self) -> Rows:
        """The rows so far, shape (count, columns)."""
        return self.array[: self.count]

    def room_for(self, count: int) -> Rows:
        """Return the array with room for further rows after the first `self.count`."""
        if self.count + count > len(self.array):
            length = len(self.array)
            while self.count + count > length:
                length *= 2
            self.array = lengthened(self.rows, length)
        return self.array


@dataclass
class Recorder:
    """The event rows of one mission; it is told, it never asks.

    Pings, receptions and fixes are many: they are kept as numbers.  Without `everything` receptions
    out of range are not kept.
    """

    everything: bool = True
    rounds: list[Round] = field(default_factory=list)
    pings: EventBuffer = field(default_factory=lambda: EventBuffer(Ping, PING_COLUMNS))
    receptions: EventBuffer = field(default_factory=lambda: EventBuffer(Reception))
    broadcasts: list[Broadcast] = field(default_factory=list)
    fixes: EventBuffer = field(default_factory=lambda: EventBuffer(Fix, FIX_COLUMNS))
