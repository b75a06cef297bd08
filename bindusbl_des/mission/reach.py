"""How far signals reached, which destroyed each other, and whether the schedule is to blame."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..records.events import COLLIDED, HEARD, IN_FLIGHT, LOST, NONE, OUT_OF_RANGE, WORDS
from ..records.rows import Recorder, Row, Rows
from ..results.violations import Violation, Violations
from .world import World

Counts = dict[str, list[Any]]

# What somebody sent itself as a signal came, by the reason of the record
OWN = {
    "own_ping": "a ping of its own",
    "own_frame": "a frame of its own",
    "own_packet": "data of its own",
}


def heard_of_auvs(record: Recorder, auvs: int, begin: float) -> Counts:
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


def heard_by_auvs(record: Recorder, auvs: int, begin: float) -> Counts:
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


def violations_of(world: World) -> Violations | None:
    """Return what broke the schedule of a mission; None with random access, which has none.

    Receptions of pings, calls and frames are counted that others destroyed: the metrics
    `collisions` and `frame_collisions`.
    """
    if world.setup.scenario.protocol.random_access:
        return None
    record = world.record
    heard, calls, frames = destroyed(record), calls_destroyed(record), frames_destroyed(record)
    count = len(heard) + len(calls) + len(frames)
    firsts = [*_ping(world, heard), *_call(world, calls), *_frame(world, frames)]
    return Violations(count, min(firsts, key=lambda violation: violation.at_s, default=None))


def _ping(world: World, receptions: Rows) -> Iterator[Violation]:
    """Yield the ping among destroyed receptions that arrived first."""
    if not len(receptions):
        return
    reception = receptions[np.argmin(receptions["arrived_at_s"])]
    ping = world.record.pings.rows[reception["ping"]]
    passive = world.setup.scenario.protocol.asvs_ping
    sender, receiver = f"AUV{ping['auv']}", f"ASV{reception['asv']}"
    if passive:
        sender, receiver = f"ASV{ping['asv']}", f"AUV{reception['auv']}"
    others = tuple(_strongest(world, reception))
    yield Violation(
        "ping", float(reception["arrived_at_s"]), sender, receiver, int(ping["round"]),
        int(ping["slot"]), others,
    )  # fmt: skip


def _strongest(world: World, line: Row) -> Iterator[str]:
    """Yield who sent what destroyed a reception of a ping or frame, the strongest of all."""
    why, by = WORDS[line["why"]], int(line["overlapped_by"])
    if why in OWN:
        yield OWN[why]
    elif why == "ping":
        ping = world.record.pings.rows[by]
        yield f"that of AUV{ping['auv']}" if ping["asv"] == NONE else f"that of ASV{ping['asv']}"
    elif why == "frame":
        yield f"that of ASV{world.record.broadcasts[by].asv}"
    elif why == "packet":
        yield f"data of AUV{world.record.packets[by].auv}"
    elif why == "auv_frame":
        yield f"that of AUV{world.record.auv_frames[by].auv}"
    elif why == "call":
        yield f"a call of ASV{by}"


def _call(world: World, destroyed: Rows) -> Iterator[Violation]:
    """Yield the first call, of pings that were not sent, that another destroyed at its AUV."""
    if not len(destroyed):
        return
    pings = world.record.pings.rows
    call = destroyed[np.argmin(destroyed["called_at_s"])]
    same = (pings["called_at_s"] == call["called_at_s"]) & (pings["called_by"] != call["called_by"])
    others = tuple(f"that of ASV{asv}" for asv in np.unique(pings["called_by"][same]))
    yield Violation(
        "call", float(call["called_at_s"]), f"ASV{call['called_by']}", f"AUV{call['auv']}",
        int(call["round"]), int(call["slot"]), others,
    )  # fmt: skip


def _frame(world: World, frames: Rows) -> Iterator[Violation]:
    """Yield the first of frames that another destroyed at an AUV."""
    if not len(frames):
        return
    frame = frames[np.argmin(frames["broadcast"])]
    sent = world.record.broadcasts[int(frame["broadcast"])]
    yield Violation(
        "frame", sent.sent_at_s, f"ASV{sent.asv}", f"AUV{frame['auv']}", sent.round, None,
        tuple(_strongest(world, frame)),
    )  # fmt: skip
