"""What AUVs that ping as they like offer a band, and what can be expected of it beforehand."""

from dataclasses import dataclass

from ..protocol.access.closed_forms import aloha_success, offered_load, slot_share, slotted_success
from ..protocol.access.named import backoff_slot_s, sensing_of
from ..protocol.slots import Slots, slots_of
from ..scenario.scenario import Scenario


@dataclass(frozen=True)
class OfferedLoad:
    """The load of a scenario's random access.

    `load` is G, of pings or of slots (`lasts_s` each).  `success` is how likely a ping meets no
    other at an ASV that hears all AUVs, None where no closed form tells (csma).  All AUVs send
    about `pings_per_s`.  One that holds back (csma) waits for `window` - 1 slots of `slot_s` in
    quiet at most.
    """

    senders: int
    lasts_s: float
    load: float
    success: float | None
    pings_per_s: float
    window: int | None = None
    slot_s: float | None = None

    @property
    def fixes_per_s(self) -> float:
        """How many pings per second meet no other at such an ASV; all of them with csma."""
        return self.pings_per_s * (1.0 if self.success is None else self.success)


def offered(scenario: Scenario, slots: Slots | None = None) -> OfferedLoad:
    """Return the load that the AUVs of a scenario with random access offer."""
    slots, protocol = slots or slots_of(scenario), scenario.protocol
    senders, every, ping = scenario.auvs.count, protocol.frame_s, slots.ping_duration
    if protocol.schedule == "slotted_aloha":
        slot = slots.clock.after(0.0, slots.uplink_slot)
        load = offered_load(senders, slot, every)
        pings = senders * slot_share(slot, every) / slot
        return OfferedLoad(senders, slot, load, slotted_success(load, senders), pings)
    load = offered_load(senders, ping, every)
    if protocol.schedule == "aloha":
        pings = senders / (every + ping)
        return OfferedLoad(senders, ping, load, aloha_success(load, senders), pings)
    sensing = sensing_of(scenario)
    slot, busy = backoff_slot_s(sensing, slots), load / (1.0 + load)
    held_back = busy * slot * (sensing.window - 1) / 2
    pings = senders / (every + ping + held_back)
    return OfferedLoad(senders, ping, load, None, pings, sensing.window, slot)
