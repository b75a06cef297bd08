"""Data of AUVs: packets that wait for their AUV's next ping, and follow it on HF to all vessels.

A packet is a sound at every vehicle, beside pings, calls and signals, on the same sea
(:mod:`..acoustics.signals`): it is lost by the same chance as a ping over the same path, and sounds
that overlap destroy each other.  It is not answered: its outcome is worked out as the mission ends.
"""

from collections import deque
from collections.abc import Iterator
from functools import partial
from itertools import count
from typing import Any

import numpy as np
import simpy

from ...support.streams import Purpose, Streams
from ..acoustics.signals import luck_keys
from ..records.events import (
    BY_PACKET,
    COLLIDED,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    WORDS,
    Packet,
)
from ..records.rows import Recorder
from ..scenario.scenario_keys import Traffic
from .pings import HfBand
from .steps import moment

DELIVERED = "delivered"


class Data:
    """The packets of all AUVs, made as `traffic` says; each lasts `lasts_s` (s), and begins `gap_s`
    (s) after a ping ends.
    """

    def __init__(
        self, env: simpy.Environment, uplink: HfBand, record: Recorder, streams: Streams,
        traffic: Traffic, *, lasts_s: float, gap_s: float,
    ) -> None:  # fmt: skip
        self._env, self._uplink, self._record, self._sounds = env, uplink, record, uplink.sounds
        self._size, self._lasts, self._gap = traffic.bytes, lasts_s, gap_s
        self._auvs = auvs = self._sounds.auvs
        self._made = [self._instants(traffic, streams, auv) for auv in range(auvs)]
        self._next = [next(instants) for instants in self._made]
        self._waiting: list[deque[Packet]] = [deque() for _ in range(auvs)]
        self._sends_until = np.full(auvs, -np.inf)
        fleets = self._sounds.fleets
        self._keys = [luck_keys(streams, Purpose.DATA_LOSS, (auv,), fleets) for auv in range(auvs)]
        self._sent = np.zeros(auvs, dtype=np.int64)

    def _instants(self, traffic: Traffic, streams: Streams, auv: int) -> Iterator[float]:
        """Yield the instants (s) at which an AUV makes packets."""
        if traffic.arrivals == "periodic":
            yield from (number * traffic.every_s for number in count())
        draw, time = streams.of(Purpose.DATA, auv), 0.0
        while True:
            time += traffic.every_s * float(draw.standard_exponential())
            yield time

    def _make(self, auv: int, time: float) -> None:
        """Make the packets of an AUV that are due by an instant (s)."""
        while self._next[auv] <= time:
            packet = Packet(-1, auv, self._next[auv], self._size)
            self._record.packets.append(packet)
            self._waiting[auv].append(packet)
            self._next[auv] = next(self._made[auv])

    def lasts_s(self, auv: int, time: float) -> float:
        """Return how long (s) an AUV still sends after a ping that begins at `time` (s): pause and
        packet, or 0 if no packet waits.
        """
        self._make(auv, time)
        return self._gap + self._lasts if self._waiting[auv] else 0.0

    def follow(self, pings: range) -> None:
        """After each of these pings, which begin now, send the AUV's oldest waiting packet, unless
        it is still sending one.
        """
        for ping in self._record.pings.array[pings.start : pings.stop]:
            auv, time = int(ping["auv"]), float(ping["sent_at_s"])
            self._make(auv, time)
            begins = time + self._uplink.band.duration + self._gap
            if self._waiting[auv] and self._sends_until[auv] <= time:
                packet = self._waiting[auv].popleft()
                self._sends_until[auv] = begins + self._lasts
                event = moment(self._env, begins)
                event.callbacks.append(partial(self._send, packet, begins))

    def _send(self, packet: Packet, time: float, _: simpy.Event) -> None:
        """Let an AUV send a packet at an instant (s)."""
        auv, packet.packet = packet.auv, int(self._sent.sum())
        packet.sent_at_s, packet.airtime_s = time, self._lasts
        signal = BY_PACKET, packet.packet, auv, time, self._lasts
        self._sounds.send(*signal, self._uplink.spreading, self._keys[auv], int(self._sent[auv]))
        self._sent[auv] += 1

    def close(self, time: float) -> None:
        """Record the outcome of each packet by an instant (s), the mission's end."""
        for auv in range(self._auvs):
            self._make(auv, np.nextafter(time, 0.0))
        packets, rows = self._record.packets, self._sounds.rows
        sent = {packet.packet: packet for packet in packets if packet.sent_at_s is not None}
        self._sounds.settle(time)
        met: dict[int, list[int]] = {number: [] for number in sent}
        heard = (rows["kind"] == BY_PACKET) & (rows["listener"] >= self._auvs)
        for row in np.flatnonzero(heard).tolist():
            number, outcome = int(rows["signal"][row]), self._became(row, time)
            met[number].append(outcome)
            if outcome == HEARD:
                self._deliver(sent[number], rows[row])
        for number, outcomes in met.items():
            packet = sent[number]
            packet.in_range_of = sum(outcome != OUT_OF_RANGE for outcome in outcomes)
            if packet.heard_by == 0:
                worst = (IN_FLIGHT, COLLIDED, LOST, OUT_OF_RANGE)
                found = next((word for word in worst if word in outcomes), OUT_OF_RANGE)
                packet.outcome = WORDS[found]
        self._number(sent)

    def _number(self, sent: dict[int, Packet]) -> None:
        """Renumber packets from the order of sending (keys of `sent`) to the order in which they
        were made, also where other rows name them in `overlapped_by`.
        """
        self._record.packets.sort(key=lambda packet: (packet.made_at_s, packet.auv))
        for number, packet in enumerate(self._record.packets):
            packet.packet = number
        numbers = np.array([sent[number].packet for number in range(len(sent))], dtype=np.int64)
        for rows in (self._record.receptions.rows, self._record.signal_receptions.rows):
            by_packet = rows["why"] == BY_PACKET
            rows["overlapped_by"][by_packet] = numbers[rows["overlapped_by"][by_packet]]

    def _deliver(self, packet: Packet, sound: Any) -> None:
        """Note that an ASV has decoded a packet."""
        packet.heard_by, ended = packet.heard_by + 1, float(sound["ended_at_s"])
        if packet.delivered_at_s is None or ended < packet.delivered_at_s:
            packet.delivered_at_s, packet.outcome = ended, DELIVERED
            packet.delivered_to = int(sound["listener"]) - self._auvs
            packet.latency_s = ended - packet.made_at_s

    def _became(self, row: int, time: float) -> int:
        """Return the outcome of a packet's sound, a row, at its ASV by `time` (s)."""
        return self._uplink.became(row, time)[0]
