"""The time that a plan has, and how far it is in one line."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import monotonic

from ..campaigns.workers.batches import Row
from ..core.progress import ProgressLine

# Of the time, so much is for what the answer is doubted by, and so much to write it all down.
DOUBTING, WRITING = 0.15, 0.03


class Clock:
    """When a plan has to be done with what; it counts the missions meanwhile.

    The time `budget_s` (s) is counted from `began`, an instant of the clock `monotonic`.
    """

    def __init__(self, budget_s: float, began: float, *, quiet: bool) -> None:
        self.selected_by = began + (1 - DOUBTING - WRITING) * budget_s
        self.doubted_by = began + (1 - WRITING) * budget_s
        self.missions = 0
        self._doing = "proposing teams"
        self._line = ProgressLine(quiet=quiet)

    @property
    def is_late(self) -> bool:
        """Whether it is too late to select."""
        return monotonic() > self.selected_by

    @contextmanager
    def told(self) -> Iterator[None]:
        """Tell how far the plan is, and end the line."""
        try:
            yield
        finally:
            self._line.end(self._text)

    def begin(self, what: str) -> None:
        """Say what is done from now on."""
        self._doing = what
        self._line.tell(self._text)

    def note(self, rows: Sequence[Row]) -> None:
        """Count missions that have ended."""
        self.missions += len(rows)
        self._line.tell(self._text)

    def _text(self) -> str:
        left = max(self.doubted_by - monotonic(), 0.0)
        return f"{self._doing}: {self.missions} missions flown, at most {left:.0f} s left"
