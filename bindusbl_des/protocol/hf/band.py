"""The HF band: pings of AUVs or of ASVs, calls of ASVs, and where and when they arrive."""

from collections.abc import Callable, Iterable, Sequence
from functools import cache, lru_cache, partial
from heapq import heappop, heappush
from math import hypot

import numpy as np

from ...acoustics.channel import AskedChannel, Named, Prospects, Signals, between, deciding
from ...acoustics.doppler import beyond
from ...acoustics.loss import LossTerms
from ...acoustics.propagation import (
    TOUCH,
    SignalBand,
    Spread,
    amend,
    arrive,
    deafen,
    silence,
    spread,
)
from ...acoustics.sonar_channel import ECHO, EchoingSonar
from ...acoustics.sounds import Sounds
from ...acoustics.travel_time import PASSED, travel_time
from ...core.arrays import Flags, Floats, Ints
from ...core.packed import Packed
from ...core.streams import Purpose, Streams
from ...records.events import DOPPLER, FAILED_MEANWHILE, HEARD, IN_FLIGHT, LOST
from ...records.rows import CALLED, NONE, EventBuffer, Recorder, Rows
from ...vehicles.fleet import VehicleFleet
from ...vehicles.motion import places
from .calling import interrogate

# What a ping has that nobody called
NO_CALL = np.array([(np.nan, NONE, NONE, NONE, np.nan)], dtype=CALLED)


@lru_cache(maxsize=4096)
def members(group: tuple[int, ...]) -> Ints:
    """Return a ping group as an array; small fleets have the same groups again and again."""
    return np.array(group, dtype=np.int64)


