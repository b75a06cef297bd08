"""What this machine, or the container that we are in, has to offer."""

import math
import os
from contextlib import suppress
from pathlib import Path

# Where Linux says how much memory a container may take (bytes).
CONTAINER_LIMITS = (
    "/sys/fs/cgroup/memory.max",
    "/sys/fs/cgroup/memory/memory.limit_in_bytes",
)


def machine_cores() -> int:
    """Return on how many cores this process may run."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine_memory() -> float:
    """Return the memory (bytes) of this machine, or of the container that we are in; infinite where
    it cannot be told.
    """
    try:
        memory = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        memory = math.inf
    for limit in CONTAINER_LIMITS:
        with suppress(OSError, ValueError):  # no container, or "max"
            memory = min(memory, float(Path(limit).read_text()))
    return memory
