"""Ctrl-C answered at once, even in the midst of compiled code.

Python notes a signal at once but obeys it between two steps of its own, and compiled code (an
equation of the sea, or the compiler itself) may be one step of a minute.  A thread that is woken by
the signal answers meanwhile; compiled code lets it run (`compiled`).
"""

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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
