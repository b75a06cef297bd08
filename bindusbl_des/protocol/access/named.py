"""The random access of a scenario, by the name of its schedule."""

from functools import cache, partial

from ...acoustics.channel import AskedChannel
from ...acoustics.propagation import Band
from ...core.streams import Purpose, Streams
from ...scenario.families import SCHEDULE, CarrierSense
from ...scenario.part_settings import settings_of
from ...scenario.scenario import Scenario
from ...vehicles.fleet import Fleet
from ..slots import Slots, slots_of
from .aloha import Access, Aloha, SlottedAloha
from .csma import Csma
from .listening import Listening
from .packets import packets_of


def access_of(
    scenario: Scenario, streams: Streams, auvs: Fleet, band: Band, channel: AskedChannel | None
) -> Access:
    """Return who pings when; a channel is asked what AUVs hear of each other, None is the disc."""
    slots, name = slots_of(scenario), scenario.protocol.schedule
    packets = packets_of(streams, len(auvs), scenario.protocol.frame_s)
    if name == "aloha":
        return Aloha(packets, band.duration)
    if name == "slotted_aloha":
        return SlottedAloha(packets, slots.uplink_slot, slots.clock)
    settings = sensing_of(scenario)
    slot_s = backoff_slot_s(settings, slots)
    draw = cache(partial(streams.of, Purpose.BACKOFF))

    def backoff(auv: int) -> float:
        return slot_s * int(draw(auv).integers(settings.window))

    return Csma(packets, Listening(auvs, band, channel), backoff, band.duration)


def sensing_of(scenario: Scenario) -> CarrierSense:
    """Return the settings of the schedule `csma`, defaults and all."""
    settings = settings_of(SCHEDULE, scenario.protocol.schedule)
    assert isinstance(settings, CarrierSense)
    return settings


def backoff_slot_s(settings: CarrierSense, slots: Slots) -> float:
    """Return the length (s) of a backoff slot: by default a ping and its longest way."""
    if settings.slot_s is not None:
        return settings.slot_s
    return slots.ping_duration + slots.longest_travel_time
