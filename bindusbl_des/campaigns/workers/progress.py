"""How far a campaign is, in one line on stderr."""

import sys
from time import monotonic
from typing import TextIO

from ..storage.parts import FAILED
from .batches import Row

LINE_EVERY_S = 10.0
REDRAWN_EVERY_S = 0.2


class Progress:
    """Counts missions; says so in one line that is redrawn, or in a line now and then."""

    def __init__(self, total: int = 0, *, quiet: bool = True, stream: TextIO | None = None) -> None:
        self.total, self.ran, self.failed = total, 0, 0
        self._stream = stream or sys.stderr
        self._quiet = quiet
        self._redrawn = self._stream.isatty()
        self._began = self._told = monotonic()

    def note(self, row: Row) -> None:
        """Count a mission that has its row."""
        self.ran += 1
        self.failed += row.status == FAILED
        every = REDRAWN_EVERY_S if self._redrawn else LINE_EVERY_S
        if monotonic() - self._told >= every:
            self._tell()

    def end(self) -> None:
        """End the line that was redrawn."""
        if self._redrawn and not self._quiet:
            self._tell()
            self._stream.write("\n")

    def _tell(self) -> None:
        self._told = monotonic()
        if self._quiet:
            return
        start, end = ("\r", "\x1b[K") if self._redrawn else ("", "\n")
        self._stream.write(f"{start}{self.line()}{end}")
        self._stream.flush()

    def line(self) -> str:
        """Return what there is to say."""
        spent = monotonic() - self._began
        rate = self.ran / spent if spent else 0.0
        left = duration((self.total - self.ran) / rate) if rate else "?"
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.ran}/{self.total} missions{failed}, {rate:.1f}/s, {left} left"


def duration(seconds: float) -> str:
    """Return a time as people say it.

    >>> duration(4.2), duration(75), duration(7500)
    ('4 s', '1 min 15 s', '2 h 5 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
