"""How long one mission takes, warm: compiled code loaded, first run discarded."""

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..result import Result
from ..scenario import Scenario
from ..simulation import simulate
from ..tables import write_parquet
from .parts import shares

# Events are rows of these tables: what happened in the sea and on the air.
EVENT_TABLES = ("rounds", "pings", "receptions", "broadcasts", "fixes")

# Length (s) of the mission that loads or compiles what the others need.
WARM_UP_S = 2.0

# Relative change of speed that makes another configuration of the same cost.
NUDGE = 1e-6


@dataclass(frozen=True)
class Effort:
    """How often to repeat: at least and at most so often, and no more after so many seconds."""

    fewest: int = 3
    most: int = 25
    seconds: float = 6.0


QUICK = Effort(2, 2, 1.0)


def measured(scenario: Scenario, effort: Effort) -> dict[str, Any]:
    """Return the speed of one mission as plain data: times (ms), rates, memory, shares.

    Runs of one configuration with ever new seeds alternate with runs of ever new configurations
    (a speed that differs in the seventh digit), which share nothing with those before.
    """
    simulate(of_length(scenario, WARM_UP_S), seed=0)
    began = time.perf_counter()
    result = simulate(scenario, seed=0)
    first = time.perf_counter() - began
    same, other = _alternating(scenario, effort, discarded=first)
    memory = peak_memory_mb()
    writing = statistics.median(_writing(result, effort))
    events = sum(result.arrow[table].num_rows for table in EVENT_TABLES)
    mission = statistics.median(same)
    return {
        "auvs": scenario.auvs.count,
        "asvs": scenario.asvs.count,
        "vehicle": str(scenario.auvs.vehicle),
        "duration_s": scenario.duration_s,
        "mission_ms": spread(same),
        "new_configuration_ms": spread(other),
        "writing_ms": 1e3 * writing,
        "events": events,
        "events_per_s": events / mission,
        "sim_seconds_per_s": scenario.duration_s / mission,
        "us_per_auv_second": 1e6 * mission / scenario.auvs.count / scenario.duration_s,
        "peak_memory_mb": memory,
        "shares": _shares(scenario, writing / (mission + writing)),
    }


def of_length(scenario: Scenario, seconds: float) -> Scenario:
    """Return the same mission, but so many seconds long."""
    return scenario.model_copy(update={"duration_s": seconds})


def elsewhere(scenario: Scenario, number: int) -> Scenario:
    """Return a mission that costs the same, yet is another one: slightly faster AUVs."""
    speed = scenario.auvs.speed_m_per_s * (1.0 + NUDGE * number)
    auvs = scenario.auvs.model_copy(update={"speed_m_per_s": speed})
    return scenario.model_copy(update={"auvs": auvs})


def spread(seconds: list[float]) -> dict[str, Any]:
    """Return median, smallest and largest of some times, in ms."""
    ms = sorted(1e3 * value for value in seconds)
    return {"median": statistics.median(ms), "min": ms[0], "max": ms[-1], "repeats": len(ms)}


def peak_memory_mb(*, of_children: bool = False) -> float:
    """Return the largest resident memory (MB) of this process, or of any that it waited for."""
    import resource
    import sys

    whose = resource.RUSAGE_CHILDREN if of_children else resource.RUSAGE_SELF
    bytes_each = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(whose).ru_maxrss * bytes_each / 1e6


def _alternating(
    scenario: Scenario, effort: Effort, discarded: float
) -> tuple[list[float], list[float]]:
    """Return times (s) of the same configuration, and of ever new ones.

    A first run that takes longer than all that may be spent counts as the only one.
    """
    if discarded > 2 * effort.seconds:
        return [discarded], [discarded]
    same, other = [], []
    began = time.perf_counter()
    for number in range(1, effort.most + 1):
        same.append(clocked(lambda seed=number: simulate(scenario, seed)))  # type: ignore[misc]
        changed = elsewhere(scenario, number)
        other.append(clocked(lambda it=changed: simulate(it, seed=0)))  # type: ignore[misc]
        if number >= effort.fewest and time.perf_counter() - began > effort.seconds:
            break
    return same, other


def clocked(work: Callable[[], object]) -> float:
    """Return how long (s) some work takes."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def _writing(result: Result, effort: Effort) -> Iterator[float]:
    """Yield the time (s) of writing all tables to files, again and again."""
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(effort.fewest):
            yield clocked(lambda: _write(result, Path(folder)))


def _write(result: Result, folder: Path) -> None:
    for name, table in result.arrow.items():
        write_parquet(table, name, folder / f"{name}.parquet", {})


def _shares(scenario: Scenario, writing: float) -> dict[str, float]:
    """Return the share of each part in a mission and the writing of its tables."""
    parts = shares(lambda: simulate(scenario, seed=1))
    return {**{part: share * (1.0 - writing) for part, share in parts.items()}, "writing": writing}
