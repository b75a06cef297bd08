"""Standard missions, each in a process of its own, whole commands, and earlier measurements."""

import json
import multiprocessing
import os
import platform
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bindusbl_des.apps.preflight.effort import machine_cores

from .command_lines import commands
from .missions import standard_missions
from .timing import QUICK, Effort, measured

# The machine that a benchmark ran on, in general words.


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


# What was measured before on the same kind of machine, and how a measurement compares with it.


# The project keeps what was measured of its versions beside the package, where it is not installed.
HISTORY = Path(__file__).with_name("history.json")

# Of these two machines must be alike for their times to be compared.
KIND = ("processor", "cores", "system")

# Slower by this share or more is reported: chance alone moves a median by a few per cent.
SLOWER = 0.10

# What is compared of a mission, and what it is called.
COMPARED = {"mission_ms": "mission", "new_configuration_ms": "new configuration"}

Measured = Mapping[str, Any]


@dataclass(frozen=True)
class Ratio:
    """Processor time of a mission, of a seed or a new configuration, over what it took before."""

    mission: str
    what: str
    now_ms: float
    before_ms: float

    @property
    def value(self) -> float:
        """Now over before."""
        return self.now_ms / self.before_ms

    @property
    def is_slower(self) -> bool:
        """Whether it is slower by more than chance."""
        return self.value >= 1.0 + SLOWER


def recorded(file: Path) -> dict[str, Measured]:
    """Return the measurements that a file keeps, oldest first.

    It holds what ``bench --json`` printed, or several of that by name.

    Raises:
        ValueError: when it holds neither.
        OSError: when it cannot be read.
    """
    try:
        kept: Any = json.loads(file.read_text(encoding="utf-8"))
        found: dict[str, Measured] = {file.name: kept} if "machine" in kept else {**kept}
        if not all(map(_is_sound, found.values())):
            raise ValueError("it has no times")
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError) as error:
        raise ValueError(f"{file}: holds no measurement of `bindusbl-des bench --json`") from error
    return found


def _is_sound(record: Measured) -> bool:
    times = [
        float(row[key]["processor"]) for row in record["missions"].values() for key in COMPARED
    ]
    return all(key in record["machine"] for key in KIND) and all(time > 0.0 for time in times)


def last_alike(found: Measured, records: Mapping[str, Measured]) -> tuple[str, Measured] | None:
    """Return the name of the last record from the same kind of machine, and the record."""
    alike = [
        (name, it)
        for name, it in records.items()
        if all(it["machine"][key] == found["machine"][key] for key in KIND)
    ]
    return alike[-1] if alike else None


def ratios(found: Measured, before: Measured) -> Iterator[Ratio]:
    """Yield how each mission that both have compares."""
    for mission, row in found["missions"].items():
        earlier = before["missions"].get(mission)
        for key, what in COMPARED.items() if earlier else ():
            yield Ratio(mission, what, row[key]["processor"], earlier[key]["processor"])


# The whole benchmark: each standard mission in a process of its own, then whole commands.


Told = Callable[[str], None]


def bench(
    names: Iterable[str],
    *,
    quick: bool,
    with_commands: bool,
    told: Told,
    whole_sweep: bool = False,
) -> dict[str, Any]:
    """Return the speed of the missions named, and of whole commands, as plain data.

    `told` hears what is being measured.  Of the sweep of 5,760 missions a part is run, or the
    `whole_sweep`.
    """
    found: dict[str, Any] = {"machine": machine(), "quick": quick, "missions": {}}
    for name in names:
        told(f"measuring {name}")
        found["missions"][name] = in_own_process(mission_speed, name, quick)
    if with_commands:
        told("measuring whole commands")
        found["commands"] = in_own_process(commands, quick, whole_sweep)
    return found


def in_own_process(work: Callable[..., dict[str, Any]], *details: Any) -> dict[str, Any]:
    """Return what `work` finds in a fresh process, whose memory is its own."""
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max_workers=1, mp_context=fresh) as process:
        return process.submit(work, *details).result()


def mission_speed(name: str, quick: bool) -> dict[str, Any]:
    """Return the speed of one standard mission."""
    return measured(standard_missions()[name], QUICK if quick else Effort())
