"""The whole benchmark: each standard mission in a process of its own, then whole commands."""

import multiprocessing
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from .command_lines import commands
from .machine import machine
from .missions import standard_missions
from .timing import QUICK, Effort, measured

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
