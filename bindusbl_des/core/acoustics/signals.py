"""Signals that any vehicle sends to all others: the sounds of each, and their outcomes.

Data packets, frames of AUVs, signals of access programs and, at other AUVs, pings all propagate by
:meth:`Sounds.send` and are decided by :func:`signal_outcome`, on the sea of their band.
"""

from math import inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Flags
from ...support.compiled import compiled
from ...support.packed import Packed, unpacked
from ...support.streams import Purpose, Streams, uniform
from ..records.events import (
    BLOCKED,
    BY_AUV_FRAME,
    BY_FRAME,
    BY_OWN_FRAME,
    BY_OWN_PACKET,
    BY_OWN_PING,
    BY_OWN_SIGNAL,
    BY_PACKET,
    BY_PING,
    BY_SIGNAL,
    CHANCE,
    COLLIDED,
    DOPPLER,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
)
from ..records.rows import NONE, PING, RECEPTION, EventBuffer, Rows
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places
from .channel import AskedChannel, heard_from
from .loss import LossTerms, loss_probability
from .propagation import PROSPECT, drowns, within
from .sounds import SOUND, Sea, beyond, deafen, emit, interference, place_of, solve
from .travel_time import NEARLY_THERE, PASSED, distance

# By kind of signal: the word for it where it drowns what its own sender hears
ITSELF = {
    BY_PING: BY_OWN_PING,
    BY_SIGNAL: BY_OWN_SIGNAL,
    BY_PACKET: BY_OWN_PACKET,
    BY_AUV_FRAME: BY_OWN_FRAME,
}

# A sound counts as over by an instant up to so much (s) before its end, which is rounded.
ROUNDING = 1e-9

# A sound whose arrival is not known yet is looked at again so much later (s).
SOON = 1e-3

# Pings that sound beside other signals: receptions, pings, and their duration (s); none on MF.
Pings = tuple[Rows, Rows, float]
NO_PINGS: Pings = (np.empty(0, RECEPTION), np.empty(0, PING), 0.0)


class Spreading(NamedTuple):
    """How signals of a band (`name`) propagate: by the `channel`, which may draw from `random`;
    None: within a `reach` (m), horizontal unless `slant`, with the disc's `loss`.  They are lost
    where the range changes faster than `doppler_limit` (m/s), if not None.
    """

    channel: AskedChannel | None
    loss: LossTerms
    slant: bool
    reach: float
    name: str
    random: np.random.Generator | None
    doppler_limit: float | None


