"""The parts of a mission and the share of time that each takes.

A separate run is profiled (cProfile), so that the timed ones are undisturbed.  Time spent in a
module of ours belongs to that module's part; time spent in a library belongs to whoever called it,
in proportion to what each of its callers waited for it, back to a module of ours.  What compiled
code does belongs to the module that calls it from Python.  Profiling costs time for every call, so
parts of many short calls look larger than they are, compiled ones smaller.
"""

import cProfile
import pstats
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

PACKAGE = Path(__file__).resolve().parents[1]

# Which rooms of the package make up each part.
PARTS: Mapping[str, str] = {
    "vehicles": "vehicles geometry dynamics",
    "acoustics": "acoustics",
    "protocol": "protocol",
    "USBL": "usbl",
    "navigation": "navigation",
    "records": "records results",
    "mission": "mission scenario core preflight",
}
PART_OF = {room: part for part, rooms in PARTS.items() for room in rooms.split()}

# What cannot be told: an unknown module of ours, or a library that none of ours called.
OTHER = "other"

Function = tuple[str, int, str]
Callers = dict[Function, tuple[int, int, float, float]]
Stats = dict[Function, tuple[int, int, float, float, Callers]]


def shares(stats: Stats) -> dict[str, float]:
    """Return the share of time of each part in what was profiled; they add up to 1."""
    part_of = {function: part_of_file(function[0]) for function in stats}
    names = [*PARTS, OTHER]
    own = [(names.index(part), stats[f][2]) for f, part in part_of.items() if part]
    seconds = np.zeros(len(names))
    for part, spent in own:
        seconds[part] += spent
    libraries = [function for function, part in part_of.items() if part is None]
    spent_there = np.array([stats[function][2] for function in libraries])
    seconds += spent_there @ _blamed(stats, libraries, part_of, names)
    return {name: float(share) for name, share in zip(names, seconds / seconds.sum(), strict=True)}


def profiled(work: Callable[[], object]) -> Stats:
    """Return what cProfile saw while `work` was done: function -> calls, times, callers."""
    profile = cProfile.Profile()
    profile.runcall(work)
    found: Any = pstats.Stats(profile)
    stats: Stats = found.stats
    return stats


def part_of_file(file: str) -> str | None:
    """Return the part that a source file belongs to; None for what is not ours.

    >>> part_of_file(str(PACKAGE / "vehicles" / "guidance" / "guided_fleet.py"))
    'vehicles'
    """
    path = Path(file)
    if not path.is_relative_to(PACKAGE):
        return None
    home = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    return PART_OF.get(home, OTHER)


def _blamed(
    stats: Stats,
    libraries: list[Function],
    part_of: Mapping[Function, str | None],
    names: list[str],
) -> Any:
    """Return, for each library function (rows), the parts (columns) that its time belongs to.

    Blame B solves B = D + W B: what callers of ours take directly, and what other libraries pass
    on.  Calls of a function by itself pass on nothing; what nobody called is OTHER.
    """
    row_of = {function: row for row, function in enumerate(libraries)}
    passed = np.zeros((len(libraries), len(libraries)))
    direct = np.zeros((len(libraries), len(names)))
    for row, function in enumerate(libraries):
        callers = stats[function][4]
        waits = {f: edge[3] + 1e-12 * edge[1] for f, edge in callers.items() if f != function}
        total = sum(waits.values())
        for caller, wait in waits.items():
            part = part_of.get(caller, OTHER)
            if part is None:
                passed[row, row_of[caller]] += wait / total
            else:
                direct[row, names.index(part)] += wait / total
        if not waits:
            direct[row, names.index(OTHER)] = 1.0
    # Libraries that only call each other in a ring lead nowhere: a little of theirs is lost there.
    passed *= 1.0 - 1e-9
    return np.linalg.solve(np.eye(len(libraries)) - passed, direct)
