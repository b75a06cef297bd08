"""How long the rounds of a scenario's protocol last, from its slots alone; or what AUVs that ping
as they like offer a band, and what can be expected of it. Nothing is simulated.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from ...core.protocol.cycles import STAND_IN, cycle
from ...core.protocol.slots import Slots
from ...core.scenario import families
from ...core.setup import Setup
from ...models.access.csma import CarrierSense, backoff_slot_s
from .bounds import aloha_success, offered_load, slot_share, slotted_success


@dataclass(frozen=True)
class Rounds:
    """The rounds of a protocol: their slots and downlink, and which ping groups they may have.

    With random access there are none: one of no groups is a cycle of the downlink, at its shortest.
    They have `fewest` to `most` groups, together of `auvs` AUVs.  A schedule with frames (`frame`
    in s, else 0) begins each round with a frame.  How long those of a downlink of one's own last,
    only it knows; where a number is needed, they are taken for sequential ones.  With passive
    ranging there is no downlink (None), and groups are of one ASV each.  Broadcasts tell
    `named` AUVs their slots, and after the groups there may be a slot for others (`contention`).
    Where slots are not all of T_UL, `pace` has those of the shortest and of the longest.
    """

    slots: Slots
    downlink: str | None
    fewest: int
    most: int
    auvs: int
    frame: float
    pace: tuple[Slots, Slots] | None = None
    named: int = 0
    contention: bool = False

    @property
    def are_known(self) -> bool:
        """Whether the lengths follow from the slots: those of a downlink that ships do."""
        return self.downlink is None or self.downlink in families.DOWNLINK.traits

    @property
    def broadcasts(self) -> bool:
        """Whether fixes are broadcast, so that their number decides how long a round lasts."""
        return (
            self.downlink is not None
            and not families.DOWNLINK.traits.get(self.downlink, families.DownlinkTraits()).replies
        )

    @property
    def shortest(self) -> Slots:
        """The slots where none is longer than it must be."""
        return self.slots if self.pace is None else self.pace[0]

    def length(self, groups: int, fixes: int) -> float:
        """Return the time (s) that a round of some groups and fixes takes, at most."""
        return self._lasts(self.slots if self.pace is None else self.pace[1], groups, fixes)

    def least(self, groups: int, fixes: int) -> float:
        """Return the time (s) that it takes at least."""
        return self._lasts(self.shortest, groups, fixes)

    def _lasts(self, slots: Slots, groups: int, fixes: int) -> float:
        return cycle(self.downlink, slots, groups + self.contention, fixes, self.named).length_s

    def usual(self, groups: int, fixes: int) -> float:
        """Return about how long (s) it is from one round to the next."""
        return max((self.least(groups, fixes) + self.length(groups, fixes)) / 2, self.frame)

    def period(self, groups: int, fixes: int) -> float:
        """Return the time (s) from one round to the next: its length, or its frame if longer."""
        return max(self.length(groups, fixes), self.frame)

    def pace_lines(self, schedule: families.ScheduleTraits) -> Iterator[str]:
        """Yield how long slots are that are not all of T_UL."""
        if self.pace is None:
            return
        least = 1e3 * self.pace[0].uplink_slot
        if schedule.pace == "answered":
            yield (
                f"The next AUV is called when one has answered, {least:.1f} ms after its call if "
                "it is right below its caller; who is not answered waits for T_UL."
            )
        else:
            yield (
                f"Arrivals follow each other every {least:.1f} ms (T_P + clear_s), further apart "
                "where AUVs may be misplaced; the first needs the longest travel time at most."
            )


def rounds_of(setup: Setup) -> Rounds:
    """Return the rounds of a scenario's protocol; a plug-in not loaded yet has no frames."""
    scenario, protocol, slots = setup.scenario, setup.scenario.protocol, setup.slots
    count, asvs, schedule = scenario.auvs.count, scenario.asvs.count, setup.schedule
    if protocol.asvs_ping:
        return Rounds(slots, None, asvs, asvs, count, 0.0)
    if protocol.random_access:
        downlink = protocol.downlink if protocol.replies else STAND_IN
        return Rounds(slots, downlink, 0, 0, count, 0.0)
    named = count if setup.tells_slots else 0
    contention = named > 0 and protocol.dissemination.missed == "contention"
    rounds = Rounds(
        slots, protocol.downlink, 1, count, count, 0.0, named=named, contention=contention
    )
    if schedule.framed:
        return replace(rounds, most=1, auvs=1, frame=protocol.frame_s, named=min(named, 1))
    settings = setup.schedule_settings
    if settings.most_groups is not None:
        most = min(count, settings.most_groups)
        turns = min(count, most * asvs)
        return replace(rounds, most=most, auvs=turns, named=min(named, turns))
    fewest = count if schedule.groups == "each" and not settings.shares_calls else 1
    return replace(rounds, fewest=fewest, pace=pace_of(setup, slots))


