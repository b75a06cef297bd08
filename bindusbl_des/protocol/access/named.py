"""The random access of a scenario, by the name of its schedule; when AUVs have what to send."""

from collections.abc import Iterator
from functools import cache, partial

import numpy as np

from ...acoustics.channel import AskedChannel
from ...acoustics.propagation import Band
from ...core.streams import Purpose, Streams
from ...scenario.families import SCHEDULE
from ...scenario.part_settings import settings_of
from ...scenario.scenario import Scenario
from ...scenario.shipped_settings import CarrierSense
from ...vehicles.fleet import Fleet
from ..slots import Slots, slots_of
from .aloha import Access, Aloha, SlottedAloha
from .csma import Csma, Listening

# Intervals that are drawn at a time.
DRAWN = 64


def poisson(draw: np.random.Generator, mean_s: float) -> Iterator[float]:
    """Yield the instants (s) of a Poisson process from 0 on, with a mean interval (s).

    >>> instants = poisson(np.random.default_rng(0), 2.0)
    >>> [round(next(instants), 2) for _ in range(3)]
    [1.36, 3.4, 3.44]
    """
    time = 0.0
    while True:
        for interval in draw.standard_exponential(DRAWN).tolist():
            time += mean_s * interval
            yield time


def packets_of(streams: Streams, auvs: int, mean_s: float) -> list[Iterator[float]]:
    """Return the instants (s) at which each of so many AUVs has something to send.

    Each has a stream of its own, so that a further AUV leaves those of the others as they were.
    """
    return [poisson(streams.of(Purpose.PACKET, auv), mean_s) for auv in range(auvs)]


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
