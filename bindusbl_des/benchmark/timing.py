"""How long one mission takes, warm: compiled code loaded, first run discarded."""

import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..mission.simulation import simulate
from ..results.parquet import write_parquet
from ..results.result import Result
from ..scenario.scenario import Scenario
from .parts import profiled, shares
from .stopwatch import Took, clocked, peak_memory_mb, spread

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
