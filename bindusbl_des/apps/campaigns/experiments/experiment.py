"""An experiment and its plan.

An experiment is one scenario, the points that vary it, the seeds at each point, and targets for the
intervals, which may stop a point early.  Its plan numbers all missions, each with a fingerprint
that never changes.
"""

import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ....core.results.schemas import schema
from ....core.scenario.chosen_parts import parts_of
from ....core.scenario.files import former_keys
from ....core.scenario.files.overrides import put
from ....core.scenario.part_choice import PartChoice
from ....core.scenario.scenario import Scenario
from ....support.kept_files import KEPT, copies_of, kept_name, portable, renamed, renamed_point
from ....support.mistakes import Mistake
from ....support.plain_yaml import Document
from ....support.plugins import Family, is_plugin, name_of, package_sha256, source_sha256
from ....support.wording import described, did_you_mean
from .experiment_points import is_section

Detail = Literal["summary", "full"]
Point = Mapping[str, Any]

# Raise it whenever a scenario file gives other numbers: a campaign is identified by the given keys,
# so that another default counts as another model.
MODEL_VERSION = 12

# With fewer seeds the estimated spread is too uncertain to stop.
FEWEST_SEEDS = 8

# The default of the most seeds of a point.
MOST_SEEDS = 256


@dataclass(frozen=True)
class Target:
    """The largest half width of a metric's 95 % confidence interval: absolute, or ``5%``."""

    metric: str
    written: float | str

    def half_width(self, mean: float) -> float:
        """Return the target's half width for this mean.

        >>> Target("position_error_m", "5%").half_width(-2.0)
        0.1
        """
        if isinstance(self.written, str):
            return float(self.written.rstrip("% ")) / 100 * abs(mean)
        return self.written


def checkpoints(most: int) -> Iterator[int]:
    """Yield the numbers of seeds at which a point may stop.

    >>> list(checkpoints(40))
    [8, 12, 16, 24, 32, 40]
    """
    number = FEWEST_SEEDS
    while number < most:
        yield number
        number = number * 3 // 2 if number & (number - 1) == 0 else number * 4 // 3
    yield most


def targets_in(document: Document) -> tuple[Target, ...]:
    """Return the targets under `until_ci`; report mistakes to the document."""
    if "until_ci" not in document.data:
        return ()
    section = document.data["until_ci"]
    needs = "metrics with widths, such as {position_error_m: 5%}"
    if not is_section(document, ("until_ci",), section, needs):
        return ()
    return tuple(_target(document, metric, value) for metric, value in section.items())


def _target(document: Document, metric: str, value: Any) -> Target:
    path, known = ("until_ci", metric), schema("mission").names
    if metric not in known:
        hint = did_you_mean(metric, known) or "; the columns of missions/ are its metrics"
        document.note(path, f"no such metric{hint}", at_key=True)
    number = isinstance(value, int | float) and not isinstance(value, bool) and value > 0
    share = isinstance(value, str) and re.fullmatch(r"(?=.*[1-9])[0-9]+(\.[0-9]+)? ?%", value)
    if not number and not share:
        message = (
            "needs half the width of the 95 % confidence interval: a share of the mean such as "
            f"5%, or a number > 0; got {described(value)}"
        )
        document.note(path, message)
        return Target(metric, 1.0)
    return Target(metric, value)


