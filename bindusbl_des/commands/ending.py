"""Requests to end: whoever has a draft removes it before the program goes."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from types import FrameType

from ..core.plugins import Ended

# `timeout` and others send their request twice, to the process and to its group.
SAME_REQUEST_S = 1.0


@contextmanager
def ended_in_order() -> Iterator[None]:
    """Raise SystemExit(128 + signal) where SIGTERM or SIGHUP would end the process on the spot.

    Signals that are ignored (`nohup`) or have a receiver are left alone, and so are all of them
    outside the main thread, where none can be received.

    Python drops what is raised while it clears up or while C code imports a module.  A request that
    was dropped there is sent again.
    """
    asked_s = -SAME_REQUEST_S
    dropped_before = sys.unraisablehook

    def receive(number: int, _: FrameType | None) -> None:
        nonlocal asked_s
        now = monotonic()
        if now - asked_s >= SAME_REQUEST_S:
            asked_s = now
            raise Ended(128 + number)

    def dropped(what: "sys.UnraisableHookArgs") -> None:
        nonlocal asked_s
        if not isinstance(what.exc_value, Ended):
            dropped_before(what)
            return
        asked_s = -SAME_REQUEST_S
        number = int(what.exc_value.args[0]) - 128
        # From another thread: sent by this one, it would be received here, and dropped again.
        threading.Timer(0.01, os.kill, (os.getpid(), number)).start()

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    requests = (signal.SIGTERM, signal.SIGHUP)
    ours = [number for number in requests if signal.getsignal(number) == signal.SIG_DFL]
    for number in ours:
        signal.signal(number, receive)
    sys.unraisablehook = dropped
    try:
        yield
    finally:
        sys.unraisablehook = dropped_before
        for number in ours:
            signal.signal(number, signal.SIG_DFL)
