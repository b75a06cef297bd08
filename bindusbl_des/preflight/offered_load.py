"""What AUVs that ping as they like offer a band, and what can be expected of it beforehand."""

from dataclasses import dataclass

from ..protocol.access.aloha import aloha_success, offered_load, slot_share, slotted_success
from ..protocol.access.named import backoff_slot_s, sensing_of
from ..protocol.slots import Slots, slots_of
from ..scenario.declared import broadcaster_of, schedule_of
from ..scenario.scenario import Scenario

# Of so many fixes in a broadcast header and guard count for nothing.
MANY = 1000


@dataclass(frozen=True)
class OfferedLoad:
    """The load of a scenario's random access.

    `load` is G, of pings or of slots (`lasts_s` each).  `success` is how likely a ping meets no
    other at an ASV that hears all AUVs, None where no closed form tells (csma).  All AUVs send
    about `pings_per_s`.  One that holds back (csma) waits for `window` - 1 slots of `slot_s` in
    quiet at most.  An ASV hears no ping while it answers one for `answer_s`.
    """

    senders: int
    lasts_s: float
    load: float
    success: float | None
    pings_per_s: float
    window: int | None = None
    slot_s: float | None = None
    answer_s: float = 0.0

    @property
    def fixes_per_s(self) -> float:
        """How many pings per second meet no other at such an ASV; all of them with csma.

        Of pings that come while it answers it makes none: r of a rate R, r = R (1 - r T).
        """
        met = self.pings_per_s * (1.0 if self.success is None else self.success)
        return met / (1.0 + met * self.answer_s)

    @property
    def least_fixes_per_s(self) -> float:
        """The same, but with csma as many as of ALOHA: who listens first collides less."""
        if self.success is not None:
            return self.fixes_per_s
        return self.pings_per_s * aloha_success(self.load, self.senders)


def carried_per_s(scenario: Scenario) -> float:
    """Return how many fixes a second its broadcasts carry at most, one behind the other."""
    slots = slots_of(scenario)
    most = slots.messages.most
    counts = (MANY,) if most is None or slots.messages.splits else range(1, most + 1)
    shares = scenario.asvs.count if broadcaster_of(scenario).at_once else 1
    return shares * max(count / slots.downlink_slot(count) for count in counts)


def offered(scenario: Scenario, slots: Slots | None = None) -> OfferedLoad:
    """Return the load that the AUVs of a scenario with random access offer."""
    slots, protocol = slots or slots_of(scenario), scenario.protocol
    senders, every, ping = scenario.auvs.count, protocol.frame_s, slots.ping_duration
    access = schedule_of(scenario).access
    if access == "slotted":
        slot = slots.clock.after(0.0, slots.uplink_slot)
        load = offered_load(senders, slot, every)
        pings = senders * slot_share(slot, every) / slot
        return OfferedLoad(senders, slot, load, slotted_success(load, senders), pings)
    load = offered_load(senders, ping, every)
    answer = slots.messages.airtime(1) if protocol.replies_in_frames else 0.0
    if access == "poisson":
        pings, success = senders / (every + ping), aloha_success(load, senders)
        return OfferedLoad(senders, ping, load, success, pings, answer_s=answer)
    sensing = sensing_of(scenario)
    slot, busy = backoff_slot_s(sensing, slots), load / (1.0 + load)
    held_back = busy * slot * (sensing.window - 1) / 2
    pings = senders / (every + ping + held_back)
    return OfferedLoad(senders, ping, load, None, pings, sensing.window, slot, answer)
