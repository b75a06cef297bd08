"""Which mission a worker is at, on the disk for whoever finds the worker dead."""

import faulthandler
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# The number of the mission is written over the last one, so it is as long.
WIDTH = 20


class Heartbeat:
    """The heartbeat of one batch, which is gone when the batch has ended in order."""

    def __init__(self, folder: Path, part: str) -> None:
        """Begin a heartbeat.

        Raises:
            OSError: when it cannot be written.
        """
        self._path = _path(folder, part)
        self._path.parent.mkdir(exist_ok=True)
        self._path.unlink(missing_ok=True)  # of a worker that died; and no link is followed
        self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)

    def close(self) -> None:
        """Remove the heartbeat."""
        os.close(self._file)
        self._path.unlink(missing_ok=True)

    @contextmanager
    def at(self, mission: int, seconds: float | None) -> Iterator[None]:
        """Say that the worker is at a mission; end the process when that takes longer.

        Where it hung is written behind the number, by a thread that needs nothing of Python's.
        There is one limit for a process: with a limit, missions must not run in several threads.
        """
        os.lseek(self._file, 0, os.SEEK_SET)
        os.write(self._file, f"{mission:{WIDTH - 1}}\n".encode())
        if seconds is None:
            yield
            return
        faulthandler.dump_traceback_later(seconds, exit=True, file=self._file)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def take_heartbeat(folder: Path, part: str) -> tuple[int | None, str]:
    """Return the mission at which a worker died, and where it hung if it took too long.

    None when the worker had not begun, or its machine took the heartbeat with it.
    """
    path = _path(folder, part)
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return None, ""
    path.unlink(missing_ok=True)
    number = text[:WIDTH].strip()
    return (int(number), text[WIDTH:]) if number.isdigit() else (None, "")


def _path(folder: Path, part: str) -> Path:
    return folder / "missions" / f".at-{part}.tmp"  # a leftover is cleared away
