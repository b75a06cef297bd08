"""Sessions under test: short missions at a place on Earth, and what they send."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from worlds import merged

from bindusbl_des import Instruments, Mission, Scenario, Setup
from bindusbl_des.apps.live.outputs import FORMATS, asked
from bindusbl_des.apps.live.readings import (
    Earth,
    EstimateReading,
    FixReading,
    Gnss,
    Reading,
    Truth,
    UsblReading,
    earth_of,
)
from bindusbl_des.apps.live.session import Output, Session
from bindusbl_des.apps.live.sinks import Datagrams, Terminal
from bindusbl_des.apps.live.ugps import Topside
from bindusbl_des.core.geometry.geodesy import ned_at_depth

# What tests of this room share of it, named once
__all__ = [
    "BEGINS", "FORMATS", "ORIGIN", "START", "YAML", "Datagrams", "EstimateReading",
    "FixReading", "Gnss", "Output", "Session", "Terminal", "Topside", "Truth", "UsblReading",
    "asked", "at_sea", "earth_of", "heard", "ned_at_depth", "written",
]  # fmt: skip


ORIGIN = {"lat_deg": 54.33, "lon_deg": 10.18}
START = datetime(2026, 6, 1, 8, 0, tzinfo=UTC)
BEGINS = "2026-06-01T08:00:00Z"

YAML = """\
name: live
duration_s: 20
environment: {origin: {lat_deg: 54.33, lon_deg: 10.18}}
usbl: {gnss_sd_m: 0.5}
"""


def at_sea(**changes: Any) -> Scenario:
    """Return a mission of a minute at a place on Earth."""
    return Scenario(
        **merged(
            {"name": "live", "duration_s": 60.0, "environment": {"origin": ORIGIN}},
            changes,
        )
    )


def heard(
    scenario: Scenario, seed: int = 3, step: float = 0.7, **asked: Any
) -> tuple[Sequence[Reading], Mission, Earth]:
    """Return all readings of a mission that is advanced in such steps (s), and the mission."""
    mission = Mission(scenario, seed)
    instruments, readings = Instruments(mission, **asked), []
    while not instruments.is_over:
        readings += instruments.advance(instruments.time + step)
    return readings, mission, earth_of(Setup(scenario), START)


def written(folder: Path, text: str = YAML) -> str:
    """Write a scenario file; return its name."""
    (folder / "sea.yaml").write_text(text)
    return str(folder / "sea.yaml")
