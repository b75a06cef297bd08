"""The machine that a benchmark ran on, in general words."""

import os
import platform
import re
from importlib.metadata import version
from pathlib import Path

from ..preflight.machine import machine_cores


def machine() -> dict[str, str | float]:
    """Return the processor, how many of its cores there are, and what runs on them.

    `load` is how many processes wanted a core, on average over the last minute.
    """
    return {
        "processor": processor(),
        "cores": machine_cores(),
        "load": round(os.getloadavg()[0], 1),
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "numba": version("numba"),
        "bindusbl-des": version("bindusbl-des"),
    }


def processor() -> str:
    """Return the processor's model as the system names it, else its architecture."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    found = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    return found[1].strip() if found else platform.processor() or platform.machine()
