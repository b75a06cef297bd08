"""The plan of a campaign: which missions there are, and a name for each that never changes."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from ...core.kept_files import copies_of, kept_name, portable, renamed_point
from ...core.plugins import Family, is_plugin, source_sha256
from ...scenario.families import parts_of
from ...scenario.files.former_keys import key_now
from ...scenario.part_choice import PartChoice
from .experiment import Experiment

# To be raised whenever a mission would give other numbers than before for the same scenario file:
# a campaign is known by the keys given, so that another default counts as another model.
MODEL_VERSION = 4


@dataclass(frozen=True, slots=True)
class PlannedMission:
    """One mission of the plan: its number there, its point and its seed."""

    number: int
    point: int
    seed: int


@dataclass(frozen=True)
class PlannedPoint:
    """One point: its scenario as JSON text, all varied keys as they are in it, those it sets.

    Files are named as in the campaign's folder.
    """

    scenario: str
    varied: dict[str, Any]
    sets: dict[str, Any]


class ExperimentPlan:
    """All missions of an experiment, point after point, each with every seed."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self.model_version = model_version()
        #: The files that all points name, each under the name of its copy in the folder.
        self.files: dict[str, str] = {}
        #: The fingerprints of the files of somebody's own parts, by ``module:object``.
        self.own_parts: dict[str, str] = {}
        varied = experiment.varied()
        self.points: list[PlannedPoint] = []
        #: What is to be loaded, with all of its settings, by its key and how it is written.
        self.plugins: dict[str, tuple[Family, PartChoice]] = {}
        for number, point in enumerate(experiment.points):
            mission = experiment.scenario(number)
            for family, name in parts_of(mission):
                if is_plugin(name):
                    self.plugins[f"{family.key}={_canonical(name.plain())}"] = family, name
                    if str(name) not in self.own_parts:
                        self.own_parts[str(name)] = source_sha256(name)
            scenario = mission.model_dump(mode="json")
            self.files |= copies_of(scenario)
            scenario = portable(scenario)
            values = {key: _value(scenario, key_now(key)) for key in varied}
            sets = renamed_point(point, kept_name)
            self.points.append(PlannedPoint(_canonical(scenario), values, sets))
        self.columns = {key: _kind([point.varied[key] for point in self.points]) for key in varied}

    def __len__(self) -> int:
        return len(self.points) * len(self.experiment.seeds)

    def mission(self, number: int) -> PlannedMission:
        """Return a mission by its number in the plan."""
        point, replicate = divmod(number, len(self.experiment.seeds))
        return PlannedMission(number, point, self.experiment.seeds[replicate])

    def mission_id(self, mission: PlannedMission) -> str:
        """Return the fingerprint of what decides a mission: scenario, seed and model."""
        return mission_id(self.points[mission.point].scenario, mission.seed, self.model_version)

    def fingerprint(self) -> str:
        """Return the sha256 of the whole plan; equal plans run the same missions."""
        return fingerprint(self.experiment.record(), self.own_parts, self.model_version)


def fingerprint(
    experiment: Mapping[str, Any], own_parts: Mapping[str, str], model_version: str
) -> str:
    """Return the sha256 of a plan of what its campaign's record holds."""
    text = json.dumps([experiment, own_parts], sort_keys=True) + model_version
    return hashlib.sha256(text.encode()).hexdigest()


def model_version() -> str:
    """Return what the numbers of a mission depend on besides scenario and seed."""
    return f"{version('bindusbl-des')}/{MODEL_VERSION}"


def mission_id(scenario: str, seed: int, model: str) -> str:
    """Return the fingerprint of one mission."""
    return hashlib.sha256(f"{scenario}\n{seed}\n{model}".encode()).hexdigest()


def _canonical(data: Any) -> str:
    return json.dumps(data, sort_keys=True, separators=(",", ":"))


def _value(scenario: Mapping[str, Any], key: str) -> Any:
    """Return the value of a dotted key in the whole scenario, null where it has none."""
    value: Any = scenario
    for part in key.split("."):
        if isinstance(value, list):
            value = value[int(part)]
        else:
            value = value.get(part) if isinstance(value, dict) else None
    return value


def _kind(values: list[Any]) -> str:
    """Return the type of a column that can hold all of the values."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {bool}:
        return "bool"
    if kinds <= {int}:
        return "int"
    if kinds <= {int, float}:
        return "float"
    return "text" if kinds <= {str} else "json"
