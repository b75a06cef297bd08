"""One process compiles a function; others that want it meanwhile wait, and load what it kept."""

import os
from pathlib import Path
from time import monotonic, sleep

PATIENCE_S, LOOK_AGAIN_S = 60.0, 0.02


class Turn:
    """The turn to compile a function: ends with the process that has it, at the latest."""

    def __init__(self, path: Path) -> None:
        """Name the file by which processes know of each other."""
        self._path = path
        self._file: int | None = None

    def take(self) -> None:
        """Wait until no other process has the turn, a minute at most.

        Where files cannot be locked nobody waits, and each process compiles for itself.
        """
        if self._file is not None:  # another thread of this process has it
            return
        try:
            import fcntl  # of POSIX alone

            self._file = os.open(self._path, os.O_CREAT | os.O_RDWR, 0o644)
        except (ImportError, OSError):
            return
        tired = monotonic() + PATIENCE_S
        while monotonic() < tired:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                sleep(LOOK_AGAIN_S)
            except OSError:  # a file system without locks
                return

    def give(self) -> None:
        """Let others have it, also those that were forked meanwhile."""
        if self._file is not None:
            import fcntl

            fcntl.flock(self._file, fcntl.LOCK_UN)
            os.close(self._file)
            self._file = None
