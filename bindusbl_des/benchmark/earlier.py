"""What was measured before on the same kind of machine, and how a measurement compares with it."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# The project keeps what was measured of its versions beside the package, where it is not installed.
HISTORY = Path(__file__).resolve().parents[2] / "benchmarks" / "history.json"

# Of these two machines must be alike for their times to be compared.
KIND = ("processor", "cores", "system")

# Dearer by this share or more is told as slower: chance alone takes a median a few per cent away.
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
        """Whether it is dearer by more than chance."""
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
