"""A campaign as data of a page: its varied keys, and each point's metrics with their intervals."""

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from .campaigns.statistics.intervals import student_95
from .tables import schema

if TYPE_CHECKING:
    from .campaigns.campaign import Campaign

# Steps of a column, as a share of its largest value: more than anybody reads.
PRECISION = 1e-6

Statistics = dict[str, dict[str, np.ndarray]]


def point_statistics(campaign: "Campaign", metrics: list[str]) -> Statistics:
    """Return of each metric, at each point: mean, half the 95 % interval, and how many missions.

    As :func:`.campaigns.statistics.intervals.interval` says, for all points at once: nan where
    there is no mission that went well, and no interval of a single one.
    """
    points = len(campaign.plan.points)
    missions = campaign.missions
    if not len(missions):
        nothing = np.full(points, np.nan)
        return {
            name: {"mean": nothing, "half": nothing, "count": np.zeros(points)} for name in metrics
        }
    groups = missions[missions.status == "ok"].groupby("point")[metrics]
    found_in = (groups.mean(), groups.std(), groups.count())
    mean, sd, count = (it.reindex(range(points)) for it in found_in)
    most = int(np.nan_to_num(count.to_numpy()).max(initial=0))
    freedom = np.array([math.nan, *(student_95(n) for n in range(1, max(most, 2)))])
    found = {}
    for name in metrics:
        known = count[name].fillna(0).to_numpy(dtype=int)
        factor = np.where(known > 1, freedom[np.maximum(known - 1, 0)], np.nan)
        half = factor * sd[name].to_numpy() / np.sqrt(np.maximum(known, 1))
        found[name] = {"mean": mean[name].to_numpy(), "half": half, "count": known}
    return found


def quantum(column: np.ndarray) -> float:
    """Return the step to which a column is rounded in a page."""
    known = np.abs(column[np.isfinite(column)])
    return float(known.max()) * PRECISION if len(known) and known.max() > 0 else PRECISION


def keys(campaign: "Campaign") -> list[dict[str, Any]]:
    """Return the varied keys with their values, numbers in ascending order."""
    return [
        {"key": key, "values": values(campaign, key), "labels": labels(campaign, key)}
        for key in campaign.plan.columns
    ]


def values(campaign: "Campaign", key: str) -> list[float] | None:
    """Return the different values of a key if all of them are numbers."""
    if campaign.plan.columns[key] not in ("int", "float"):
        return None
    found = {point.varied[key] for point in campaign.plan.points}
    return None if None in found else sorted(float(value) for value in found)


def labels(campaign: "Campaign", key: str) -> list[str]:
    """Return the different values of a key as text, in the order in which they are shown."""
    numbers = values(campaign, key)
    if numbers is not None:
        return [written(value) for value in numbers]
    return list(dict.fromkeys(written(point.varied[key]) for point in campaign.plan.points))


def written(value: Any) -> str:
    """Return one value of a key as text, numbers to six digits.

    >>> written(70.0), written(99.55962284528422), written("dsatur"), written([0, None])
    ('70', '99.5596', 'dsatur', '[0, null]')
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:.6g}"
    return value if isinstance(value, str) else json.dumps(value)


def value_numbers(campaign: "Campaign") -> list[list[int]]:
    """Return of each key, at each point, the number of its value in the list of values."""
    columns = []
    for key in campaign.plan.columns:
        place = {label: number for number, label in enumerate(labels(campaign, key))}
        columns.append([place[written(point.varied[key])] for point in campaign.plan.points])
    return columns


def described(names: list[str]) -> list[dict[str, str]]:
    """Return name, unit and meaning of metrics."""
    columns = schema("mission")
    texts = {name: columns.field(name).metadata for name in names}
    return [
        {"name": name, "unit": text[b"unit"].decode(), "meaning": text[b"meaning"].decode()}
        for name, text in texts.items()
    ]