class Sounds(EventBuffer):
    """All sounds of a band on record, in the order in which their signals were sent."""

    def __init__(
        self, auvs: VehicleFleet, asvs: VehicleFleet, sound_speed: float, *, long: bool
    ) -> None:
        """Take the fleets and the sound speed (m/s); `long` as of :class:`Sea`."""
        super().__init__(SOUND)
        #: The packed :class:`Sea` for compiled code.
        self.sea = Packed(Sea(self.array, auvs.motion, asvs.motion, sound_speed, long))
        self.hand_on(self.sea, "sounds")
        self.fleets, self._speed, self._long = (auvs, asvs), sound_speed, long
        #: The numbers of AUVs, and of all vehicles.
        self.auvs, self.vehicles = len(auvs), len(auvs) + len(asvs)

    def deafen(self, kind: int, signal: int, vehicle: int, time: float, lasts: float) -> None:
        """Let a vehicle hear nothing while it sends a signal itself, as :func:`.sounds.deafen`."""
        self.count = deafen(self.room_for(1), self.count, kind, signal, vehicle, time, lasts)

    def send(
        self, kind: int, signal: int, sender: int, time: float, lasts: float, by: Spreading,
        keys: NDArray[np.uint64], nth: int, listeners: int | None = None,
    ) -> range:  # fmt: skip
        """Let a vehicle send a signal, of a `kind` and a number, from `time` for `lasts` (s) to the
        first so many of all vehicles (None: to all), except itself and failed ASVs; return its
        sounds, rows.

        It is the sender's `nth` signal; `keys` (listeners,) and that number draw its losses.  The
        sender hears nothing meanwhile.
        """
        for fleet in self.fleets:
            fleet.advance(time)
        count = self.vehicles if listeners is None else listeners
        deaf, first, prospects = np.zeros(count, np.bool_), self.count, np.empty(0, PROSPECT)
        for vehicle in (sender, *(self.auvs + asv for asv in self.fleets[1].failed(time))):
            deaf[vehicle : vehicle + 1] = True
        on_air = lasts
        if sender >= self.auvs:
            on_air = self.fleets[1].works_for(sender - self.auvs, time, lasts)
        if by.channel is not None:
            prospects = self.heard_from(by.channel, sender, time, count, by)
        self.room_for(count)
        self.count = spread_signal(
            self.sea.address, first, kind, signal, sender, time, on_air, deaf, by.slant, by.reach,
            by.loss, prospects, keys[:count], nth,
        )  # fmt: skip
        sent = range(first, self.count)
        if by.doppler_limit is not None:
            self.lose_shifted(self.rows[first:], time, by.doppler_limit)
        if on_air < lasts:
            self.lose(self.rows[first:], np.ones(len(sent), np.bool_), FAILED_MEANWHILE)
        self.deafen(ITSELF[kind], signal, sender, time, on_air)
        return sent

    def heard_from(
        self, channel: AskedChannel, sender: int, time: float, listeners: int, by: Spreading
    ) -> Rows:
        """Return a channel's answer about a signal that vehicle `sender` begins at `time` (s), at
        the first so many `listeners` of all vehicles, :data:`.propagation.PROSPECT`.
        """
        auvs, asvs = (places(fleet.motion, time)[:, :3] for fleet in self.fleets)
        around = auvs, asvs
        return heard_from(channel, time, sender, around, listeners, by.reach, by.name, by.random)

    def lose_shifted(self, sounds: Rows, time: float, limit: float) -> None:
        """Mark as lost the sounds of signals that begin at an instant (s), where they would be
        decoded and the range changes faster than a limit (m/s).
        """
        senders, listeners = sounds["sender"].copy(), sounds["listener"].copy()
        self.lose(sounds, beyond(self.sea.address, senders, listeners, time, limit), DOPPLER)

    @staticmethod
    def lose(sounds: Rows, cut: Flags, why: int) -> None:
        """Mark as lost, for the reason `why`, sounds (n,) in `cut` (n,) that would be decoded."""
        cut = cut & (sounds["outcome"] == IN_FLIGHT)
        sounds["outcome"][cut], sounds["why"][cut] = LOST, why

    # Arrivals and outcomes

    def known(self, time: float) -> float:
        """Advance vehicles to an instant (s); return up to when (s) their motion is known."""
        if all(fleet.foreseen for fleet in self.fleets):
            return inf
        for fleet in self.fleets:
            fleet.advance(time)
        return time

    def expected_end(self, row: int, now: float) -> float:
        """Return when (s) a sound (a row) is over, or an earlier instant at which to look again."""
        sound, known = self.array[row], inf
        if not all(fleet.foreseen for fleet in self.fleets):
            here, there = (self._place(int(sound[whose]), now) for whose in ("sender", "listener"))
            way = float(np.linalg.norm(np.subtract(here, there))) / self._speed
            leaves = float(sound["sent_at_s"] + sound["late_s"])
            leaves += float(sound["lasts_s"]) if self._long else 0.0
            near = leaves + NEARLY_THERE * way
            if near > now:
                return near
            known = self.known(now + (1.0 - NEARLY_THERE) * way + SOON)
        solve_rows(self.sea.address, row, row + 1, known)
        end = float(self.array[row]["ended_at_s"])
        return end if end < inf else now + SOON

    def _place(self, vehicle: int, time: float) -> tuple[float, float, float]:
        """Return the position (m) of a vehicle at an instant (s) that is not later than now."""
        fleet, number = (0, vehicle) if vehicle < self.auvs else (1, vehicle - self.auvs)
        x, y, z, _ = self.fleets[fleet].vehicles[number].at(time)
        return x, y, z

    def settle(self, time: float) -> None:
        """Solve the arrivals of all sounds as far as motion is known at an instant (s)."""
        solve_rows(self.sea.address, 0, self.count, self.known(time))

    def outcome(
        self, row: int, time: float, capture: float, pings: Pings = NO_PINGS
    ) -> tuple[int, int, int]:
        """Return the outcome of a sound (a row) by `time` (s), the reason, and the number of the
        signal that overlapped it; `pings` sound at ASVs as well.
        """
        found = outcome_of(
            self.sea.address, row, time + ROUNDING, self.known(time), self.count, *pings, self.auvs,
            capture,
        )  # fmt: skip
        if found[0] in (HEARD, LOST) and self.failing(self.rows[row : row + 1]).any():
            return LOST, FAILED_MEANWHILE, NONE
        return found

    def failing(self, sounds: Rows) -> Flags:
        """Return which sounds (n,) are at ASVs that have failed, or fail before they are over."""
        failures = self.fleets[1].failures
        if failures is None:
            return np.zeros(len(sounds), np.bool_)
        at = sounds["listener"] - self.auvs, sounds["arrived_at_s"], sounds["ended_at_s"]
        missed, cut = failures.met(*at)
        return missed | cut


def luck_keys(
    streams: Streams, purpose: Purpose, sender: tuple[int, ...], fleets: tuple[VehicleFleet, ...]
) -> NDArray[np.uint64]:
    """Return the keys that draw the losses of a sender's signals at each vehicle, (vehicles,): a
    further vehicle changes no key of the others.
    """
    return np.concatenate([
        streams.of(purpose, *sender, kind).integers(2**64, size=len(fleet), dtype=np.uint64)
        for kind, fleet in enumerate(fleets)
    ])  # fmt: skip


