"""What a mission takes, and which part of it: timed, then profiled in a run of its own."""

import cProfile
import os
import pstats
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import bindusbl_des
from bindusbl_des.core.mission.simulation import simulate
from bindusbl_des.core.results.result import Result
from bindusbl_des.core.results.result_folder import write_parquet
from bindusbl_des.core.scenario.scenario import Scenario

# Time and memory that some work takes.
#
# Time by the clock grows with whatever else the machine does; processor time does not, and is the
# same on an idle machine, since a mission runs on one core. Both are kept.


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


# The parts of a mission and the share of time that each takes.
#
# A separate run is profiled (cProfile), so that the timed ones are undisturbed. Time spent in a
# module of ours belongs to that module's part; time spent in a library belongs to whoever called
# it, in proportion to what each of its callers waited for it, back to a module of ours. What
# compiled code does belongs to the module that calls it from Python. Profiling costs time for every
# call, so parts of many short calls look larger than they are, compiled ones smaller.


PACKAGE = Path(bindusbl_des.__file__).resolve().parent

# Which rooms of the package make up each part.
PARTS: Mapping[str, str] = {
    "vehicles": "vehicles geometry dynamics",
    "acoustics": "acoustics sea channels",
    "protocol": "protocol access schedules broadcasters rangings",
    "USBL": "usbl",
    "navigation": "navigation",
    "records": "records results",
    "mission": "mission scenario support preflight setup",
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

    >>> part_of_file(str(PACKAGE / "core" / "vehicles" / "guidance" / "guided_fleet.py"))
    'vehicles'
    """
    path = Path(file)
    if not path.is_relative_to(PACKAGE):
        return None
    rooms = path.relative_to(PACKAGE).with_suffix("").parts
    return next((PART_OF[room] for room in rooms if room in PART_OF), OTHER)


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


# How long one mission takes, warm: compiled code loaded, first run discarded.


# Events are rows of these tables: what happened in the sea and on the air.
EVENT_TABLES = ("rounds", "pings", "receptions", "broadcasts", "fixes")

# Length (s) of the mission that loads or compiles what the others need.
WARM_UP_S = 2.0

# Missions profiled together: chance takes its share of time out of one alone.
MOST_PROFILED = 5

# Relative change of speed that makes another configuration of the same cost.
NUDGE = 1e-6


@dataclass(frozen=True)
class Effort:
    """How often to repeat: at least and at most so often, and no more after so many seconds."""

    fewest: int = 3
    most: int = 25
    seconds: float = 4.0

    def at_most_once(self) -> "Effort":
        """Return the effort for what takes longer than all that may be spent."""
        return Effort(1, 1, self.seconds)


QUICK = Effort(2, 2, 1.0)


def measured(scenario: Scenario, effort: Effort) -> dict[str, Any]:
    """Return the speed of one mission as plain data: times (ms), rates, memory, shares.

    Runs of one configuration with ever new seeds come first, then runs of ever new configurations
    (a speed that differs in the seventh digit), which share nothing with those before.  Rates are
    per second of processor time.
    """
    simulate(of_length(scenario, WARM_UP_S), seed=0)
    first = clocked(lambda: simulate(scenario, seed=0)).wall
    allowed = effort.at_most_once() if first > effort.seconds else effort
    same = repeated(lambda number: simulate(scenario, number), allowed)
    memory = peak_memory_mb()
    moved = repeated(lambda number: simulate(elsewhere(scenario, number), seed=0), allowed)
    result = simulate(scenario, seed=0)
    written = spread(list(_writing(result, effort)))
    events = event_count(result)
    mission, writing = spread(same)["processor"] / 1e3, written["processor"] / 1e3
    return {
        "auvs": scenario.auvs.count,
        "asvs": scenario.asvs.count,
        "vehicle": str(scenario.auvs.vehicle),
        "duration_s": scenario.duration_s,
        "mission_ms": spread(same),
        "new_configuration_ms": spread(moved),
        "writing_ms": written,
        "events": events,
        "events_per_s": None if events is None else events / mission,
        "sim_seconds_per_s": scenario.duration_s / mission,
        "us_per_auv_second": 1e6 * mission / scenario.auvs.count / scenario.duration_s,
        "peak_memory_mb": memory,
        "shares": _shares(scenario, writing / (mission + writing), len(same)),
    }


def event_count(result: Result) -> int | None:
    """Return the number of events in a mission; None where it keeps no tables of them."""
    if result.scenario.record.detail == "summary":
        return None
    events: int = sum(result.arrow[table].num_rows for table in EVENT_TABLES)
    return events


def of_length(scenario: Scenario, seconds: float) -> Scenario:
    """Return the same mission, but so many seconds long."""
    return scenario.model_copy(update={"duration_s": seconds})


def elsewhere(scenario: Scenario, number: int) -> Scenario:
    """Return a mission that costs the same, yet is another one: slightly faster AUVs."""
    speed = scenario.auvs.speed_m_per_s * (1.0 + NUDGE * number)
    auvs = scenario.auvs.model_copy(update={"speed_m_per_s": speed})
    return scenario.model_copy(update={"auvs": auvs})


def repeated(work: Callable[[int], object], effort: Effort) -> list[Took]:
    """Return what each repetition takes; `work` is told its number, from 1."""
    took: list[Took] = []
    began = time.perf_counter()
    while len(took) < effort.fewest or (
        len(took) < effort.most and time.perf_counter() - began < effort.seconds
    ):
        number = len(took) + 1
        took.append(clocked(lambda: work(number)))  # noqa: B023 - called at once
    return took


def _writing(result: Result, effort: Effort) -> Iterator[Took]:
    """Yield what it takes to write all tables to files, again and again."""
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(effort.fewest):
            yield clocked(lambda: _write(result, Path(folder)))


def _write(result: Result, folder: Path) -> None:
    for name, table in result.arrow.items():
        write_parquet(table, name, folder / f"{name}.parquet", {})


def _shares(scenario: Scenario, writing: float, times: int) -> dict[str, float]:
    """Return the share of each part in a mission and the writing of its tables."""
    seeds = range(1, min(times, MOST_PROFILED) + 1)
    parts = shares(profiled(lambda: [simulate(scenario, seed) for seed in seeds]))
    return {**{part: share * (1.0 - writing) for part, share in parts.items()}, "writing": writing}
