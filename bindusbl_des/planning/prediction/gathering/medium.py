"""The protocol of a scenario as a prediction takes it: slots, and who pings and answers when."""

import numpy as np

from ....acoustics.modem import messages_of
from ....core.plugins import is_plugin, loaded
from ....preflight.round_lengths import pace_of
from ....protocol.replies import reply_delay_of
from ....protocol.slots import SHORTEST_UPLINK, UPLINK_GUARD
from ....protocol.slots import Slots as ProtocolSlots
from ....protocol.slots import slots_of as protocol_slots
from ....scenario.declared import (
    Broadcaster,
    Downlink,
    Schedule,
    broadcaster_of,
    downlink_of,
    ranging_of,
    schedule_of,
)
from ....scenario.scenario import Scenario
from ....scenario.telling import tells_slots
from ....scenario.water import assumed_sound_speed_of
from ..parts import Access, Slots

# What stands in for parts of one's own that do not say what they are like.
SCHEDULE = Schedule(groups="first_fit")
DOWNLINK = Downlink(waits=True)
BROADCASTER = Broadcaster("turn")


def slots_of(scenario: Scenario) -> Slots:
    """Return how long slots last; those of an own ranging that is not loaded hold one ping."""
    slots, protocol = protocol_slots(scenario), scenario.protocol
    crossing, fixes = slots.crossing_time, range(scenario.auvs.count + 1)
    shortest = protocol.shortest_uplink_slot_s
    clock, messages = slots.clock, slots.messages
    two_way = protocol.calls
    named = scenario.auvs.count if tells_slots(scenario) else 0
    own = is_plugin(protocol.ranging) and hasattr(loaded(protocol.ranging), "slot_s")
    return Slots(
        slots.ping_duration,
        2 if two_way else 1,
        protocol.turnaround_s if two_way else 0.0,
        UPLINK_GUARD * crossing if protocol.uplink_guard_s is None else protocol.uplink_guard_s,
        SHORTEST_UPLINK * crossing if shortest is None else shortest,
        slots.uplink_slot if own else _usual_slot(scenario, slots),
        scenario.survey.deepest,
        assumed_sound_speed_of(scenario),
        clock.rate,
        slots.answer,
        np.array([clock.after(0.0, slots.downlink_slot(count, named)) for count in fixes]),
        np.array([
            slots.airtime(count, named) + messages.packed(count, named)[-1].delay_s
            for count in fixes
        ]),
    )  # fmt: skip


def _usual_slot(scenario: Scenario, slots: ProtocolSlots) -> float | None:
    """Return about how long (s) a slot is where schedules know none of T_UL; None where they do.

    AUVs are polled from two thirds of the longest way, as they are on average over a disc.
    """
    pace = pace_of(scenario, slots)
    if schedule_of(scenario).pace == "answered":
        ways = 4.0 / 3.0 * slots.longest_travel_time
        answered = 2.0 * slots.ping_duration + scenario.protocol.turnaround_s + ways
        return answered + slots.answer
    return None if pace is None else pace[0].uplink_slot


def _reply_s(scenario: Scenario) -> float:
    """Return how long after a ping's front (s) the end of its answer sets out, handed over."""
    delay, messages = reply_delay_of(scenario), messages_of(scenario)
    if not scenario.protocol.replies_in_frames:
        return delay
    return delay + messages.airtime(1) + messages.delay(1)


def access_of(scenario: Scenario) -> Access:
    """Return who pings when, and who answers how."""
    protocol = scenario.protocol
    schedule, broadcaster = schedule_of(scenario), broadcaster_of(scenario)
    framed = schedule.framed
    return Access(
        schedule if schedule.groups else SCHEDULE,
        DOWNLINK if is_plugin(protocol.downlink) else downlink_of(scenario),
        broadcaster if broadcaster.chosen_by else BROADCASTER,
        ranging_of(scenario),
        fixed_asv=protocol.broadcaster.settings.get("asv", 0),
        frame_s=protocol.frame_s if framed else 0.0,
        reply_s=_reply_s(scenario),
        replies_in_frames=protocol.replies_in_frames,
    )
