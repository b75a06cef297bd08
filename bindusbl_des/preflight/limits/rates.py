"""How often AUVs would be fixed if pings and frames were lost by range alone."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ...protocol.cycles import cycle
from ...protocol.slots import Slots
from ...scenario.declared import DOWNLINKS, schedule_of
from ...scenario.families import is_random
from ...scenario.scenario import Scenario
from ..round_lengths import Rounds
from .groups import Ints, groups_made
from .sights import Floats, Sights

# Whose rates stand beside those of the scenario's own rounds.
POLICIES = ("sequential", "pipelined_round")


@dataclass(frozen=True)
class Rates:
    """How often (1/s) each of n AUVs is fixed, (n,), as a mean over the mission."""

    each: Floats

    @property
    def mean(self) -> float:
        """The mean of the fleet."""
        return float(self.each.mean())

    @property
    def worst(self) -> int:
        """The number of the AUV with the lowest rate."""
        return int(self.each.argmin())

    @property
    def lowest(self) -> float:
        """The rate of that AUV."""
        return float(self.each[self.worst])


def rates_of(
    scenario: Scenario, rounds: Rounds, sights: Sights, senders: int, records_hz: float | None
) -> dict[str, Rates]:
    """Return the rates of a scenario's own rounds (`planned`; none where they are not known), of
    sequential and pipelined ones of its schedule, and with frame behind frame (`back_to_back`).

    `senders` broadcast at once; the downlink carries `records_hz` (1/s) at most, None: has none.
    """
    protocol, heard, delivered = scenario.protocol, sights.heard, sights.delivered
    if protocol.is_passive:
        every = rounds.length(rounds.most, 0) / scenario.asvs.count
        return {"planned": Rates(np.asarray(delivered.mean(axis=0) / every))}
    found: dict[str, Rates] = {}
    if rounds.frame and rounds.are_known:
        in_turn = np.full(len(heard), scenario.auvs.count * rounds.period(1, 1))
        found["planned"] = _shared(delivered, in_turn)
    groups = groups_made(schedule_of(scenario), heard)
    if groups is not None and not rounds.frame:
        policies = dict.fromkeys((protocol.downlink, *POLICIES))
        if protocol.replies:
            policies = {protocol.downlink: None}
        for policy in policies:
            if policy in DOWNLINKS:
                name = "planned" if policy == protocol.downlink else policy
                found[name] = _shared(delivered, _lengths(policy, rounds, groups, sights.made))
    if records_hz is not None:
        frames = _airtimes(rounds.slots, sights.made, senders)
        if is_random(scenario) or protocol.replies:  # whatever waits, or one fix each
            frames = np.maximum(sights.made.sum(axis=1), 1.0) / records_hz
        found["back_to_back"] = _shared(sights.at_best, frames)
    return found


def _shared(delivered: Floats, lengths: Floats) -> Rates:
    """Return the rates of AUVs whose ping in each round (k,), s, makes as many fixes (k, n)."""
    return Rates(np.asarray((delivered / lengths[:, np.newaxis]).mean(axis=0)))


def _lengths(policy: str, rounds: Rounds, groups: Ints, made: Floats) -> Floats:
    """Return how long (s) rounds are at each instant (k,), with as many fixes (k, n) as are
    made on average.
    """
    further, told, slots = rounds.contention, rounds.named, rounds.slots
    length = cache(lambda count, fixes: cycle(policy, slots, count + further, fixes, told).length_s)
    fixes = np.rint(made.sum(axis=1)).astype(np.int64).tolist()
    return np.array([length(*it) for it in zip(groups.tolist(), fixes, strict=True)])


def _airtimes(slots: Slots, made: Floats, senders: int) -> Floats:
    """Return how long (s) frames with all fixes (k, n) are at each instant (k,), if so many ASVs
    share them evenly.
    """
    airtime = cache(slots.airtime)
    fixes = np.maximum(np.ceil(np.rint(made.sum(axis=1)) / senders), 1.0).astype(np.int64)
    return np.array([airtime(count) for count in fixes.tolist()])