@dataclass(frozen=True)
class Experiment:
    """The missions of a campaign: every point with every seed.

    `given` holds the keys that the base scenario's author gave, so that a point may choose another
    kind of route without the defaults of the first; a point maps dotted keys to values.  With
    `until_ci` a point uses as many of the seeds as its targets need.  `warnings` are those of the
    base scenario, except for varied keys, and of varied keys without effect; `unloaded` are
    plug-ins not to be loaded.
    """

    name: str
    given: Mapping[str, Any]
    points: tuple[Point, ...]
    seeds: tuple[int, ...]
    detail: Detail = "summary"
    until_ci: tuple[Target, ...] = ()
    warnings: tuple[Mistake, ...] = field(default=(), compare=False)
    unloaded: tuple[Mistake, ...] = field(default=(), compare=False)

    def base(self) -> Scenario:
        """Return the scenario without variation."""
        return laid_over(self.given, {})

    def scenario(self, point: int) -> Scenario:
        """Return the scenario of one point."""
        return laid_over(self.given, {**self.points[point], "record.detail": self.detail})

    def varied(self) -> tuple[str, ...]:
        """Return the keys that differ between points, in the order of the experiment file."""
        return tuple(dict.fromkeys(key for point in self.points for key in point))

    def shard(self, part: int, of: int) -> NDArray[np.int64]:
        """Return the mission numbers of one shard, `part` counted from 1.

        If seeds decide when a point stops, a shard has whole points.
        """
        numbers = np.arange(len(self.points) * len(self.seeds))
        unit = numbers // len(self.seeds) if self.until_ci else numbers
        chosen: NDArray[np.int64] = numbers[unit % of == part - 1]
        return chosen

    def record(self) -> dict[str, Any]:
        """Return the experiment as plain data for `campaign.json`, with its folder's file names."""
        return {
            "name": self.name,
            "scenario_as_given": portable(self.given),
            "points": [renamed_point(point, kept_name) for point in self.points],
            "seeds": list(self.seeds),
            "detail": self.detail,
            "until_ci": {target.metric: target.written for target in self.until_ci},
        }

    @classmethod
    def from_record(
        cls, record: Mapping[str, Any], base: Mapping[str, Any], folder: Path
    ) -> "Experiment":
        """Return the experiment of a `record`; its files lie in a folder.

        `base` is its whole base scenario, which keeps defaults that have changed since.

        Raises:
            ValueError: when a file name is not in the `record`.
        """

        def within(name: str, _: str) -> str:
            if not KEPT.fullmatch(name):
                raise ValueError(f"{name!r} is no file of this folder")
            return str((folder / name).absolute())

        return cls(
            record["name"],
            as_it_was(
                former_keys.as_now(renamed(record["scenario_as_given"], within)),
                former_keys.as_now(renamed(base, within)),
                folder,
            ),
            tuple(renamed_point(point, within) for point in record["points"]),
            tuple(record["seeds"]),
            record["detail"],
            tuple(Target(*item) for item in record["until_ci"].items()),
        )


def laid_over(given: Mapping[str, Any], point: Point) -> Scenario:
    """Return the scenario of the given keys with a point's values.

    Raises:
        ValueError: when it is invalid.
    """
    data = deepcopy(dict(given))
    for key, value in sorted(point.items(), key=turn):
        problem = put(data, key, name_of(value) if callable(value) else deepcopy(value))
        if problem:
            raise ValueError(f"{key}: {problem}")
    return Scenario.model_validate(data)


def turn(item: tuple[str, Any]) -> tuple[bool, bool, int]:
    """Return when a key is laid over others: first what chooses a part, then the settings of it."""
    key = item[0]
    return not key.endswith((".model", ".kind")), former_keys.is_former(key), key.count(".")