def gap_s(setup: Setup, groups: int | None = None) -> float:
    """Return how long (s) it is at least from the end of a broadcast to the beginning of the next,
    by the slots, in rounds of so many ping groups (the fewest) in which all AUVs are fixed.

    What lies between the frames of a downlink of one's own only it knows: for ever.
    """
    rounds, downlink = rounds_of(setup), setup.downlink
    slots, fixes, named = rounds.slots, max(rounds.auvs, 1), rounds.named
    if not rounds.are_known or not rounds.broadcasts:
        return math.inf
    if setup.broadcaster.at_once:
        return slots.downlink_guard
    if setup.scenario.protocol.random_access:
        return slots.downlink_slot(fixes) - slots.airtime(fixes)
    if downlink.by_group and not rounds.frame:
        return max(slots.downlink_slot(1), slots.uplink_slot) - slots.airtime(1)
    lasts = max(rounds.least(groups or rounds.fewest, fixes), rounds.frame)
    return lasts - slots.airtime(fixes, named)


def pace_of(setup: Setup, slots: Slots) -> tuple[Slots, Slots] | None:
    """Return slots of the shortest and of the longest length, of schedules without T_UL.

    An AUV right below its caller answers soonest; who is not answered waits for T_UL.  Packed
    arrivals follow each other, the first after the longest way at most; AUVs are taken to be where
    they are believed.
    """
    scenario, ping, pace = setup.scenario, slots.ping_duration, setup.schedule.pace
    if pace == "answered":
        way = min(auv.depth_m for auv in setup.auvs) / slots.sound_speed
        answered = 2.0 * (ping + way) + scenario.protocol.turnaround_s + slots.answer
        return replace(slots, uplink_slot=min(answered, slots.uplink_slot)), slots
    if pace == "packed":
        lasts = ping + setup.schedule_settings.pause_s + slots.answer
        first = slots.longest_travel_time / scenario.auvs.count
        return replace(slots, uplink_slot=lasts), replace(slots, uplink_slot=lasts + first)
    return None


# Of so many fixes in a broadcast header and guard count for nothing.
MANY = 1000


@dataclass(frozen=True)
class OfferedLoad:
    """The load of a scenario's random access.

    `load` is G, of pings or of slots (`lasts_s` each).  `success` is how likely a ping meets no
    other at an ASV that hears all AUVs, None where no closed form tells.  All AUVs send
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


def carried_per_s(setup: Setup) -> float:
    """Return how many fixes a second its broadcasts carry at most, one behind the other."""
    slots = setup.slots
    most = slots.messages.most
    counts = (MANY,) if most is None or slots.messages.splits else range(1, most + 1)
    shares = setup.scenario.asvs.count if setup.broadcaster.at_once else 1
    return max(count / slots.downlink_slot(-(-count // shares)) for count in counts)


def offered(setup: Setup, slots: Slots | None = None) -> OfferedLoad:
    """Return the load that the AUVs of a scenario with random access offer."""
    scenario, protocol = setup.scenario, setup.scenario.protocol
    slots, senders, every = slots or setup.slots, scenario.auvs.count, protocol.frame_s
    # data follow pings, so that no closed form tells
    access = setup.schedule.access if scenario.traffic is None else "program"
    if access == "slotted":
        slot = slots.clock.after(0.0, slots.uplink_slot)
        load = offered_load(senders, slot, every)
        pings = senders * slot_share(slot, every) / slot
        return OfferedLoad(senders, slot, load, slotted_success(load, senders), pings)
    ping, window, slot_s, held_back = slots.ping_duration, None, None, 0.0
    load = offered_load(senders, ping, every)
    if access == "sensing":
        sensing = protocol.program.settings_as(CarrierSense, CarrierSense)
        window, slot_s = sensing.window, backoff_slot_s(sensing.slot_s, slots)
        held_back = load / (1.0 + load) * slot_s * (window - 1) / 2
    success = aloha_success(load, senders) if access == "poisson" else None
    pings = senders / (every + ping + held_back)
    answer = slots.messages.airtime(1) if protocol.replies_in_frames else 0.0
    return OfferedLoad(senders, ping, load, success, pings, window, slot_s, answer)
