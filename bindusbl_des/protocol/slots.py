"""How long the slots of the TDMA protocol last.

All guards are counted in acoustic crossing times of the survey, so that the protocol stays valid
as the survey grows (paper, section TDMA Acoustic Protocol).
"""

from dataclasses import dataclass

from ..acoustics.messages import Messages
from ..core.clock import Clock, ExactClock, TickClock
from ..core.plugins import PluginError, asked, loaded, shown
from ..scenario.families import RANGING
from ..scenario.sections.protocol import Protocol
from ..scenario.site import Site

# eq. guard, UL_min, DL_guard, DL_min: factors of the crossing time
UPLINK_GUARD, SHORTEST_UPLINK = 0.5, 2.5
DOWNLINK_GUARD, SHORTEST_DOWNLINK = 1.25, 10.0


def crossing_time(side: float, sound_speed: float = 1500.0) -> float:
    """Return the time t_C (s) that sound takes to cross the survey (eq. t_cross).

    The paper's `side` is that of a square; of another area it is the longer side of the smallest
    rectangle around it.

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
    """Return the slot T_UL (s) that holds a ping, its way and its echoes (eq. UL_slot); all in s.

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
    """Return the slot (s) that holds an interrogation, its reply and the echoes (twtt, polling)."""
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
class Slots:
    """Every duration (s) of the protocol for one survey, derived once and configured nowhere else,
    and the speed of sound (m/s) that the fleet assumes.

    Where pings are answered in frames, an uplink slot holds the `answer` as well: the frame of one
    fix and the guard of a downlink slot; else that is 0.
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

    def payload_bytes(self, fix_count: int, named: int = 0) -> int:
        """Return the bytes of a broadcast, of all its messages: of `fix_count` fixes, and of slots
        of which `named` AUVs are told.
        """
        return sum([message.size_bytes for message in self.messages.packed(fix_count, named)])

    def airtime(self, fix_count: int, named: int = 0) -> float:
        """Return the airtime T_tx (s) of such a broadcast, of all its messages."""
        return sum([message.airtime_s for message in self.messages.packed(fix_count, named)])

    def frame_slot(self, fix_count: int, named: int = 0) -> float:
        """Return how long (s) such a broadcast and its guard take."""
        return self.airtime(fix_count, named) + self.downlink_guard

    def downlink_slot(self, fix_count: int, named: int = 0) -> float:
        """Return the downlink slot T_DL (s) for such a broadcast."""
        guard, shortest = self.downlink_guard, self.shortest_downlink
        return downlink_slot(self.airtime(fix_count, named), self.crossing_time, guard, shortest)


def slots_of(site: Site, messages: Messages) -> Slots:
    """Derive every duration of the protocol from the survey and the bands.

    The fleet plans it with the speed of sound that it assumes.
    """
    sound_speed, rate = site.assumed_sound_speed_m_per_s, site.scenario.protocol.tick_rate_hz
    hf, protocol = site.scenario.acoustics.hf, site.scenario.protocol
    crossing = crossing_time(site.area.across, sound_speed)
    deepest = site.scenario.survey.deepest
    longest = hf.longest_path_m(deepest) / sound_speed
    guards = (
        _chosen(protocol.uplink_guard_s, UPLINK_GUARD * crossing),
        _chosen(protocol.downlink_guard_s, DOWNLINK_GUARD * crossing),
        _chosen(protocol.shortest_downlink_slot_s, SHORTEST_DOWNLINK * crossing),
    )
    answer = messages.airtime(1) + guards[1] if protocol.replies_in_frames else 0.0
    return Slots(
        crossing, hf.ping_s, longest, _uplink_slot(protocol, hf.ping_s, longest, crossing) + answer,
        *guards, messages, ExactClock() if rate is None else TickClock(rate), sound_speed,
        _chosen(protocol.shortest_uplink_slot_s, SHORTEST_UPLINK * crossing), answer,
    )  # fmt: skip


def _uplink_slot(protocol: Protocol, ping: float, longest: float, crossing: float) -> float:
    """Return the slot T_UL (s) of a ranging, for a ping, its longest travel time and t_C (s)."""
    guards = protocol.uplink_guard_s, protocol.shortest_uplink_slot_s
    if protocol.calls:
        return two_way_uplink_slot(ping, longest, protocol.turnaround_s, crossing, *guards)
    own = _own_slot(protocol.ranging, ping, longest, crossing)
    return uplink_slot(ping, longest, crossing, *guards) if own is None else own


def _own_slot(name: str, ping_s: float, way_s: float, crossing_s: float) -> float | None:
    """Return how long (s) the slots of a ranging of somebody's own are, by its `slot_s`.

    None where it has none, or is not loaded: then they hold one ping and its way.

    Raises:
        PluginError: when that raises anything, or is no time.
    """
    ask = asked(RANGING.key, name, getattr, loaded(name), "slot_s", None)
    if ask is None:
        return None
    found = asked(RANGING.key, name, ask, ping_s, way_s, crossing_s, when=" as slot_s was asked")
    if isinstance(found, bool) or not isinstance(found, int | float) or not 0.0 < found < 1e6:
        said = shown(RANGING.key, name, found)
        raise PluginError(RANGING.key, f"{name!r} has a slot_s of {said}; it must be a time in s")
    return float(found)
