"""What became of the pings by which AUVs are located: counts for each AUV."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...records.events import COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from ...records.recorder import Recorder
from ...records.rows import Rows

Counts = dict[str, list[Any]]


def heard_of_auvs(record: Recorder, auvs: int, begin: float = 0.0) -> Counts:
    """Return what became of the pings of each AUV that were sent from an instant (s) on."""
    pings, receptions = record.pings.rows, record.receptions.rows
    landed = np.ones(len(pings), dtype=bool)
    outcome = receptions["outcome"].copy()  # rows are long: what is looked at twice lies together
    landed[receptions["ping"][outcome == IN_FLIGHT]] = False
    late, sender = pings["sent_at_s"] >= begin, pings["auv"]
    in_range, landed = late & (pings["in_range_of"] > 0), late & landed
    lost = np.flatnonzero(outcome == LOST)
    covered = _count(sender[landed & in_range], auvs)
    return {
        "pings": _count(sender[late], auvs),
        "pings_in_range": _count(sender[in_range], auvs),
        "pings_heard": _count(sender[late & (pings["heard_by"] > 0)], auvs),
        "hf_coverage": _shares(covered, _count(sender[landed], auvs)),
        "receptions_lost": _count(receptions["auv"][lost[late[receptions["ping"][lost]]]], auvs),
        "collisions": _count(
            np.append(destroyed(record, begin)["auv"], calls_destroyed(record, begin)["auv"]), auvs
        ),
        "frame_collisions": _count(frames_destroyed(record, begin)["auv"], auvs),
    }


def destroyed(record: Recorder, begin: float = 0.0) -> Rows:
    """Return the receptions of pings, sent from an instant (s) on, that another signal destroyed.

    A ping whose call was destroyed was never sent: its call counts, in :func:`calls_destroyed`.
    """
    rows = record.receptions.rows
    met = rows[rows["outcome"] == COLLIDED]
    met = met[~np.isnan(met["arrived_at_s"])]
    since: Rows = met[record.pings.rows["sent_at_s"][met["ping"]] >= begin]
    return since


def calls_destroyed(record: Recorder, begin: float = 0.0) -> Rows:
    """Return the pings whose call, sent from an instant (s) on, was destroyed at its AUV."""
    rows = record.pings.rows
    found: Rows = rows[(rows["call"] == COLLIDED) & (rows["sent_at_s"] >= begin)]
    return found


def frames_destroyed(record: Recorder, begin: float = 0.0) -> Rows:
    """Return the receptions of frames, from an instant (s) on, that another frame, or its AUV's
    ping, destroyed.
    """
    rows = record.frame_receptions.rows
    found: Rows = rows[(rows["outcome"] == COLLIDED) & (rows["arrived_at_s"] >= begin)]
    return found


def heard_by_auvs(record: Recorder, auvs: int, begin: float = 0.0) -> Counts:
    """Return what became of the pings of all ASVs at each AUV (passive ranging), of those that were
    sent from an instant (s) on.
    """
    late = record.pings.rows["sent_at_s"] >= begin
    receptions, pings = record.receptions.rows, int(late.sum())
    receptions = receptions[late[receptions["ping"]]]
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
        "collisions": _count(destroyed(record, begin)["auv"], auvs),
        "frame_collisions": [0] * auvs,
    }


def _count(of: NDArray[np.int64], auvs: int) -> list[int]:
    counts: list[int] = np.bincount(of, minlength=auvs).tolist()
    return counts


def _shares(parts: list[int], wholes: list[int]) -> list[float | None]:
    return [part / whole if whole else None for part, whole in zip(parts, wholes, strict=True)]
