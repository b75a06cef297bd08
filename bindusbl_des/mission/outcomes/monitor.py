"""The monitor of a mission: signals of its schedule that overlapped, and the first of them."""

from collections.abc import Iterator

import numpy as np

from ...acoustics.propagation import TOUCH
from ...protocol.conflicts import hearing
from ...records.rows import Row, Rows
from ...results.violations import Violation, Violations
from ...scenario.families import is_random
from ..world import World
from .reach import calls_destroyed, destroyed, frames_destroyed


def violations_of(world: World) -> Violations | None:
    """Return what broke the schedule of a mission; None with random access, which has none.

    Receptions of pings, calls and frames are counted that others destroyed: the metrics
    `collisions` and `frame_collisions`.
    """
    if is_random(world.scenario):
        return None
    record = world.record
    heard, calls, frames = destroyed(record), calls_destroyed(record), frames_destroyed(record)
    count = len(heard) + len(calls) + len(frames)
    firsts = [*_ping(world, heard), *_call(world, calls), *_frame(world, frames)]
    return Violations(count, min(firsts, key=lambda it: it.at_s, default=None))


def _ping(world: World, receptions: Rows) -> Iterator[Violation]:
    """Yield the ping among destroyed receptions that arrived first."""
    if not len(receptions):
        return
    it = receptions[np.argmin(receptions["arrived_at_s"])]
    ping = world.record.pings.rows[it["ping"]]
    passive = world.scenario.protocol.is_passive
    sender, receiver = f"AUV{ping['auv']}", f"ASV{it['asv']}"
    if passive:
        sender, receiver = f"ASV{ping['asv']}", f"AUV{it['auv']}"
    others = tuple(_overlapping(world, it))
    yield Violation(
        "ping", float(it["arrived_at_s"]), sender, receiver, int(ping["round"]),
        int(ping["slot"]), others,
    )  # fmt: skip


def _overlapping(world: World, it: Row) -> Iterator[str]:
    """Yield who sent what overlaps a reception at its receiver: other pings, and calls."""
    lasts = world.scenario.acoustics.hf.ping_s - TOUCH
    receptions, pings = world.record.receptions.rows, world.record.pings.rows
    passive = world.scenario.protocol.is_passive
    there = "auv" if passive else "asv"
    near = np.abs(receptions["arrived_at_s"] - it["arrived_at_s"]) < lasts
    near &= receptions["ping"] != it["ping"]
    for other in np.flatnonzero(near & (receptions[there] == it[there])):
        if receptions["sound"][other] > 0.0:
            ping = pings[receptions["ping"][other]]
            yield f"that of ASV{ping['asv']}" if passive else f"that of AUV{ping['auv']}"
    called = pings[pings["called_by"] >= 0]
    if not len(called):
        return
    here = np.array(world.asv_fleet.vehicles[it["asv"]].at(float(it["arrived_at_s"]))[:3])
    told = set()
    for ping in called[np.abs(called["called_at_s"] - it["arrived_at_s"]) < 1.0 + lasts]:
        caller, sent = int(ping["called_by"]), float(ping["called_at_s"])
        source = np.array(world.asv_fleet.vehicles[caller].at(sent)[:3])
        band = world.network.uplink.band
        arrives = sent + float(np.linalg.norm(source - here)) / band.sound_speed
        is_near = hearing(source[None], here[None], band.reach, band.slant)[0, 0]
        if is_near and abs(arrives - it["arrived_at_s"]) < lasts:
            told.add(f"a call of ASV{caller}")
    yield from sorted(told)


def _call(world: World, destroyed: Rows) -> Iterator[Violation]:
    """Yield the first call, of pings that were not sent, that another destroyed at its AUV."""
    if not len(destroyed):
        return
    pings = world.record.pings.rows
    it = destroyed[np.argmin(destroyed["called_at_s"])]
    same = (pings["called_at_s"] == it["called_at_s"]) & (pings["called_by"] != it["called_by"])
    others = tuple(f"that of ASV{asv}" for asv in np.unique(pings["called_by"][same]))
    yield Violation(
        "call", float(it["called_at_s"]), f"ASV{it['called_by']}", f"AUV{it['auv']}",
        int(it["round"]), int(it["slot"]), others,
    )  # fmt: skip


def _frame(world: World, frames: Rows) -> Iterator[Violation]:
    """Yield the first of frames that another destroyed at an AUV."""
    if not len(frames):
        return
    it = frames[np.argmin(frames["broadcast"])]
    sent = world.record.broadcasts[int(it["broadcast"])]
    yield Violation(
        "frame", sent.sent_at_s, f"ASV{sent.asv}", f"AUV{it['auv']}", sent.round, None, ()
    )  # fmt: skip
