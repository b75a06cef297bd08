"""The fixes of a broadcast: where their pings came from, and who heard these."""

import numpy as np
from numpy.typing import NDArray

from ..records.events import HEARD
from ..records.recorder import Recorder
from ..records.rows import Rows


class FixBatch:
    """The fixes that one broadcast carries: `rows` of the record, by number."""

    def __init__(self, record: Recorder, rows: range) -> None:
        self.rows, self._record = rows, record

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def _fixes(self) -> Rows:
        return self._record.fixes.array[self.rows.start : self.rows.stop]

    @property
    def positions(self) -> NDArray[np.float64]:
        """x, y, z (m) of each fix, shape (k, 3)."""
        fixes = self._fixes
        return np.column_stack((fixes["x_m"], fixes["y_m"], fixes["z_m"]))

    def hearers(self, asvs: int) -> NDArray[np.bool_]:
        """Return whose measurements were fused for each fix, shape (k, `asvs`)."""
        fused = np.zeros((len(self.rows), asvs), dtype=np.bool_)
        if len(self.rows):
            fixes = self._fixes
            begin = int(fixes["first"].min())
            receptions = self._record.receptions.array[begin : int(fixes["end"].max())]
            heard = np.flatnonzero(receptions["outcome"] == HEARD)
            first = np.searchsorted(heard, fixes["first"] - begin)
            end = np.searchsorted(heard, fixes["end"] - begin)
            before = np.repeat(np.cumsum(end - first) - end, end - first)
            rows = heard[np.arange(len(before)) - before]
            fix = np.repeat(np.arange(len(fixes)), end - first)
            fused[fix, receptions["asv"][rows]] = True
        return fused
