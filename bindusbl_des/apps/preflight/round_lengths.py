"""How long the rounds of a protocol last, from its slots alone; and the load of random access."""

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
    """The rounds of a protocol: slots, downlink, and the ping groups that they may have.

    A round has `fewest` to `most` groups, with `auvs` AUVs in all.  A schedule with frames begins a
    round each `frame` (s; else 0).  Random access has no rounds: one of no groups is the shortest
    cycle of the downlink.  Only a user-defined downlink knows its lengths; where a number is
    needed, `sequential` stands in.  With passive ranging there is no downlink (None), and a group
    is one ASV. Broadcasts name the slots of `named` AUVs, and a slot for the others may follow
    (`contention`). Where slots are not all of T_UL, `pace` has the shortest and the longest ones.
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
        """Whether the lengths follow from the slots: always for shipped downlinks."""
        return self.downlink is None or self.downlink in families.DOWNLINK.traits

    @property
    def broadcasts(self) -> bool:
        """Whether ASVs broadcast fixes, so that their number decides the length of a round."""
        return (
            self.downlink is not None
            and not families.DOWNLINK.traits.get(self.downlink, families.DownlinkTraits()).replies
        )

    @property
    def shortest(self) -> Slots:
        """The slots at their shortest."""
        return self.slots if self.pace is None else self.pace[0]

    def length(self, groups: int, fixes: int) -> float:
        """Return the longest time (s) that a round with these groups and fixes takes."""
        return self._lasts(self.slots if self.pace is None else self.pace[1], groups, fixes)

    def least(self, groups: int, fixes: int) -> float:
        """Return the shortest time (s) that a round with these groups and fixes takes."""
        return self._lasts(self.shortest, groups, fixes)

    def _lasts(self, slots: Slots, groups: int, fixes: int) -> float:
        return cycle(self.downlink, slots, groups + self.contention, fixes, self.named).length_s

    def usual(self, groups: int, fixes: int) -> float:
        """Return the typical time (s) from one round to the next."""
        return max((self.least(groups, fixes) + self.length(groups, fixes)) / 2, self.frame)

    def period(self, groups: int, fixes: int) -> float:
        """Return the longest time (s) from one round to the next."""
        return max(self.length(groups, fixes), self.frame)

    def pace_lines(self, schedule: families.ScheduleTraits) -> Iterator[str]:
        """Yield, in sentences, the lengths of slots that are not all of T_UL."""
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
    """Return the rounds of a scenario's protocol; a plug-in not yet loaded counts as without
    frames.
    """
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
    """Return the least time (s) from the end of a broadcast to the beginning of the next.

    It follows from the slots of rounds with `groups` ping groups (by default the fewest) in which
    all AUVs are fixed; infinite for a user-defined downlink, which alone knows it.
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
    """Return slots of the shortest and of the longest length, for schedules without T_UL.

    An AUV straight below its caller answers soonest; an AUV without an answer takes T_UL.  Packed
    arrivals follow each other, the first after at most the longest path; AUVs are assumed to be
    where the fleet believes them to be.
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


# With so many fixes in a broadcast, header and guard are negligible.
MANY = 1000


@dataclass(frozen=True)
class OfferedLoad:
    """The load of a scenario's random access.

    `load` is G, in pings or slots of `lasts_s` (s).  `success` is the chance that a ping meets no
    other at an ASV that hears all AUVs, None without a closed form.  All AUVs together send
    `pings_per_s`. With csma a sender backs off for at most `window` - 1 quiet slots of `slot_s`.
    An ASV hears no ping while it answers one for `answer_s`.
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
        """The rate (1/s) of pings that meet no other at such an ASV; with csma of all pings.

        An ASV that answers for T misses pings meanwhile: r of a rate R, r = R (1 - r T).
        """
        met = self.pings_per_s * (1.0 if self.success is None else self.success)
        return met / (1.0 + met * self.answer_s)

    @property
    def least_fixes_per_s(self) -> float:
        """The same rate; with csma, that of ALOHA, which collides more often."""
        if self.success is not None:
            return self.fixes_per_s
        return self.pings_per_s * aloha_success(self.load, self.senders)


def carried_per_s(setup: Setup) -> float:
    """Return the largest rate (1/s) of fixes that broadcasts carry, one behind the other."""
    slots = setup.slots
    most = slots.messages.most
    counts = (MANY,) if most is None or slots.messages.splits else range(1, most + 1)
    shares = setup.scenario.asvs.count if setup.broadcaster.at_once else 1
    return max(count / slots.downlink_slot(-(-count // shares)) for count in counts)


def offered(setup: Setup, slots: Slots | None = None) -> OfferedLoad:
    """Return the load that the AUVs of a scenario with random access offer."""
    scenario, protocol = setup.scenario, setup.scenario.protocol
    slots, senders, every = slots or setup.slots, scenario.auvs.count, protocol.frame_s
    # data follow pings, for which there is no closed form
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
