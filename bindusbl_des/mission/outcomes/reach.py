"""What became of the pings by which AUVs are located: counts for each AUV."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...records.events import COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from ...records.recorder import Recorder

Counts = dict[str, list[Any]]


def heard_of_auvs(record: Recorder, auvs: int) -> Counts:
    """Return what became of the pings of each AUV."""
    pings, receptions = record.pings.rows, record.receptions.rows
    sender, outcome = pings["auv"], receptions["outcome"]
    landed = np.ones(len(pings), dtype=bool)
    landed[receptions["ping"][outcome == IN_FLIGHT]] = False
    in_range = pings["in_range_of"] > 0
    covered = _count(sender[landed & in_range], auvs)
    return {
        "pings": _count(sender, auvs),
        "pings_in_range": _count(sender[in_range], auvs),
        "pings_heard": _count(sender[pings["heard_by"] > 0], auvs),
        "hf_coverage": _shares(covered, _count(sender[landed], auvs)),
        "receptions_lost": _count(receptions["auv"][outcome == LOST], auvs),
        "collisions": _count(receptions["auv"][outcome == COLLIDED], auvs),
    }


def heard_by_auvs(record: Recorder, auvs: int) -> Counts:
    """Return what became of the pings of all ASVs at each AUV (passive ranging)."""
    receptions, pings = record.receptions.rows, record.pings.count
    listener, outcome = receptions["auv"], receptions["outcome"]
    in_range = _count(listener[outcome != OUT_OF_RANGE], auvs)
    under_way = _count(listener[outcome == IN_FLIGHT], auvs)
    covered = [near - late for near, late in zip(in_range, under_way, strict=True)]
    return {
        "pings": [pings] * auvs,
        "pings_in_range": in_range,
        "pings_heard": _count(listener[outcome == HEARD], auvs),
        "hf_coverage": _shares(covered, [pings - late for late in under_way]),
        "receptions_lost": _count(listener[outcome == LOST], auvs),
        "collisions": _count(listener[outcome == COLLIDED], auvs),
    }


def _count(of: NDArray[np.int64], auvs: int) -> list[int]:
    counts: list[int] = np.bincount(of, minlength=auvs).tolist()
    return counts


def _shares(parts: list[int], wholes: list[int]) -> list[float | None]:
    return [part / whole if whole else None for part, whole in zip(parts, wholes, strict=True)]
