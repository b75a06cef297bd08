"""Settings of our own processes: garbage collection, memory, Ctrl-C, and lines of progress."""

import atexit
import gc
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from time import monotonic
from typing import TextIO

# New objects between two searches for garbage among the youngest.
YOUNG = 50_000


def collect_seldom() -> None:
    """Have Python search for garbage more seldom, in a process of our own.

    Loading a mission makes a hundred thousand lasting objects; Python would search 260 times
    meanwhile, which takes a sixth of the time.
    """
    gc.set_threshold(YOUNG)


def leave_the_rest() -> None:
    """Have Python not search for garbage as a process of our own ends.

    The process frees all memory anyway; the search took 0.25 s of the 1.4 s of a `run`.
    """
    atexit.register(gc.freeze)


def hand_back() -> None:
    """Have Arrow return memory to the system, if not loaded yet: its own pool keeps tens of MB."""
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")


# Ctrl-C is answered at once, even within compiled code.
#
# Python notes a signal at once but handles it between two of its own steps, and compiled code (an
# equation, or the compiler itself) may be one step of a minute. So the signal wakes a thread, which
# answers it; compiled code lets that thread run (`compiled`).


INTERRUPTED = 130

# Time (s) that Python has to handle Ctrl-C, before the thread answers.
GRACE_S = 0.3


@contextmanager
def answered(answer: Callable[[int], None]) -> Iterator[None]:
    """Call `answer`, in a thread, at each Ctrl-C that Python does not handle in time.

    Its argument is the number of such Ctrl-Cs so far.  Outside the main thread, and where another
    handler is installed, nothing is changed.
    """
    listening = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not listening or threading.current_thread() is not threading.main_thread():
        yield
        return
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    over = threading.Event()
    thread = threading.Thread(target=_listen, args=(ours, over, answer), daemon=True)
    before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    thread.start()
    try:
        yield
    finally:
        over.set()
        signal.set_wakeup_fd(before)
        theirs.close()  # which ends the thread
        thread.join()
        ours.close()


def _listen(ours: socket.socket, over: threading.Event, answer: Callable[[int], None]) -> None:
    count = 0
    while numbers := ours.recv(64):
        asked = numbers.count(signal.SIGINT)
        if asked and not over.wait(GRACE_S):
            count += asked
            answer(count)


def end_now(_: int) -> None:
    """End the process at once: only for work that leaves nothing half done."""
    say("interrupted")
    os._exit(INTERRUPTED)


def say(text: str) -> None:
    """Write a text to stderr, on a line of its own."""
    start = "\r\x1b[K" if sys.stderr.isatty() else ""
    sys.stderr.write(f"{start}{text}\n")
    sys.stderr.flush()


LINE_EVERY_S = 10.0
REDRAWN_EVERY_S = 0.2

# Work that ends sooner (s) has no line of progress.
PATIENCE_S = 2.0


def in_notebook() -> bool:
    """Return whether the output appears in a notebook."""
    return type(sys.stdout).__module__.partition(".")[0] == "ipykernel"


class ProgressLine:
    """A line of progress: redrawn on a terminal or in a notebook, elsewhere written now and then.

    With `on_terminals` it is not written elsewhere.
    """

    def __init__(
        self, *, quiet: bool, stream: TextIO | None = None, on_terminals: bool = False
    ) -> None:
        is_noted = stream is None and in_notebook()  # which shows stderr as an error
        self._stream = stream or (sys.stdout if is_noted else sys.stderr)
        self._redrawn = is_noted or self._stream.isatty()
        self._quiet = quiet or (on_terminals and not self._redrawn)
        self._every = REDRAWN_EVERY_S if self._redrawn else LINE_EVERY_S
        self._drawn = False
        self._due = monotonic() + PATIENCE_S

    def tell(self, line: Callable[[], str]) -> None:
        """Show the progress, unless it was shown just now."""
        if monotonic() >= self._due:
            self._tell(line())

    def end(self, line: Callable[[], str]) -> None:
        """Show the final progress, and end the line if it was redrawn."""
        if self._redrawn and self._drawn:
            self._tell(line())
            self._write("\n")

    def clear(self) -> None:
        """Remove the line if it was redrawn."""
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
        with suppress(OSError):  # a closed stream does not stop the work
            self._stream.write(text)
            self._stream.flush()


def duration(seconds: float) -> str:
    """Return a time in words.

    >>> duration(4.2), duration(75), duration(7500)
    ('4 s', '1 min 15 s', '2 h 5 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
