"""Requests to end: whoever has a draft removes it before the program goes."""

import signal
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
    """
    asked_s = -SAME_REQUEST_S

    def receive(number: int, _: FrameType | None) -> None:
        nonlocal asked_s
        now = monotonic()
        if now - asked_s >= SAME_REQUEST_S:
            asked_s = now
            raise Ended(128 + number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    requests = (signal.SIGTERM, signal.SIGHUP)
    ours = [number for number in requests if signal.getsignal(number) == signal.SIG_DFL]
    for number in ours:
        signal.signal(number, receive)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)
