"""How far long work is, in one line on stderr."""

import sys
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import TextIO

LINE_EVERY_S = 10.0
REDRAWN_EVERY_S = 0.2

# Work that ends before this is not worth a word.
PATIENCE_S = 2.0


class ProgressLine:
    """A line that is redrawn on a terminal, and written anew now and then elsewhere.

    One that is only `on_terminals` is not written elsewhere.
    """

    def __init__(
        self, *, quiet: bool, stream: TextIO | None = None, on_terminals: bool = False
    ) -> None:
        self._stream = stream or sys.stderr
        self._redrawn = self._stream.isatty()
        self._quiet = quiet or (on_terminals and not self._redrawn)
        self._every = REDRAWN_EVERY_S if self._redrawn else LINE_EVERY_S
        self._drawn = False
        self._due = monotonic() + PATIENCE_S

    def tell(self, line: Callable[[], str]) -> None:
        """Say how far the work is, if that was not just said."""
        if monotonic() >= self._due:
            self._tell(line())

    def end(self, line: Callable[[], str]) -> None:
        """Say how far the work has come, and end the line that was redrawn."""
        if self._redrawn and self._drawn:
            self._tell(line())
            self._write("\n")

    def clear(self) -> None:
        """Take back the line that was redrawn: another will say more, or nothing is left to say."""
        if self._redrawn and self._drawn:
            self._write("\r\x1b[K")

    def _tell(self, line: str) -> None:
        self._due = monotonic() + self._every
        if self._quiet:
            return
        self._drawn = True
        start, end = ("\r", "\x1b[K") if self._redrawn else ("", "\n")
        self._write(f"{start}{line}{end}")

    def _write(self, text: str) -> None:
        with suppress(OSError):  # work goes on when nobody reads how far it is
            self._stream.write(text)
            self._stream.flush()


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
