"""Where vehicles are at instants that one mission after the other asks for."""

from typing import NamedTuple

import numpy as np

from .motion import PLACE, Floats, Motion, lines

# So much at most (bytes) is kept of one fleet: ten vehicles for 300 s at 30 Hz, not a thousand.
MOST_BYTES = 8_000_000


class Way(NamedTuple):
    """A vehicle at n instants (n,), s: x, y, z (m), yaw (rad), the integrals of the cosine and
    sine of its yaw (s), and these two, `lines` (n, 8).
    """

    times: Floats
    lines: Floats

    @property
    def truth(self) -> Floats:
        """True x, y, z (m) and yaw (rad), (n, 4)."""
        return self.lines[:, PLACE]


class Ways:
    """The ways of a fleet; what is asked for again is kept, where the motion is known to its end.

    Instants that will be asked for again are read-only, and always the same array.
    """

    def __init__(self, motion: Motion, *, foreseen: bool) -> None:
        self._motion, self._room = motion, MOST_BYTES if foreseen else 0
        self._kept: dict[tuple[int, int], tuple[Floats, Way]] = {}

    def of(self, vehicle: int, times: Floats) -> Way:
        """Return the way of a vehicle at instants (s), by which its motion is known."""
        asked, found = self._kept.get((vehicle, id(times)), (None, None))
        if asked is times and found is not None:
            return found
        own = np.array(times, dtype=np.float64)  # as code for what is read-only is another
        way = Way(own, lines(*self._motion, vehicle, own))
        size = sum(column.nbytes for column in way)
        if size <= self._room and not times.flags.writeable:
            self._kept[vehicle, id(times)] = times, way
            self._room -= size
        return way
