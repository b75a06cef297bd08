"""How far a campaign is, in one line on stderr."""

import math
from collections.abc import Sequence
from time import monotonic
from typing import TextIO

from ...core.progress import ProgressLine, duration
from ..storage.parts import FAILED
from .batches import Row


class Progress:
    """Counts missions, and says so.

    Its rate is that of missions: the clock starts where the first one began, when a worker had been
    started and had its compiled code.
    """

    def __init__(self, total: int = 0, *, quiet: bool = True, stream: TextIO | None = None) -> None:
        self.total, self.ran, self.failed = total, 0, 0
        self._line = ProgressLine(quiet=quiet, stream=stream)
        self._began = math.inf

    def note(self, rows: Sequence[Row]) -> None:
        """Count the missions of a batch that has ended just now."""
        self.ran += len(rows)
        self.failed += sum(row.status == FAILED for row in rows)
        self._began = min(self._began, monotonic() - sum(row.wall_time_s for row in rows))
        self._line.tell(self.line)

    def end(self) -> None:
        """End the line that was redrawn."""
        self._line.end(self.line)

    def line(self) -> str:
        """Return what there is to say."""
        spent = monotonic() - self._began
        rate = self.ran / spent if spent > 0 else 0.0
        left = f", {duration((self.total - self.ran) / rate)} left" if rate else ""
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.ran}/{self.total} missions{failed}, {rate:.1f}/s{left}"
