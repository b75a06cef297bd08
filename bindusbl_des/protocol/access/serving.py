"""Random access: AUVs ping as they like, ASVs broadcast what they make of it.

One process goes from instant to instant, whoever has something to do at each.  A round is a cycle
of the downlink: from when MF is free, over the broadcast that begins as soon as a fix waits, to
the end of its slot.  Nobody waits for it on HF.
"""

from collections.abc import Generator, Iterator
from functools import cache, partial
from heapq import heappop, heappush
from math import inf

import numpy as np
import simpy

from ...acoustics.channel import AskedChannel
from ...acoustics.propagation import SignalBand
from ...core.plugins import is_plugin
from ...core.streams import Purpose, Streams
from ...records.events import Round
from ...scenario.families import SCHEDULE
from ...scenario.part_choice import settings_of
from ...scenario.sections.protocol import Protocol
from ...scenario.shipped_settings import CarrierSense
from ...vehicles.fleet import VehicleFleet
from ..conflicts import conflict_count
from ..network import Network, Turn
from ..slots import Slots
from ..steps import moment
from ..tdma import broadcast
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
    access: str,
    protocol: Protocol,
    slots: Slots,
    streams: Streams,
    auvs: VehicleFleet,
    band: SignalBand,
    channel: AskedChannel | None,
) -> Access:
    """Return who pings when, by the `access` that a schedule declares; a channel is asked what AUVs
    hear of each other, None is the disc.
    """
    packets = packets_of(streams, len(auvs), protocol.frame_s)
    if access == "poisson":
        return Aloha(packets, band.duration)
    if access == "slotted":
        return SlottedAloha(packets, slots.uplink_slot, slots.clock)
    settings = sensing_of(protocol.schedule)
    slot_s = backoff_slot_s(settings, slots)
    draw = cache(partial(streams.of, Purpose.BACKOFF))

    def backoff(auv: int) -> float:
        return slot_s * int(draw(auv).integers(settings.window))

    return Csma(packets, Listening(auvs, band, channel), backoff, band.duration)


def sensing_of(schedule: str) -> CarrierSense:
    """Return the settings by which AUVs listen first, of a user-defined schedule the defaults."""
    if is_plugin(schedule):
        return CarrierSense()
    settings = settings_of(SCHEDULE, schedule)
    assert isinstance(settings, CarrierSense)
    return settings


def backoff_slot_s(settings: CarrierSense, slots: Slots) -> float:
    """Return the length (s) of a backoff slot: by default a ping and its longest way."""
    if settings.slot_s is not None:
        return settings.slot_s
    return slots.ping_duration + slots.longest_travel_time


def serve_at_random(network: Network, access: Access) -> Generator[simpy.Event, None, None]:
    """Serve AUVs that ping as they like, from the start of the mission to its end."""
    cycles = Cycles(network)
    while True:
        time = min(access.next_at, cycles.next_at)
        yield moment(network.env, time)
        if cycles.next_at <= time:
            cycles.go_on(time)
            continue
        auvs, waited = access.due()
        if len(auvs):
            pings = network.uplink.send(cycles.number, 0, auvs, time, waited=waited)
            cycles.expect(pings)


class Cycles:
    """The downlink's cycles, each a round; direct replies need none, and all are of one round."""

    def __init__(self, network: Network) -> None:
        """Begin the first cycle at 0 s."""
        self._network = network
        self._passing: list[tuple[float, int]] = []  # when (s) pings will have passed, a heap
        self._is_sending, self._resumes_at = False, inf  # when an ASV works again, if none does
        self._turn = self._begun(0, 0.0)
        if network.replies is not None:
            self._turn.row.downlink_s = 0.0

    @property
    def number(self) -> int:
        """The number of the cycle under way."""
        return self._turn.row.round

    @property
    def next_at(self) -> float:
        """The next instant (s) at which a cycle ends, or a ping may have become a fix."""
        if self._is_sending:
            return self._network.downlink_free_at
        return min(self._resumes_at, self._passing[0][0] if self._passing else inf)

    def _begun(self, number: int, time: float) -> Turn:
        """Begin a cycle at an instant (s)."""
        view = self._network.view(number, time)
        row = Round(number, time, colours=0, conflicts=conflict_count(view.heard))
        self._network.record.rounds.append(row)
        return Turn(row, (), (), view)

    def expect(self, pings: range) -> None:
        """Wait until pings have passed every ASV in range."""
        if self._network.replies is not None:
            return
        for ping in pings:
            passed = float(self._network.record.pings.array[ping]["passed_at_s"])
            if passed < inf:
                heappush(self._passing, (self._network.slots.clock.after(passed, 0.0), ping))

    def go_on(self, time: float) -> None:
        """Do what is to be done at an instant (s): end a cycle, broadcast the fixes that wait."""
        network = self._network
        if self._is_sending:
            self._is_sending = False
            self._turn = self._begun(self.number + 1, time)
        has_fix = network.has_fix(time)
        while self._passing and self._passing[0][0] <= time:
            ping = heappop(self._passing)[1]
            if network.record.pings.array[ping]["passed_at_s"] > time:  # ASVs were predicted nearer
                self.expect(range(ping, ping + 1))
        self._resumes_at = inf
        if has_fix:
            works = network.asv_fleet.works_from(time)
            if works > time:
                self._resumes_at = network.slots.clock.after(0.0, works) if works < inf else inf
            else:
                self._turn.row.uplink_s = time - self._turn.row.started_at_s
                broadcast(network, self._turn, time)
                self._is_sending = True
