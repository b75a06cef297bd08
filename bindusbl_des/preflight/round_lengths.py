"""How long the rounds of a scenario's protocol last, from its slots alone: nothing is simulated."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..protocol.schedules import is_framed
from ..protocol.slots import Slots, slots_of
from ..scenario.families import is_random
from ..scenario.scenario import Scenario


def sequential(slots: Slots, groups: int, fixes: int) -> float:
    """Return the length (s) of a round whose broadcast follows its pings."""
    return slots.round_length(groups, fixes)


def pipelined_round(slots: Slots, groups: int, fixes: int) -> float:
    """Return the time (s) between rounds that ping while the one before them is broadcast."""
    return max(direct_reply(slots, groups), slots.clock.after(0.0, slots.downlink_slot(fixes)))


def pipelined_group(slots: Slots, groups: int, fixes: int) -> float:
    """Return the time (s) between rounds each of whose groups is broadcast as the next one pings.

    The fixes are spread evenly over the groups.
    """
    each, more = divmod(fixes, groups)
    fuller, emptier = (pipelined_round(slots, 1, each + extra) for extra in (1, 0))
    return more * fuller + (groups - more) * emptier


def direct_reply(slots: Slots, groups: int, fixes: int = 0) -> float:
    """Return the length (s) of a round whose pings are answered at once: that of its slots."""
    end = 0.0
    for _ in range(groups):
        end = slots.clock.after(end, slots.uplink_slot)
    return end


def passive(slots: Slots, groups: int, fixes: int = 0) -> float:
    """Return the length (s) of a round in which so many ASVs ping, one in each slot."""
    return direct_reply(slots, groups)


LENGTHS: Mapping[str, Callable[[Slots, int, int], float]] = {
    policy.__name__: policy
    for policy in (sequential, pipelined_round, pipelined_group, direct_reply, passive)
}


@dataclass(frozen=True)
class Rounds:
    """The rounds of a protocol: their slots and policy, and which ping groups they may have.

    With random access there are none: one of no groups is a cycle of the downlink, at its shortest.
    They have `fewest` to `most` groups, together of `auvs` AUVs.  A schedule with frames (`frame`
    in s, else 0) begins each round with a frame.  How long those of a policy of one's own last,
    only it knows; where a number is needed, they are taken for sequential ones.  Passive ranging,
    which has no downlink, is a policy of its own whose groups are of one ASV each.
    """

    slots: Slots
    policy: str
    fewest: int
    most: int
    auvs: int
    frame: float

    @property
    def are_known(self) -> bool:
        """Whether the lengths follow from the slots: those of a policy that ships do."""
        return self.policy in LENGTHS

    def length(self, groups: int, fixes: int) -> float:
        """Return the time (s) that a round of some groups and fixes takes."""
        return LENGTHS.get(self.policy, sequential)(self.slots, groups, fixes)

    def period(self, groups: int, fixes: int) -> float:
        """Return the time (s) from one round to the next: its length, or its frame if longer."""
        return max(self.length(groups, fixes), self.frame)


def rounds_of(scenario: Scenario) -> Rounds:
    """Return the rounds of a scenario's protocol; a plug-in not loaded yet has no frames."""
    protocol, count = scenario.protocol, scenario.auvs.count
    slots = slots_of(scenario)
    if protocol.is_passive:
        return Rounds(slots, "passive", scenario.asvs.count, scenario.asvs.count, count, 0.0)
    if is_random(scenario):
        replies = protocol.downlink == "direct_reply"
        policy = protocol.downlink if replies else "sequential"
        return Rounds(slots, policy, 0, 0, count, 0.0)
    if is_framed(protocol.schedule):
        return Rounds(slots, protocol.downlink, 1, 1, 1, protocol.frame_s)
    fewest = count if protocol.schedule == "one_per_slot" else 1
    return Rounds(slots, protocol.downlink, fewest, count, count, 0.0)
