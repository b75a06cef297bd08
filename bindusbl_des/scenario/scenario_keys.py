"""All keys of a scenario, section by section, and how a contradiction between them is told."""

from typing import Literal, NamedTuple

from pydantic import Field

from .key_types import LONGEST_NAME, PAPER, Part, Real, Text, key
from .sections.acoustics import Acoustics
from .sections.environment import Environment
from .sections.navigation import Navigation
from .sections.protocol import Protocol
from .sections.survey import Duration, Survey
from .sections.usbl import UsblSection
from .sections.vehicles import Asvs, Auvs


class Problem(NamedTuple):
    """A contradiction: the key it is told at, what is wrong, and the other keys that lead to it."""

    key: str
    message: str
    others: tuple[str, ...] = ()


# A mission as its planner describes it: frozen, validated, units in the key names.
#
# A :class:`.scenario.Scenario` is plain data. It knows nothing of files, clocks or random numbers:
# the same scenario run with the same seed is the same mission.


class Record(Part):
    """What is kept of a mission."""

    tracks_hz: Real = key(2.0, "Hz", "rate of the rows in `tracks`", ge=1e-6, le=1e3)
    metrics_hz: Real = key(
        6.0, "Hz", "rate at which time means are sampled (the paper: 30)", ge=1e-6, le=1e3
    )
    metrics_from_s: Real = key(
        0.0, "s", "instant from which metrics of errors, pings and fixes are taken", ge=0
    )
    detail: Literal["full", "summary"] = key("full", "", "every event, or the metrics only")


class ScenarioKeys(Part):
    """All keys of a scenario, each within its range; :class:`.scenario.Scenario` has them agree."""

    name: Text = Field(min_length=1, max_length=LONGEST_NAME, description="name of the scenario")
    duration_s: Duration = key(
        300.0, "s", "length of the mission; `survey`: until all AUVs have flown their lanes", PAPER
    )
    survey: Survey = Field(default=Survey(), description="the survey area")
    auvs: Auvs = Field(default=Auvs(), description="underwater vehicles")
    asvs: Asvs = Field(default=Asvs(), description="surface vessels")
    environment: Environment = Field(default=Environment(), description="the water")
    acoustics: Acoustics = Field(default=Acoustics(), description="acoustic bands")
    protocol: Protocol = Field(default=Protocol(), description="medium access")
    usbl: UsblSection = Field(default=UsblSection(), description="USBL measurement")
    navigation: Navigation = Field(default=Navigation(), description="AUV navigation")
    record: Record = Field(default=Record(), description="what is recorded")
