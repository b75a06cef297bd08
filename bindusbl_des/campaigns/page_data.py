"""A campaign as data of a page: its varied keys, and each point's metrics with their intervals."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..records.metrics import WORST, quantity
from ..report.packing import Packer
from ..results.schemas import schema
from .statistics.intervals import intervals
from .statistics.naming import written
from .statistics.outcomes import Outcomes

if TYPE_CHECKING:
    from .campaign import Campaign

# Steps of a column, as a share of its largest value: more than anybody reads.
PRECISION = 1e-6


def packed_statistics(found: Outcomes, metric: str, points: int, packer: Packer) -> dict[str, Any]:
    """Return mean and half the 95 % interval of a metric at each point, packed for a page.

    As :func:`.statistics.intervals.interval` says: nan where no mission that went well
    has a value, and no interval of a single one.  Where some AUV has no value, `whole` tells in how
    many missions all have one.
    """
    known, whole = intervals(found.by_seed(metric, points)), found.whole(metric, points)
    columns = {
        "mean": packer.add(known.mean, quantum=quantum(known.mean)),
        "half": packer.add(known.half_width, quantum=quantum(known.half_width)),
    }
    if (whole < found.well(points)).any():
        columns["whole"] = packer.add(whole)
    return columns


def packed_names(found: Outcomes, metric: str, points: int, packer: Packer) -> dict[str, Any]:
    """Return the AUV that is most often the worst at each point, and in how many missions it is."""
    first = [next(iter(found.who(point, metric).items()), None) for point in range(points)]
    return {
        "auv": packer.add([np.nan if it is None else int(it[0][3:]) for it in first]),
        "times": packer.add([0 if it is None else it[1] for it in first]),
    }


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


def value_numbers(campaign: "Campaign") -> list[list[int]]:
    """Return of each key, at each point, the number of its value in the list of values."""
    columns = []
    for key in campaign.plan.columns:
        place = {label: number for number, label in enumerate(labels(campaign, key))}
        columns.append([place[written(point.varied[key])] for point in campaign.plan.points])
    return columns


def described(names: Sequence[str]) -> list[dict[str, str]]:
    """Return name, words, unit and meaning of metrics, and whose they are: worst, fleet, mission.

    The `title` says whose a quantity is, its `words` leave that to a heading.
    """
    columns = schema("mission")
    found = []
    for name in names:
        text = columns.field(name).metadata
        meaning = text[b"meaning"].decode().partition("; null where")[0]
        of = _whose(name, meaning)
        words = quantity(name.removeprefix(WORST))
        title = f"{words}, mean of the fleet" if of == "fleet" else quantity(name)
        unit = text[b"unit"].decode()
        found.append(
            {
                "name": name,
                "words": words,
                "title": title,
                "unit": unit,
                "meaning": meaning,
                "of": of,
            }
        )
    return found


def _whose(name: str, meaning: str) -> str:
    if name.startswith(WORST):
        return "worst"
    return "fleet" if meaning.startswith("fleet mean of: ") else "mission"
