"""Fixes that AUVs have acknowledged, as the fleet knows them, and the fixes that it repeats."""

from collections.abc import Callable

import numpy as np

from ...support.arrays import Floats, Ints
from ..records.rows import EventBuffer


class Acknowledged:
    """The fixes that AUVs have acknowledged: by row of the record, since when (s) the fleet knows
    it.

    `update` notes the acknowledgements that came since its last call; each question below calls it.
    """

    def __init__(self, fixes: EventBuffer, auvs: int) -> None:
        self._fixes = fixes
        self.since_s: dict[int, float] = {}
        self._newest = np.full((2, auvs), np.nan)  # newest fix by AUV: known since, pinged at (s)
        self.update: Callable[[], None] = lambda: None

    def note(self, fix: int, time: float) -> None:
        """Note that the acknowledgement of a fix (its row) reaches the fleet at `time` (s)."""
        if fix in self.since_s:
            return
        self.since_s[fix] = time
        row = self._fixes.array[fix]
        auv, pinged_at = int(row["auv"]), float(row["pinged_at_s"])
        if not pinged_at <= self._newest[1, auv]:
            self._newest[:, auv] = time, pinged_at

    def knows(self, fix: int) -> bool:
        """Return whether the fleet knows by now that a fix was delivered."""
        self.update()
        return fix in self.since_s

    @property
    def at_s(self) -> Floats:
        """When (s) the fleet learned of each AUV's newest acknowledged fix, (n,), or NaN."""
        self.update()
        return np.array(self._newest[0])

    @property
    def pinged_at_s(self) -> Floats:
        """When (s) each AUV sent the ping of its newest acknowledged fix, (n,), or NaN."""
        self.update()
        return np.array(self._newest[1])


def known_by(acknowledged: Acknowledged | None) -> Acknowledged:
    """Return the store of acknowledged fixes.

    Raises:
        LookupError: where AUVs do not acknowledge.
    """
    if acknowledged is None:
        raise LookupError(
            "AUVs acknowledge no fix, so that nobody knows what was delivered: set "
            "protocol.acknowledge to ping or frame"
        )
    return acknowledged


class Repeating:
    """The last broadcast fix of each AUV, and how often it is still to be repeated.

    An AUV's newer fix replaces it, sent or not.  A fix that the fleet knows to be delivered
    (`acknowledged`, None: none is) is not repeated.
    """

    def __init__(
        self, fixes: EventBuffer, most: int | None, acknowledged: Acknowledged | None
    ) -> None:
        """Repeat each fix `most` times (None: until it is acknowledged)."""
        self._fixes, self._most, self._acknowledged = fixes, most, acknowledged
        self._looked = 0  # fixes before this one are noted
        self._newest: dict[int, tuple[int, int]] = {}  # by AUV: newest ping with a fix, that fix
        self._left: dict[int, int | None] = {}  # by fix: repetitions left

    def with_due(self, waiting: range, room: int | None) -> Ints:
        """Return the rows of the fixes to broadcast now, (k,): all `waiting`, sent for the first
        time, then those to be repeated, oldest first, at most `room` of these (None: all).
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
