"""Durations of the TDMA protocol's slots.

All guards are counted in acoustic crossing times of the survey, so that the protocol stays valid
as the survey grows (paper, section TDMA Acoustic Protocol).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from ...support.clock import Clock
from ...support.plugins import PluginError, asked, shown
from ..acoustics.messages import Message, Messages, Modem
from ..scenario.families import RANGING
from ..scenario.scenario_keys import Traffic
from ..scenario.sections.acoustics import UplinkSection
from ..scenario.sections.protocol import Protocol
from ..scenario.site import Site

# Guards and shortest slots in crossing times (eq. guard, UL_min, DL_guard, DL_min)
UPLINK_GUARD, SHORTEST_UPLINK = 0.5, 2.5
DOWNLINK_GUARD, SHORTEST_DOWNLINK = 1.25, 10.0


def crossing_time(side: float, sound_speed: float = 1500.0) -> float:
    """Return the time t_C (s) that sound takes to cross the survey (eq. t_cross).

    In the paper `side` is a square's; for another area take the longer side of its smallest
    enclosing rectangle.

    >>> crossing_time(60)
    0.04
    """
    return side / sound_speed


def uplink_slot(
    ping_duration: float,
    longest_travel_time: float,
    crossing: float,
    guard: float | None = None,
    shortest: float | None = None,
) -> float:
    """Return the slot T_UL (s) for a ping, its travel time and its echoes (eq. UL_slot); all in s.

    `guard` and `shortest` are the paper's T_G = 0.5 t_C and T_UL,min = 2.5 t_C unless given.

    >>> round(uplink_slot(0.010, 50 / 1500, crossing_time(140)), 6)
    0.233333
    """
    guard = _chosen(guard, UPLINK_GUARD * crossing)
    shortest = _chosen(shortest, SHORTEST_UPLINK * crossing)
    return max(ping_duration + longest_travel_time + guard, shortest)


def two_way_uplink_slot(
    ping_duration: float,
    longest_travel_time: float,
    turnaround: float,
    crossing: float,
    guard: float | None = None,
    shortest: float | None = None,
) -> float:
    """Return the slot (s) that holds an interrogation, its reply and the echoes (twtt, polling).

    Arguments in s, as of :func:`uplink_slot`; the AUV replies a `turnaround` after it was called.
    """
    return uplink_slot(
        2 * ping_duration + turnaround, 2 * longest_travel_time, crossing, guard, shortest
    )


def downlink_slot(
    frame_airtime: float,
    crossing: float,
    guard: float | None = None,
    shortest: float | None = None,
) -> float:
    """Return the slot T_DL (s) that holds a broadcast and its guard (eq. DL_slot); all in s.

    `guard` and `shortest` are the paper's T_DL,G = 1.25 t_C and T_DL,min = 10 t_C unless given.

    >>> round(downlink_slot(0.448, crossing_time(60)), 6)
    0.498
    """
    guard = _chosen(guard, DOWNLINK_GUARD * crossing)
    shortest = _chosen(shortest, SHORTEST_DOWNLINK * crossing)
    return max(frame_airtime + guard, shortest)


def _chosen(own: float | None, papers: float) -> float:
    return papers if own is None else own


@dataclass(frozen=True)
class Behind:
    """What AUVs send on MF after a broadcast.  The AUVs `relays`, in this order, forward its frames
    over so many `hops`; then AUVs with fixes in it acknowledge them, by a frame of
    `acknowledgement` (B of header, B per fix; None: they do not).

    An AUV that has decoded a frame waits for its turn from then on, by no clock.  After h hops what
    it sends begins up to h longest travel times `way_s` (s) later than elsewhere, and takes up to
    another `way_s` to arrive.  So a turn is longer than its frame by one `way_s` for each hop, and
    one more.
    """

    relays: tuple[int, ...]
    hops: int
    way_s: float
    acknowledgement: tuple[int, int] | None
    modem: Modem

    def relay_turn_s(self, longest_s: float) -> float:
        """Return the length (s) of a turn to forward a frame that lasts `longest_s` (s) at most."""
        return longest_s + (self.hops + 1) * self.way_s

    def pause_s(self, parts: int) -> float:
        """Return how long (s) AUVs wait after a broadcast of so many frames: AUVs move, so the last
        frame may arrive later than the others let them expect.
        """
        return self.way_s if parts > 1 else 0.0

    def turns(self, parts: int) -> int:
        """Return the number of turns in which a broadcast of so many frames is forwarded."""
        return self.hops * len(self.relays) * parts

    def acknowledging(self, fixes: int) -> tuple[int, float, float]:
        """Return size (B) and airtime (s) of the frame that acknowledges so many fixes, and how
        long (s) after its end the modem delivers it.
        """
        assert self.acknowledgement is not None
        size = self.acknowledgement[0] + fixes * self.acknowledgement[1]
        return size, self.modem.airtime(size), self.modem.delay(size)

    def acknowledgement_turn_s(self, fixes: int = 1) -> float:
        """Return how long (s) the turn is in which an AUV acknowledges so many fixes."""
        return self.acknowledging(fixes)[1] + (self.hops + 2) * self.way_s

    def lasts_s(self, messages: Sequence[Message], fixes: Sequence[int]) -> float:
        """Return how long (s) AUVs send after a broadcast of some messages in which each of them
        has so many `fixes`; 0 where there is no fix.
        """
        if not fixes:
            return 0.0
        longest = max(message.airtime_s for message in messages)
        delay = max(message.delay_s for message in messages)
        turns = self.turns(len(messages))
        lasts = self.pause_s(len(messages)) + turns * self.relay_turn_s(longest)
        if self.acknowledgement is None:
            return lasts + self.hops * delay
        lasts += (self.hops + 1) * delay + sum(map(self.acknowledgement_turn_s, fixes))
        return lasts + self.acknowledging(max(fixes))[2]


@dataclass(frozen=True)
class Slots:
    """All durations (s) of the protocol for one survey, derived once, and the sound speed (m/s)
    that the fleet assumes.

    Where pings are answered in frames, an uplink slot also holds the `answer`: the frame of one fix
    and the guard of a downlink slot; else 0.  A downlink slot also holds what AUVs send `behind` a
    broadcast (None: nothing), an uplink slot the `data` that follow a ping (s).
    """

    crossing_time: float
    ping_duration: float
    longest_travel_time: float
    uplink_slot: float
    uplink_guard: float
    downlink_guard: float
    shortest_downlink: float
    messages: Messages
    clock: Clock
    sound_speed: float
    shortest_uplink: float
    answer: float = 0.0
    behind: Behind | None = None
    data: float = 0.0

    def payload_bytes(self, fix_count: int, named: int = 0) -> int:
        """Return the bytes of a broadcast, summed over its messages: `fix_count` fixes, and the
        slots of `named` AUVs.  The methods below take the same arguments.
        """
        return sum([message.size_bytes for message in self.messages.packed(fix_count, named)])

    def airtime(self, fix_count: int, named: int = 0) -> float:
        """Return the airtime T_tx (s) of such a broadcast, summed over its messages."""
        return sum([message.airtime_s for message in self.messages.packed(fix_count, named)])

    def frame_slot(self, fix_count: int, named: int = 0) -> float:
        """Return how long (s) a broadcast, what AUVs send after it, and its guard take."""
        return self.held_s(fix_count, named) + self.downlink_guard

    def held_s(self, fix_count: int, named: int = 0) -> float:
        """Return how long (s) a broadcast and what AUVs send after it take, if each fix is of
        another AUV.
        """
        lasts = self.airtime(fix_count, named)
        if self.behind is None:
            return lasts
        return lasts + self.behind.lasts_s(self.messages.packed(fix_count, named), (1,) * fix_count)

    def downlink_slot(self, fix_count: int, named: int = 0) -> float:
        """Return the downlink slot T_DL (s) for a broadcast."""
        guard, shortest = self.downlink_guard, self.shortest_downlink
        return downlink_slot(self.held_s(fix_count, named), self.crossing_time, guard, shortest)


def slots_of(site: Site, messages: Messages) -> Slots:
    """Derive every duration of the protocol from survey and bands, with the sound speed that the
    fleet assumes.
    """
    sound_speed, rate = site.assumed_sound_speed_m_per_s, site.scenario.protocol.tick_rate_hz
    hf, protocol = site.scenario.acoustics.hf, site.scenario.protocol
    crossing = crossing_time(site.area.across, sound_speed)
    deepest = site.deepest_m
    longest = hf.longest_path_m(deepest) / sound_speed
    guards = (
        _chosen(protocol.uplink_guard_s, UPLINK_GUARD * crossing),
        _chosen(protocol.downlink_guard_s, DOWNLINK_GUARD * crossing),
        _chosen(protocol.shortest_downlink_slot_s, SHORTEST_DOWNLINK * crossing),
    )
    answer = messages.airtime(1) + guards[1] if protocol.replies_in_frames else 0.0
    traffic = site.scenario.traffic
    data = 0.0 if traffic is None else packet_s(hf, traffic) + gap_s(hf)
    sends = protocol.relay is not None or protocol.acknowledge == "frame"
    behind = _behind(site, messages, sound_speed) if sends else None
    slot = _uplink_slot(protocol, hf.ping_s, longest, crossing) + answer + data
    return Slots(
        crossing, hf.ping_s, longest, slot,
        *guards, messages, Clock(rate or 0.0), sound_speed,
        _chosen(protocol.shortest_uplink_slot_s, SHORTEST_UPLINK * crossing), answer,
        behind, data,
    )  # fmt: skip


# Pause between a ping and its packet, as a share of the ping: they do not overlap at an ASV even if
# the range changes at 1 % of the sound speed.
QUIET = 0.02


def gap_s(hf: UplinkSection) -> float:
    """Return the pause (s) between the end of a ping and its packet."""
    return QUIET * hf.ping_s


def packet_s(hf: UplinkSection, traffic: Traffic) -> float:
    """Return the airtime (s) of a packet."""
    return 8 * traffic.bytes / hf.bit_rate_bps


def _behind(site: Site, messages: Messages, sound_speed: float) -> Behind:
    """Return what AUVs send on MF after a broadcast: forwarded frames and acknowledgements."""
    protocol, mf = site.scenario.protocol, site.scenario.acoustics.mf
    each = mf.header_bytes, protocol.acknowledgement_bytes
    hops = 0 if protocol.relay is None else protocol.relay.hops
    return Behind(
        protocol.relays(site.scenario.auvs.count), hops,
        mf.longest_path_m(site.deepest_m) / sound_speed,
        each if protocol.acknowledge == "frame" else None, messages.modem,
    )  # fmt: skip


def _uplink_slot(protocol: Protocol, ping: float, longest: float, crossing: float) -> float:
    """Return the slot T_UL (s) of a protocol's ranging for the `ping`, its `longest` travel time,
    and the crossing time t_C (s).
    """
    guards = protocol.uplink_guard_s, protocol.shortest_uplink_slot_s
    if protocol.calls:
        return two_way_uplink_slot(ping, longest, protocol.turnaround_s, crossing, *guards)
    steps = protocol.pings_by_steps
    own = _own_slot(protocol.ranging, ping, longest, crossing) if steps else None
    return uplink_slot(ping, longest, crossing, *guards) if own is None else own


def _own_slot(name: str, ping_s: float, way_s: float, crossing_s: float) -> float | None:
    """Return the uplink slot (s) of a ranging by steps, by its `slot_s`; None if it has none or
    is not loaded: then a slot holds one ping and its travel time.

    Raises:
        PluginError: when `slot_s` raises anything, or returns no time.
    """
    ask = asked(RANGING.key, name, getattr, RANGING.known(name), "slot_s", None)
    if ask is None:
        return None
    found = asked(RANGING.key, name, ask, ping_s, way_s, crossing_s, when=" as slot_s was asked")
    if isinstance(found, bool) or not isinstance(found, int | float) or not 0.0 < found < 1e6:
        said = shown(RANGING.key, name, found)
        raise PluginError(RANGING.key, f"{name!r} has a slot_s of {said}; it must be a time in s")
    return float(found)
