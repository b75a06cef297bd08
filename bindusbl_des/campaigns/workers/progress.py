"""How far a campaign is, in one line on stderr."""

from time import monotonic
from typing import TextIO

from ...core.progress import ProgressLine, duration
from ..storage.parts import FAILED
from .batches import Row


class Progress:
    """Counts missions, and says so."""

    def __init__(self, total: int = 0, *, quiet: bool = True, stream: TextIO | None = None) -> None:
        self.total, self.ran, self.failed = total, 0, 0
        self._line = ProgressLine(quiet=quiet, stream=stream)
        self._began = monotonic()

    def note(self, row: Row) -> None:
        """Count a mission that has its row."""
        self.ran += 1
        self.failed += row.status == FAILED
        self._line.tell(self.line)

    def end(self) -> None:
        """End the line that was redrawn."""
        self._line.end(self.line)

    def line(self) -> str:
        """Return what there is to say."""
        spent = monotonic() - self._began
        rate = self.ran / spent if spent else 0.0
        left = duration((self.total - self.ran) / rate) if rate else "?"
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.ran}/{self.total} missions{failed}, {rate:.1f}/s, {left} left"
