"""What the speed of missions is to be, and whether a measurement gets there."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

Measured = dict[str, Any]
VEHICLES = ("kinematic", "bluerov2")


@dataclass(frozen=True)
class Target:
    """One figure: what it is of, its unit, what is asked first and then, and how it is read."""

    what: str
    unit: str
    first: float
    then: float
    value: Callable[[Measured], float]


def mission_ms(found: Measured, name: str) -> float:
    """Return the processor time (ms) of a mission of a sweep: a further seed of a configuration."""
    took: float = found["missions"][name]["mission_ms"]["processor"]
    return took


def slowest_ms(found: Measured, fleet: str) -> float:
    """Return the mission time (ms) of a fleet with the vehicles that cost more."""
    return max(mission_ms(found, f"{fleet} {vehicle}") for vehicle in VEHICLES)


def worst_ratio(found: Measured, fleet: str) -> float:
    """Return our whole mission over ns-3's acoustics, with the vehicles that cost more."""
    rows = [found["peers"][f"{fleet} {vehicle}"] for vehicle in VEHICLES]
    return float(max(row["mission_ms"] / row["stock_run_ms"] for row in rows))


def growth(found: Measured, auvs: int, asvs: int) -> float:
    """Return the cost per AUV and second of a large fleet over that at (10,3), kinematic."""
    large = mission_ms(found, f"({auvs},{asvs}) kinematic") / auvs
    return large / (mission_ms(found, "(10,3) kinematic") / 10)


def first_of_configuration_s(found: Measured, name: str) -> float:
    """Return the processor time (s) of the first mission of a configuration."""
    took: float = found["missions"][name]["new_configuration_ms"]["processor"]
    return took / 1e3


def cost_of_first(found: Measured, name: str) -> float:
    """Return the cost of the first mission of a configuration over that of its further seeds."""
    return first_of_configuration_s(found, name) * 1e3 / mission_ms(found, name)


TARGETS = (
    Target("(3,3), slower vehicle", "ms", 25, 25, lambda it: slowest_ms(it, "(3,3)")),
    Target("(3,3) over ns-3's acoustics", "x", 1, 1, lambda it: worst_ratio(it, "(3,3)")),
    Target("(10,3), slower vehicle", "ms", 80, 80, lambda it: slowest_ms(it, "(10,3)")),
    Target("(10,3) over ns-3's acoustics", "x", 1, 0.5, lambda it: worst_ratio(it, "(10,3)")),
    *(
        Target(
            f"new configuration over a warm one, {name}", "x", 3, 2,
            partial(cost_of_first, name=name),
        )
        for name in ("(3,3) bluerov2", "(3,3) remus100", "(10,3) bluerov2", "(10,3) remus100")
    ),
    Target(
        "(1000,50), slower vehicle", "s", 5, 1.5, lambda it: slowest_ms(it, "(1000,50)") / 1e3
    ),
    Target(
        "(1000,50), new configuration, slower vehicle", "s", 20, 5,
        lambda it: max(first_of_configuration_s(it, f"(1000,50) {own}") for own in VEHICLES),
    ),
    Target(
        "(1000,50) over (10,3), per AUV and second", "x", 3, 2, lambda it: growth(it, 1000, 50)
    ),
    Target(
        "(10000,200), new configuration", "s", 60, 60,
        lambda it: first_of_configuration_s(it, "(10000,200) kinematic"),
    ),
    Target(
        "memory of (10000,200)", "MB", 4000, 4000,
        lambda it: float(it["missions"]["(10000,200) kinematic"]["peak_memory_mb"]),
    ),
    Target(
        "(10000,200) over (10,3), per AUV and second", "x", 3, 2,
        lambda it: growth(it, 10_000, 200),
    ),
    Target(
        "sweep of 5,760 missions on two cores", "s", 90, 60,
        lambda it: float(it["commands"]["sweep"]["planned_processor_s"]) / 2,
    ),
    Target(
        "`run` of the baseline, from command to files", "s", 3, 1.2,
        lambda it: float(it["commands"]["run_ms"]["processor"]) / 1e3,
    ),
    Target(
        "`--help`", "s", 0.5, 0.15, lambda it: float(it["commands"]["help_ms"]["processor"]) / 1e3
    ),
    Target(
        "import of `simulate` and `Scenario`", "s", 0.4, 0.4,
        lambda it: float(it["commands"]["import_ms"]["processor"]) / 1e3,
    ),
    Target(
        "`status` of 100,000 missions", "s", 1, 1,
        lambda it: float(it["campaigns"]["large"][-1]["status"]["processor_s"]),
    ),
    Target(
        "memory of a sweep, its largest process", "MB", 500, 300,
        lambda it: float(it["commands"]["sweep"]["peak_memory_mb"]),
    ),
)  # fmt: skip


def verdicts(found: Measured) -> Iterator[tuple[Target, float | None, str]]:
    """Yield each target with what was measured (None: nothing) and whether it is met."""
    for target in TARGETS:
        try:
            value = target.value(found)
        except KeyError:
            yield target, None, "not measured"
            continue
        yield target, value, _verdict(target, value)


def _verdict(target: Target, value: float) -> str:
    if value <= target.then:
        return "met"
    return "first met" if value <= target.first else "**not met**"
