"""The tasks: a scenario file each (`scenarios/benchmark`), with a key that a method fills.

What a task is may change with its version alone: its file, its seeds and its baseline.
"""

from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from ...core.scenario.files.scenario_file import load_scenario
from ...core.scenario.scenario import Scenario
from ...support.shipped import shipped
from ...support.wording import did_you_mean

VERSION = 1


def citation() -> str:
    """Return which benchmark scores are of, as papers cite it (docs/citing.md)."""
    return f"benchmark version {VERSION} of bindusbl-des {version('bindusbl-des')}"


Kind = Literal["navigator", "peers", "schedule", "placement"]

# The key that a method of a kind fills, and the method that others are compared with.
KEYS: dict[Kind, str] = {
    "navigator": "navigation.filter",
    "peers": "navigation.peers",
    "schedule": "protocol.schedule",
    "placement": "asvs.formation",
}
BASELINES: dict[Kind, str] = {
    "navigator": "kalman",
    "peers": "alone",
    "schedule": "spatial_reuse",
    "placement": "ring",
}
KINDS: dict[str, Kind] = {
    "near": "navigator",
    "stand_off": "navigator",
    "deep": "navigator",
    "bursts": "navigator",
    "slow_errors": "navigator",
    "outliers": "navigator",
    "clock": "navigator",
    "one_anchor": "peers",
    "no_anchor": "peers",
    "dense": "schedule",
    "sparse": "schedule",
    "moving": "schedule",
    "placement": "placement",
}

# Missions of a task: enough that the rankings of two disjoint sets agree.
SEEDS = {"navigator": 24, "peers": 12, "schedule": 12, "placement": 12}


@dataclass(frozen=True)
class Task:
    """A benchmark scenario for one kind of method, simulated with fixed seeds."""

    name: str
    kind: Kind
    path: Path
    seeds: tuple[int, ...]

    @property
    def baseline(self) -> str:
        """The method that others are compared with."""
        return BASELINES[self.kind]

    def scenario(self, fills: dict[str, Any]) -> Scenario:
        """Return the scenario with what a method fills, by dotted keys.

        Raises:
            ScenarioError: when the file cannot be used.
            ValidationError: when a method does not fit.
        """
        plain = load_scenario(self.path).model_dump(mode="json", exclude_unset=True)
        for key, value in fills.items():
            section, _, name = key.partition(".")
            plain.setdefault(section, {})[name] = value
        return Scenario.model_validate(plain)


@cache
def tasks() -> dict[str, Task]:
    """Return all tasks by name."""
    folder = next(iter(shipped("scenarios").values())).parent / "benchmark"
    return {
        name: Task(name, kind, folder / f"{name}.yaml", tuple(range(1, SEEDS[kind] + 1)))
        for name, kind in KINDS.items()
    }


def task_named(name: str) -> Task:
    """Return a task by its name.

    Raises:
        ValueError: when there is none.
    """
    if name not in tasks():
        hint = did_you_mean(name, list(tasks())) or f"; they are {', '.join(tasks())}"
        raise ValueError(f"no task is named {name!r}{hint}")
    return tasks()[name]