class HfBand:
    """The HF band: sound spreads at a finite speed; where it arrives is on record as it is sent.

    AUVs ping and ASVs listen; with passive ranging ASVs ping and AUVs listen.  What becomes of a
    ping where it arrives is decided later (:class:`.outcomes.Outcomes`).
    """

    def __init__(
        self,
        auvs: VehicleFleet,
        asvs: VehicleFleet,
        band: SignalBand,
        channel: LossTerms | AskedChannel,
        streams: Streams,
        record: Recorder,
        bursts: Rows | None = None,
        *,
        doppler_limit: float | None = None,
        asvs_ping: bool = False,
    ) -> None:
        """Put a band together; the channel is the compiled disc with its loss, or one asked.

        Pings and calls are lost in `bursts` (AUVs, ASVs), :data:`...acoustics.bursts.PAIR`, if not
        None; and where their way changes faster than a `doppler_limit` (m/s).
        """
        self.doppler_limit = doppler_limit
        self.band, self.bursts, self.asvs_ping = band, bursts, asvs_ping
        self._channel, self.receiver, self._way = deciding(channel, band)
        self._auvs, self._asvs, self._record = auvs, asvs, record
        #: Who sends pings, and who listens.
        self.senders, self.listeners = (asvs, auvs) if asvs_ping else (auvs, asvs)
        self._hearers, self._all_auvs = len(self.listeners), range(len(auvs))
        self._may_fail = not (auvs.failures is None and asvs.failures is None)
        self._moving = [fleet for fleet in (auvs, asvs) if not fleet.foreseen]
        self._is_sure = self.listeners is asvs or auvs.foreseen
        #: The number among all vehicles of the first who listens: AUVs come first, then ASVs.
        self.first_listener = 0 if asvs_ping else len(auvs)
        #: What sounds where beside pings: calls, and where ASVs are deaf meanwhile their frames.
        self.sounds = Sounds(auvs, asvs, band.sound_speed, long=False)
        self._spread_in = self._packed()
        self._call_late_s: dict[int, Floats] = {}  # of the last call for each AUV, by each ASV
        self._luck = cache(partial(streams.of, Purpose.CALL))
        #: What the channel may draw from, where one is asked.
        self.random = None if self._channel is None else streams.of(Purpose.CHANNEL, 0)
        self._predicted = 0  # pings before this one have arrived everywhere
        self._nearly_there: list[tuple[float, int]] = []  # instants (s) and receptions, a heap
        self._prospects: dict[int, Prospects] = {}  # of pings, where a channel was asked
        #: Echoes, where the channel has any, row by row of receptions, :data:`ECHO`.
        has_echoes = isinstance(channel, EchoingSonar) and not asvs_ping
        self.echoes = EventBuffer(ECHO) if has_echoes else None
        #: Whom to tell of pings that have just been sent: on whose band AUVs are deaf meanwhile,
        #: who answers each of them, if anybody does, and who waits for them.
        self.deafens: Callable[[Iterable[tuple[int, int]], float, float], None] | None = None
        self.answered_by: Callable[[range], None] | None = None
        #: Who has data to send behind pings, which AUVs begin at an instant (s).
        self.followed_by: Callable[[Sequence[int], float], None] | None = None
        self.on_sent: Callable[[range], None] | None = None
        #: Where other AUVs hear pings as well, beside who listens.
        self.overheard: Callable[[range], None] | None = None

    def _packed(self) -> Packed:
        """Return the packed state that pings spread in, :class:`Spread`."""
        pings, receptions = self._record.pings, self._record.receptions
        motions = self.senders.motion, self.listeners.motion
        packed = Packed(
            Spread(
                pings.array, receptions.array, self._way, *motions, self.asvs_ping,
                self._record.everything,
            )
        )  # fmt: skip
        pings.hand_on(packed, "pings")
        receptions.hand_on(packed, "receptions")
        return packed

    def call(self, group: Sequence[int], callers: Ints, time: float) -> Rows:
        """Let ASVs call AUVs at an instant (s), one for each, who may name several in its call.

        Return for each AUV what became of its call (n,), :data:`CALLED`.
        """
        sounds, luck = self.sounds, self._luck
        chances = [
            luck(auv, asv).random() for auv, asv in zip(group, callers.tolist(), strict=True)
        ]
        self._ask_of_calls(group, time)
        self._foresee(group, time)
        answers = np.empty(len(group), CALLED)
        sounds.room_for(len(set(callers.tolist())) * sounds.vehicles)
        sounds.count = interrogate(
            self._spread_in.address, sounds.sea.address, members(tuple(group)), callers,
            np.array(chances), time, answers, sounds.count, self.receiver.capture, self.bursts,
        )  # fmt: skip
        if self._asvs.failures is not None:
            _, cut = self._asvs.failures.met(callers, time, time + self.band.duration)
            cut &= answers["call"] == HEARD
            answers["call"][cut], answers["call_why"][cut] = LOST, FAILED_MEANWHILE
        if self.doppler_limit is not None:
            cut = self._shifted(members(tuple(group)), callers, time, self.doppler_limit)
            cut &= answers["call"] == HEARD
            answers["call"][cut], answers["call_why"][cut] = LOST, DOPPLER
        return answers

    def _shifted(self, auvs: Ints, asvs: Ints, time: float, limit: float) -> Flags:
        """Tell which ways between AUVs and ASVs (n,) change faster than a limit (m/s)."""
        numbers = len(self._auvs) + np.ascontiguousarray(asvs)
        sea = self.sounds.sea.address
        return beyond(sea, np.ascontiguousarray(auvs), numbers, time, limit)

    def failed(self, time: float) -> tuple[int, ...]:
        """Return the ASVs that have failed by an instant (s): they neither hear nor call."""
        return self._asvs.failed(time)

    @property
    def foresees_calls(self) -> bool:
        """Whether it is sure when a call will be at an AUV; else it is predicted."""
        return not self._auvs.predicted

    def call_time(self, asv: int, auv: int, time: float) -> float:
        """Return how long (s) a call at an instant (s) was under way, once it has arrived."""
        caller, at = self._asvs.vehicles[asv].at(time), self._auvs.vehicles[auv].at
        late = float(self._call_late_s[auv][asv]) if auv in self._call_late_s else 0.0
        return travel_time(caller, at, time + late, self.band.sound_speed) + late

    def _ask(self, group: Sequence[int], time: float) -> None:
        """Ask what becomes of pings; not the disc, it is compiled."""
        if self._channel is not None:
            prospects = self._channel.prospects(self._signals(group, time, self.asvs_ping))
            if self.asvs_ping:
                prospects = np.ascontiguousarray(prospects[:, list(group)].T)
            self._foretell(prospects)
            if not self._is_sure:
                first = self._record.pings.count
                self._prospects |= {first + k: prospects[k : k + 1] for k in range(len(group))}

    def _ask_of_calls(self, group: Sequence[int], time: float) -> None:
        """Ask what becomes of calls for a group at all AUVs, by number: they are sounds there."""
        if self._channel is not None:
            prospects = self._channel.prospects(self._signals(self._all_auvs, time, calling=True))
            self._foretell(prospects)
            self._call_late_s |= {auv: prospects["late_s"][auv] for auv in group}

    def _foretell(self, prospects: Prospects) -> None:
        """Have compiled code know what becomes of signals."""
        self._spread_in.renew("way", self._way._replace(prospects=prospects))

    def _signals(self, group: Sequence[int], time: float, calling: bool) -> Signals:
        """Return the signals that begin at an instant (s) between AUVs and all ASVs: those of a
        group, or all AUVs where ASVs ping.
        """
        self._auvs.advance(time)
        self._asvs.advance(time)
        auvs, asvs = (places(fleet.motion, time)[:, :3] for fleet in (self._auvs, self._asvs))
        numbers = members(tuple(self._all_auvs if self.asvs_ping else group))
        auvs = auvs.take(numbers, axis=0)
        named = Named(numbers, members(tuple(range(len(asvs)))), "hf", self.random)
        return between(time, auvs, asvs, self.band.reach, calling, named)

    def _foresee(self, group: Sequence[int], time: float) -> None:
        """Make known where AUVs are until a sound sent at an instant (s) has met or passed them."""
        self._auvs.advance(time)
        self._asvs.advance(time)
        if not (self._auvs.foreseen or self._auvs.predicted):
            if self._channel is None:
                way = hypot(
                    self.band.reach, max(self._auvs.vehicles[auv].at(time).z for auv in group)
                )
            else:  # sound may reach anybody
                way = float(self._signals(group, time, calling=True).ranges.max())
                late = max(float(self._call_late_s[auv].max()) for auv in group)
                way += max(late, 0.0) * self.band.sound_speed
            self._auvs.advance(time + PASSED * way / self.band.sound_speed)

    def send(
        self,
        round_number: int,
        slot: int,
        group: Sequence[int],
        time: float,
        called: Rows = NO_CALL,
        waited: float | Floats | None = None,
    ) -> range:
        """Let a group ping now, at `time` (s); return the pings.

        What became of a call that an AUV answers, or should have, tells `called` (1,); how long (s)
        AUVs have held back, `waited`.
        """
        pings, receptions = self._record.pings, self._record.receptions
        first, count = pings.count, len(group)
        row = receptions.count
        for fleet in self._moving:
            fleet.advance(time)
        self._ask(group, time)
        pings.room_for(count)
        receptions.room_for(count * self._hearers)
        receptions.count = spread(
            self._spread_in.address, members(tuple(group)), round_number, slot, time, called,
            self.sounds.count, self._is_sure, first, row,
        )  # fmt: skip
        pings.count = first + count
        if waited is not None:
            pings.rows["waited_s"][first:] = waited
        if self.echoes is not None:
            self._echo(group, first, row, self.echoes)
        if self._may_fail:
            self._cut_short(group, first, row, time)
        if self.doppler_limit is not None:
            receptions_now = receptions.rows[row:]
            cut = self._shifted(
                receptions_now["auv"], receptions_now["asv"], time, self.doppler_limit
            )
            cut &= receptions_now["outcome"] == IN_FLIGHT
            receptions_now["outcome"][cut], receptions_now["why"][cut] = LOST, DOPPLER
        if called[0]["call"] not in (NONE, HEARD):
            silence(receptions.rows[row:], called[0]["call"])
        if not self._is_sure:
            for number in range(row, receptions.count):
                heappush(
                    self._nearly_there, (float(receptions.array[number]["arrived_at_s"]), number)
                )
        sent = range(first, pings.count)
        if self.deafens is not None and called[0]["call"] in (NONE, HEARD):
            self.deafens(zip(sent, group, strict=True), time, self.band.duration)
        if self.followed_by is not None and called[0]["call"] in (NONE, HEARD):
            self.followed_by(group, time)
        if self.overheard is not None and called[0]["call"] in (NONE, HEARD):
            self.overheard(sent)
        if self.on_sent is not None:
            self.on_sent(sent)
        if self.answered_by is not None:
            self.answered_by(sent)
        return sent

    def _cut_short(self, group: Sequence[int], first: int, row: int, time: float) -> None:
        """Let nobody hear pings from `first` on, sent at an instant (s), whose receptions begin
        with a row, where who sends or who listens fails.
        """
        pings, receptions = self._record.pings.rows[first:], self._record.receptions.rows[row:]
        if self.senders.failures is not None:
            end = time + self.band.duration
            _, cut = self.senders.failures.met(group, [time] * len(group), [end] * len(group))
            under_way = cut[receptions["ping"] - first] & (receptions["outcome"] == IN_FLIGHT)
            receptions["outcome"][under_way] = LOST
            receptions["why"][under_way] = FAILED_MEANWHILE
        if self.listeners.failures is not None:
            deafen(self.listeners.failures, pings, receptions, self.band)

    def update_arrivals(self, time: float) -> None:
        """Amend what has arrived by now, an instant (s), at who listens and has no sure future:
        steers by fixes, or is moved by an outside program.
        """
        if self.listeners.foreseen:
            return
        self.listeners.advance(time)
        if self._is_sure and self.listeners.predicted:
            self._predicted = amend(
                self._spread_in.address, time, self._predicted, self._record.pings.count
            )
        pings, receptions = self._record.pings.array, self._record.receptions.array
        while self._nearly_there and self._nearly_there[0][0] <= time + TOUCH:
            row = heappop(self._nearly_there)[1]
            reception, bent = receptions[row], 0.0
            ping, listener = pings[reception["ping"]], int(reception["listener"])
            if self._channel is not None:
                prospects = self._prospects[int(reception["ping"])]
                self._foretell(prospects)
                bent = float(prospects["late_s"][0, listener])
            place, sent_at = (ping["x_m"], ping["y_m"], ping["z_m"]), float(ping["sent_at_s"])
            at, speed = self.listeners.vehicles[listener].at, self.band.sound_speed
            arrive(
                self._spread_in.address, row, travel_time(place, at, sent_at + bent, speed), bent
            )

    def _echo(self, group: Sequence[int], first: int, row: int, echoes: EventBuffer) -> None:
        """Note the echoes of pings from `first` on, whose receptions begin with a row."""
        assert isinstance(self._channel, EchoingSonar)
        pings, receptions = self._record.pings.rows, self._record.receptions.rows[row:]
        sent_at = float(pings["sent_at_s"][first])
        heard = self._channel.heard(self._signals(group, sent_at, calling=False))[1]
        found = heard[receptions["ping"] - first, receptions["asv"]]
        echoes.room_for(len(found))[row : row + len(found)] = found
        echoes.count = row + len(found)
        for name in ("late_s", "lowered"):
            receptions[name] = found[name]
        last = (receptions["travel_time_s"] + found["later_s"].max(axis=1)).max(initial=0.0)
        longest = pings["longest_s"][first:]
        np.maximum(longest, last, out=longest)
