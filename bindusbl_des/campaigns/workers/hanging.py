"""Missions that never end: the process that runs one is ended, and leaves where it hung."""

import faulthandler
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def limited(folder: Path, mission: int, seconds: float | None) -> Iterator[None]:
    """End this process when what is done here takes longer, wherever it hangs.

    There is one limit for a process: missions with a limit must not run in several of its threads.
    """
    if seconds is None:
        yield
        return
    mark = _mark(folder, mission)
    mark.parent.mkdir(exist_ok=True)
    with open(mark, "w", encoding="utf-8") as file:
        faulthandler.dump_traceback_later(seconds, exit=True, file=file)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
    mark.unlink(missing_ok=True)


def where_hung(folder: Path, mission: int) -> str:
    """Return the traceback of a mission that took too long, "" for one that did not."""
    mark = _mark(folder, mission)
    try:
        trace = mark.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""
    mark.unlink(missing_ok=True)
    return trace


def _mark(folder: Path, mission: int) -> Path:
    return folder / "failures" / f".hung-{mission}.tmp"  # a leftover is cleared away
