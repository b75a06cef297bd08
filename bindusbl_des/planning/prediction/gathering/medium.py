"""The protocol of a scenario as a prediction takes it: slots, and who pings and answers when."""

import numpy as np

from ....core.plugins import is_plugin, loaded
from ....mission.build import reply_delay_of
from ....protocol.schedules import is_framed
from ....protocol.slots import SHORTEST_UPLINK, UPLINK_GUARD
from ....protocol.slots import slots_of as protocol_slots
from ....scenario.scenario import Scenario
from ....scenario.water import assumed_sound_speed_of
from ..parts import Access, Slots

# What stands in for parts of one's own, whose ways nobody knows.
STAND_INS = {"schedule": "spatial_reuse", "downlink": "sequential", "broadcaster": "rotate"}


def slots_of(scenario: Scenario) -> Slots:
    """Return how long slots last; those of an own ranging that is not loaded hold one ping."""
    slots, protocol = protocol_slots(scenario), scenario.protocol
    crossing, fixes = slots.crossing_time, range(scenario.auvs.count + 1)
    shortest = protocol.shortest_uplink_slot_s
    clock, messages = slots.clock, slots.messages
    two_way = protocol.ranging == "twtt"
    own = is_plugin(protocol.ranging) and hasattr(loaded(protocol.ranging), "slot_s")
    return Slots(
        slots.ping_duration,
        2 if two_way else 1,
        protocol.turnaround_s if two_way else 0.0,
        UPLINK_GUARD * crossing if protocol.uplink_guard_s is None else protocol.uplink_guard_s,
        SHORTEST_UPLINK * crossing if shortest is None else shortest,
        slots.uplink_slot if own else None,
        scenario.survey.deepest,
        assumed_sound_speed_of(scenario),
        clock.rate,
        np.array([clock.after(0.0, slots.downlink_slot(count)) for count in fixes]),
        np.array([
            slots.airtime(count) + messages.delay(messages.of(count)[-1]) for count in fixes
        ]),
    )  # fmt: skip


def access_of(scenario: Scenario) -> Access:
    """Return who pings when, and who answers how."""
    protocol = scenario.protocol
    named = {name: str(getattr(protocol, name)) for name in STAND_INS}
    known = {name: STAND_INS[name] if is_plugin(it) else it for name, it in named.items()}
    ranging = str(protocol.ranging)
    return Access(
        **known,
        fixed_asv=protocol.broadcaster.settings.get("asv", 0),
        ranging="owtt_sync" if is_plugin(ranging) else ranging,
        frame_s=protocol.frame_s if is_framed(protocol.schedule) else 0.0,
        reply_s=reply_delay_of(scenario),
    )
