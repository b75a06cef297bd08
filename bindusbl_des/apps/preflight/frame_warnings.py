"""Warnings about frames that AUVs hardly ever decode, or decode too late.

Reasons: ASVs take turns, a slot begins before the frame that names it arrives, frames overlap.
"""

import itertools
import math
from collections.abc import Iterator

import numpy as np

from ...core.scenario import families
from ...core.setup import Setup
from ...support.mistakes import Problem
from ...support.plugins import PluginError
from .fix_chance import told_ahead
from .limits import SurveySights, groups_made, planned_sights, slots_made, told
from .round_lengths import gap_s, rounds_of
from .whereabouts import named, shapes

# AUVs with less than this share of an even share of fixes get none but by chance.
HARDLY_EVER = 0.01

# Broadcasters that cannot fall in step with the turns of AUVs
ANYWHERE = [
    name
    for name, rule in families.BROADCASTER.traits.items()
    if rule.chosen_by in ("lot", "distance")
]


def frame_warnings(setup: Setup, by_turns: bool, is_told: bool, meet: bool) -> Iterator[Problem]:
    """Yield warnings about ASVs in turn (`by_turns`), slots named in frames (`is_told`), and
    overlaps (`meet`).
    """
    try:
        seen = planned_sights(setup)
    except (PluginError, ValueError):  # only the plug-in knows where AUVs go
        return
    if by_turns:
        yield from _turns(setup, seen)
    if is_told:
        yield from _late(setup, seen)
    if meet:
        yield from _overlapping(setup, seen)


def _turns(setup: Setup, seen: SurveySights) -> Iterator[Problem]:
    """Yield AUVs that hardly ever get a fix, since the ASVs whose turn it is do not reach them.

    ASVs take turns in step with the AUVs, or one ASV names an AUV's slot and another sends its fix.
    """
    protocol, asvs = setup.scenario.protocol, setup.scenario.asvs
    ahead = told_ahead(setup, protocol.downlink)
    _, delivered, cycle = told(setup, seen, protocol.downlink)
    fair = seen.at_best.mean(axis=0) / asvs.count
    missed = (delivered.mean(axis=0) < HARDLY_EVER * fair).nonzero()[0].tolist()
    if not missed or not (ahead or cycle > 1):
        return
    *some, last = ANYWHERE
    others, auvs = f"use {', '.join(some)} or {last}", named("AUV", missed)
    free = next(n for n in itertools.count(asvs.count + 1) if math.gcd(n, cycle) == 1)
    message = (
        f"{protocol.broadcaster} keeps ASVs in step with the turns of AUVs, which come back "
        f"after {cycle} broadcasts: {auvs} always told by ASVs out of reach, and never fixed; "
        f"{others}" + ("" if asvs.failures else f", or {free} ASVs")
    )
    if ahead:
        message = (
            f"{protocol.broadcaster} has one ASV tell AUVs their slots and another their fixes: "
            f"{auvs} hardly ever reached by both, and so hardly ever fixed; {others}, or "
            "protocol.knowledge: {model: broadcast, missed: last_slot}"
        )
    keys = ("protocol.schedule", "protocol.downlink", "asvs.count", "auvs.count")
    yield Problem("protocol.broadcaster", message, keys)


def _late(setup: Setup, seen: SurveySights) -> Iterator[Problem]:
    """Yield AUVs that learn the first slot of a round too late: after it has begun."""
    rounds, count = rounds_of(setup), setup.scenario.auvs.count
    slots, fixes = rounds.slots, rounds.auvs
    made = slots_made(setup.schedule, seen.heard)
    groups = rounds.fewest if made is None else int(made.max(axis=1).min()) + 1
    left = max(rounds.least(groups, fixes), rounds.frame)
    if told_ahead(setup, setup.scenario.protocol.downlink) == 1:  # after the pings of its own
        left -= (groups + rounds.contention) * rounds.shortest.uplink_slot
    is_first = np.ones((1, count), np.bool_) if made is None else made == 0
    at_all = seen.reached & is_first[..., np.newaxis]
    way = np.where(at_all, seen.away_m, 0.0) / slots.sound_speed
    untold = int(is_first.sum(axis=1).max())
    for message in slots.messages.packed(fixes, rounds.named):  # names AUVs in the order of slots
        untold, left = untold - message.named, left - message.airtime_s
        if untold <= 0:
            break
    needed = np.where(at_all, way + message.delay_s, 0.0)
    auvs = np.flatnonzero((needed > left).any(axis=(0, 2))).tolist()
    if auvs:
        yield Problem(
            "protocol.knowledge",
            f"a round may begin {left:.4g} s after the frame that tells its slots, which is "
            f"decoded up to {needed.max():.4g} s after its end: {named('AUV', auvs)} told of a "
            "first slot too late to ping in it; give protocol.downlink_guard_s "
            f"{_up(needed.max())} or more",
            ("protocol.downlink_guard_s", "acoustics.mf.modem", "acoustics.mf.range_m"),
        )


def _overlapping(setup: Setup, seen: SurveySights) -> Iterator[Problem]:
    """Yield AUVs at which the end of a frame may overlap the beginning of the next one.

    The first frame comes from a farther ASV than the second.
    """
    made = groups_made(setup.schedule, seen.heard)
    gap = gap_s(setup, None if made is None else int(made.min()))
    farthest = np.where(seen.reached, seen.away_m, -np.inf).max(axis=2)
    nearest = np.where(seen.reached, seen.away_m, np.inf).min(axis=2)
    apart = np.maximum(farthest - nearest, 0.0) / setup.sound_speed_m_per_s
    auvs = np.flatnonzero((apart > gap).any(axis=0)).tolist()
    if auvs:
        yield Problem(
            "protocol.downlink",
            f"the next frame may begin {gap:.4g} s after one has ended, which takes up to "
            f"{apart.max():.4g} s longer on its way: {named('AUV', auvs)} where both overlap, and "
            f"neither is decoded; give protocol.downlink_guard_s {_up(apart.max())} or more",
            ("protocol.downlink_guard_s", "asvs.formation.radius_m", *shapes(setup.scenario)),
        )


def _up(seconds: float) -> str:
    """Return a time (s) as a text, rounded up to a hundredth."""
    return f"{math.ceil(100.0 * seconds) / 100.0:g}"
