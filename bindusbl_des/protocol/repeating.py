"""Which fixes are broadcast again: those that their AUVs may not have, and that are the newest."""

import numpy as np

from ..core.arrays import Ints
from ..records.rows import Recorder
from .acknowledged import Acknowledged


class Repeating:
    """The last fix of each AUV that was broadcast, and how often it is to be once more.

    A newer fix of its AUV replaces it, sent or not: an old one is worth less.  Of what the fleet
    knows to be delivered (`acknowledged`, None: nothing) nothing is repeated.
    """

    def __init__(
        self, record: Recorder, most: int | None, acknowledged: Acknowledged | None
    ) -> None:
        """Repeat each up to so many times (None: until it is acknowledged)."""
        self._record, self._most, self._acknowledged = record, most, acknowledged
        self._looked = 0  # at fixes before this one
        self._newest: dict[int, tuple[int, int]] = {}  # of each AUV: its ping, the fix
        self._left: dict[int, int | None] = {}  # of fixes that were sent

    def with_due(self, waiting: range, room: int | None) -> Ints:
        """Return fixes that are sent now for the first time, and behind them, the oldest first,
        those that are to be repeated, as many as there is `room` for (None: for any number).
        """
        fixes = self._record.fixes.rows
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