def as_it_was(given: Mapping[str, Any], base: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the keys given, and those that by default are not what they were in `base` as well,
    whose files are copies in a folder: a modem brings files that were not given.

    >>> given = {"name": "m", "navigation": {"depth_sd_m": 0.5}}
    >>> base = {"name": "m", "navigation": {"depth_sd_m": 0.5, "imu_rate_hz": 10.0}}
    >>> as_it_was(given, base, Path())
    {'name': 'm', 'navigation': {'depth_sd_m': 0.5, 'imu_rate_hz': 10.0}}
    """

    def copied(file: str, kind: str) -> str:
        return str((folder / kept_name(file, kind)).absolute())

    now = laid_over(given, {}).model_dump(mode="json")
    return _with_former(given, base, renamed(now, copied))


def _with_former(
    given: Mapping[str, Any], base: Mapping[str, Any], now: Mapping[str, Any]
) -> dict[str, Any]:
    out = dict(given)
    for key in (key for key in now if key in base):
        parts = given.get(key, {}), base[key], now[key]
        if all(isinstance(part, Mapping) for part in parts):
            if inner := _with_former(*parts):
                out[key] = inner
        elif key not in given and base[key] != now[key]:
            out[key] = base[key]
    return out


def as_written(value: Any) -> str:
    """Return a value as after ``--set key=``; a part given as object, by its name.

    >>> as_written(0.5), as_written([1, "a"]), as_written(None)
    ('0.5', '[1, "a"]', 'null')
    """
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else f"{'-' if value < 0 else ''}.inf"
    return json.dumps(value, ensure_ascii=False, default=name_of)


@dataclass(frozen=True, slots=True)
class PlannedMission:
    """A mission of the plan: its number, point and seed."""

    number: int
    point: int
    seed: int


@dataclass(frozen=True)
class PlannedPoint:
    """A point: its scenario as JSON text, the values of all varied keys, and those that it sets.

    Files have the names of their copies in the campaign's folder.
    """

    scenario: str
    varied: dict[str, Any]
    sets: dict[str, Any]


class ExperimentPlan:
    """All missions of an experiment, point after point, each with every seed."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self.model_version = model_version()
        #: The files of all points, from the name of each copy in the folder.
        self.files: dict[str, str] = {}
        #: The fingerprints of the files of user-defined parts, by ``module:object``.
        self.own_parts: dict[str, str] = {}
        varied = experiment.varied()
        self.points: list[PlannedPoint] = []
        #: The plug-ins to load, with their settings.
        self.plugins: dict[str, tuple[Family[Any], PartChoice]] = {}
        for number, point in enumerate(experiment.points):
            mission = experiment.scenario(number)
            for _, family, name in parts_of(mission):
                if is_plugin(name):
                    self.plugins[f"{family.key}={_canonical(name.plain())}"] = family, name
                    if str(name) not in self.own_parts:
                        self.own_parts[str(name)] = source_sha256(name)
            scenario = mission.model_dump(mode="json")
            self.files |= copies_of(scenario)
            scenario = portable(scenario)
            values = {key: _value(scenario, former_keys.key_now(key)) for key in varied}
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
        """Return the fingerprint of a mission's scenario, seed and model."""
        return mission_id(self.points[mission.point].scenario, mission.seed, self.model_version)

    def fingerprint(self) -> str:
        """Return the sha256 of the plan; equal plans run the same missions."""
        return fingerprint(self.experiment.record(), self.own_parts, self.model_version)


def fingerprint(
    experiment: Mapping[str, Any], own_parts: Mapping[str, str], model_version: str
) -> str:
    """Return the sha256 of a plan from the values in a campaign's record."""
    text = json.dumps([experiment, own_parts], sort_keys=True) + model_version
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def model_version() -> str:
    """Return the version, the model number, and the begin of the code's fingerprint."""
    return f"{version('bindusbl-des')}/{MODEL_VERSION}+{package_sha256()[:12]}"


def mission_id(scenario: str, seed: int, model: str) -> str:
    """Return the fingerprint of one mission."""
    return hashlib.sha256(f"{scenario}\n{seed}\n{model}".encode()).hexdigest()


def _canonical(data: Any) -> str:
    return json.dumps(data, sort_keys=True, separators=(",", ":"))


def _value(scenario: Mapping[str, Any], key: str) -> Any:
    """Return the value of a dotted key in the whole scenario, or None."""
    value: Any = scenario
    for part in key.split("."):
        if isinstance(value, list):
            value = value[int(part)]
        else:
            value = value.get(part) if isinstance(value, dict) else None
    return value


def _kind(values: list[Any]) -> str:
    """Return the type of a column for these values."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {bool}:
        return "bool"
    if kinds <= {int}:
        return "int"
    if kinds <= {int, float}:
        return "float"
    return "text" if kinds <= {str} else "json"
