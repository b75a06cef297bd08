"""How a process of ours behaves: its memory, its answer to Ctrl-C, and how far it says to be."""

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

# So many objects are made before the youngest are looked through.
YOUNG = 50_000


def collect_seldom() -> None:
    """Look for garbage more seldom than Python does, in a process that is ours.

    What a mission loads makes a hundred thousand objects, all of which stay; Python looks through
    them 260 times meanwhile, which takes a sixth of the time.
    """
    gc.set_threshold(YOUNG)


def leave_the_rest() -> None:
    """Have Python look for no garbage when it ends, in a process that is ours.

    All memory goes with the process; looking through what a mission loaded took 0.25 s of the 1.4 s
    of a `run`.
    """
    atexit.register(gc.freeze)


def hand_back() -> None:
    """Have Arrow, unless it has been loaded, hand memory back: its own way keeps tens of MB.

    Processes that this one begins do as it does.
    """
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")


# Ctrl-C answered at once, even in the midst of compiled code.
#
# Python notes a signal at once but obeys it between two steps of its own, and compiled code (an
# equation of the sea, or the compiler itself) may be one step of a minute. A thread that is woken
# by the signal answers meanwhile; compiled code lets it run (`compiled`).


INTERRUPTED = 130

# So long Python itself may take to obey (s), before somebody else answers.
GRACE_S = 0.3


@contextmanager
def answered(answer: Callable[[int], None]) -> Iterator[None]:
    """Call `answer`, in a thread, at each Ctrl-C that Python does not obey by itself.

    It is told how many there have been.  Outside the main thread, and where somebody else listens
    to signals, nothing is changed.
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
    """End the process: for work that leaves nothing half done."""
    say("interrupted")
    os._exit(INTERRUPTED)


def say(text: str) -> None:
    """Say something on stderr, on a line of its own."""
    start = "\r\x1b[K" if sys.stderr.isatty() else ""
    sys.stderr.write(f"{start}{text}\n")
    sys.stderr.flush()


LINE_EVERY_S = 10.0
REDRAWN_EVERY_S = 0.2

# Work that ends before this is not worth a word.
PATIENCE_S = 2.0


def in_notebook() -> bool:
    """Tell whether what is printed stands in a notebook."""
    return type(sys.stdout).__module__.partition(".")[0] == "ipykernel"


class ProgressLine:
    """A line that is redrawn on a terminal or in a notebook, and written now and then elsewhere.

    One that is only `on_terminals` is not written elsewhere.
    """

    def __init__(
        self, *, quiet: bool, stream: TextIO | None = None, on_terminals: bool = False
    ) -> None:
        is_noted = stream is None and in_notebook()  # where stderr stands for trouble
        self._stream = stream or (sys.stdout if is_noted else sys.stderr)
        self._redrawn = is_noted or self._stream.isatty()
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
