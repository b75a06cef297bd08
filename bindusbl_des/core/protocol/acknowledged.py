"""What the fleet knows that AUVs have, since they have acknowledged it; what it repeats if not."""

from collections.abc import Callable

import numpy as np

from ...support.arrays import Floats, Ints
from ..records.rows import EventBuffer


class Acknowledged:
    """Fixes, rows of the record, that the fleet knows to be delivered, and since when (s).

    What it hears late is looked up by `update` before an answer.
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


class Repeating:
    """The last fix of each AUV that was broadcast, and how often it is to be once more.

    A newer fix of its AUV replaces it, sent or not: an old one is worth less.  Of what the fleet
    knows to be delivered (`acknowledged`, None: nothing) nothing is repeated.
    """

    def __init__(
        self, fixes: EventBuffer, most: int | None, acknowledged: Acknowledged | None
    ) -> None:
        """Repeat each up to so many times (None: until it is acknowledged)."""
        self._fixes, self._most, self._acknowledged = fixes, most, acknowledged
        self._looked = 0  # at fixes before this one
        self._newest: dict[int, tuple[int, int]] = {}  # of each AUV: its ping, the fix
        self._left: dict[int, int | None] = {}  # of fixes that were sent

    def with_due(self, waiting: range, room: int | None) -> Ints:
        """Return fixes that are sent now for the first time, and behind them, the oldest first,
        those that are to be repeated, as many as there is `room` for (None: for any number).
        """
        fixes = self._fixes.rows
        for fix in fixes[self._looked :]:
            auv, ping = int(fix["auv"]), int(fix["ping"])
            if ping > self._newest.get(auv, (-1, -1))[0]:
                self._newest[auv] = ping, int(fix["fix"])
        self._looked = len(fixes)
        newest = {fix for _, fix in self._newest.values()}
        self._left = {
            fix: left
            for fix, left in self._left.items()
            if fix in newest and not self._is_known(fix)
        }
        due = sorted(fix for fix, left in self._left.items() if left is None or left > 0)[:room]
        for fix in due:
            left = self._left[fix]
            self._left[fix] = None if left is None else left - 1
        self._left |= dict.fromkeys(waiting, self._most)
        return np.array([*waiting, *due], dtype=np.int64)

    def _is_known(self, fix: int) -> bool:
        return self._acknowledged is not None and self._acknowledged.knows(fix)