@compiled
def spread_signal(
    packed: int, row: int, kind: int, signal: int, sender: int, time: float, lasts: float,
    deaf: NDArray[np.bool_], slant: bool, reach: float, loss: LossTerms, prospects: Rows,
    keys: NDArray[np.uint64], nth: int,
) -> int:  # fmt: skip
    """Write the sounds of a signal, of a `kind` and a number, from a row on, at all vehicles that
    are not `deaf` (n,); return the row after the last.

    `keys` (n,) and `nth`, the number of the signal among its sender's, draw the loss at each.
    `prospects` (n,) are the channel's answer, empty on the disc (`slant`, `reach`, `loss`).
    """
    sea = unpacked(packed, Sea)
    strengths, lates, here = np.full(deaf.size, nan), np.zeros(deaf.size), place_of(
        sender, time, sea
    )  # fmt: skip
    chances = np.ones(deaf.size)
    for listener in range(deaf.size):
        if deaf[listener]:
            continue
        there = place_of(listener, time, sea)
        if prospects.size:
            prospect = prospects[listener]
            chances[listener] = prospect.loss
            if prospect.loss < 1.0 or prospect.sound > 0.0 or prospect.blocked:
                strengths[listener], lates[listener] = prospect.sound, prospect.late_s
        elif within(here, there, slant, reach):
            strengths[listener] = 1.0
            chances[listener] = loss_probability(distance(here, there), loss)
    end = emit(sea, row, kind, signal, sender, time, lasts, strengths, lates)
    for number in range(row, end):
        sound = sea.sounds[number]
        sound.loss = chances[sound.listener]
        if sound.loss >= 1.0:
            is_blocked = prospects.size and prospects[sound.listener].blocked
            sound.outcome, sound.why = OUT_OF_RANGE, BLOCKED if is_blocked else OUT_OF_RANGE
        elif uniform(keys[sound.listener], 0, nth, 0) < sound.loss:
            sound.outcome, sound.why = LOST, CHANCE
        if not sea.long and sound.listener >= sea.auvs.first.size - 1:  # may overlap pings at ASVs
            solve(sound, inf, sea)
    return end


@compiled
def solve_rows(packed: int, first: int, end: int, known: float) -> None:
    """Solve the sounds first..end of a packed sea (:func:`.sounds.solve`)."""
    sea = unpacked(packed, Sea)
    for row in range(first, end):
        solve(sea.sounds[row], known, sea)


@compiled
def outcome_of(
    packed: int, row: int, time: float, known: float, count: int, receptions: Rows, pings: Rows,
    ping_s: float, auvs: int, capture: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Return :func:`signal_outcome` of a sound (a row) among the first `count` of a packed sea."""
    sea = unpacked(packed, Sea)
    solve(sea.sounds[row], known, sea)
    return signal_outcome(
        row, sea.sounds[:count], time, receptions, pings, ping_s, auvs, capture, sea, known
    )


@compiled
def signal_outcome(
    row: int, sounds: Rows, time: float, receptions: Rows, pings: Rows, ping_s: float, auvs: int,
    capture: float, sea: Sea | None, known: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Return the outcome of a sound by an instant (s), the reason, and the number of the strongest
    signal that overlapped it; in flight if it is not over by then.

    At ASVs the `receptions` of `pings` of `ping_s` (s) sound as well.  `sea` and `known` as of
    :func:`.sounds.interference`.  An ASV's frame that is lost anyway stays lost, even if other
    sounds overlap it.
    """
    sound = sounds[row]
    if sound.outcome == OUT_OF_RANGE:
        return OUT_OF_RANGE, sound.why, NONE
    if sound.ended_at_s > time:
        return IN_FLIGHT, NONE, NONE
    if sound.outcome == LOST and sound.kind == BY_FRAME:
        return LOST, sound.why, NONE
    begins, ends, listener = sound.arrived_at_s, sound.ended_at_s, sound.listener
    others, strongest = interference(
        sounds, row, row + 1, listener, begins, ends, sounds[-1].longest_s, None, sea, known
    )
    why, by, most = NONE, NONE, 0.0
    if strongest != NONE:
        why, by, most = sounds[strongest].kind, sounds[strongest].signal, sounds[strongest].sound
    if listener >= auvs and len(pings):
        longest, met = PASSED * pings[-1].longest_s + ping_s, len(receptions)
        more, strongest = interference(
            receptions, met, met, listener - auvs, begins, ends, longest, None, None, inf
        )
        others += more
        if strongest != NONE and receptions[strongest].sound > most:
            why, by = BY_PING, receptions[strongest].ping
    if drowns(sound.sound, others, capture):
        return COLLIDED, why, by
    return (LOST, sound.why, NONE) if sound.outcome == LOST else (HEARD, NONE, NONE)
