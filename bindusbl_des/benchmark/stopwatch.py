"""Time and memory that some work takes.

Time by the clock grows with whatever else the machine does; processor time does not, and is the
same on an idle machine, since a mission runs on one core.  Both are kept.
"""

import os
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple


class Took(NamedTuple):
    """What some work took: time by the clock and processor time of all processes in it (s)."""

    wall: float
    processor: float


def clocked(work: Callable[[], object]) -> Took:
    """Return what some work takes, with the commands that it runs and waits for."""
    began, before = time.perf_counter(), _processor_time()
    work()
    return Took(time.perf_counter() - began, _processor_time() - before)


def _processor_time() -> float:
    its = os.times()
    return time.process_time() + its.children_user + its.children_system


def spread(took: Sequence[Took]) -> dict[str, Any]:
    """Return, in ms, the median processor time, and median, smallest and largest by the clock."""
    wall = sorted(1e3 * one.wall for one in took)
    return {
        "processor": statistics.median(1e3 * one.processor for one in took),
        "median": statistics.median(wall),
        "min": wall[0],
        "max": wall[-1],
        "repeats": len(wall),
    }


def peak_memory_mb(*, of_children: bool = False) -> float:
    """Return the largest resident memory (MB) of this process, or of any that it waited for."""
    import resource

    whose = resource.RUSAGE_CHILDREN if of_children else resource.RUSAGE_SELF
    bytes_each = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(whose).ru_maxrss * bytes_each / 1e6
