"""What the fleet knows that AUVs have: fixes that they have acknowledged, and since when."""

from collections.abc import Callable

import numpy as np

from ..core.arrays import Floats
from ..records.rows import EventBuffer


class Acknowledged:
    """Fixes, rows of the record, that the fleet knows to be delivered, and since when (s).

    What it hears late is looked up by `update` before somebody asks.
    """

    def __init__(self, fixes: EventBuffer, auvs: int) -> None:
        self._fixes = fixes
        self.since_s: dict[int, float] = {}
        self._newest = np.full((2, auvs), np.nan)  # of each AUV: since when, its ping
        self.update: Callable[[], None] = lambda: None

    def note(self, fix: int, time: float) -> None:
        """Note that the fleet hears at an instant (s) of an AUV that it has a fix."""
        if fix in self.since_s:
            return
        self.since_s[fix] = time
        row = self._fixes.array[fix]
        auv, pinged_at = int(row["auv"]), float(row["pinged_at_s"])
        if not pinged_at <= self._newest[1, auv]:
            self._newest[:, auv] = time, pinged_at

    def knows(self, fix: int) -> bool:
        """Tell whether it knows by now that an AUV has a fix."""
        self.update()
        return fix in self.since_s

    @property
    def at_s(self) -> Floats:
        """Since when (s) it knows of each AUV's newest fix that it knows of, (n,); NaN: of none."""
        self.update()
        return np.array(self._newest[0])

    @property
    def pinged_at_s(self) -> Floats:
        """When (s) that AUV sent the ping of that fix, (n,)."""
        self.update()
        return np.array(self._newest[1])


def known_by(acknowledged: Acknowledged | None) -> Acknowledged:
    """Return what AUVs have acknowledged.

    Raises:
        LookupError: where they do not acknowledge.
    """
    if acknowledged is None:
        raise LookupError(
            "AUVs acknowledge no fix, so that nobody knows what was delivered: set "
            "protocol.acknowledge to ping or frame"
        )
    return acknowledged
