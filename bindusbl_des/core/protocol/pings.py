"""The HF band: pings, calls for them, and where and when both arrive.

Each arrival is on record as its sound is sent.  Outcomes of pings are decided later
(:class:`.outcomes.Outcomes`), those of calls at once.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cache, lru_cache, partial
from heapq import heappop, heappush
from math import hypot, inf, nan

import numpy as np

from ...support.arrays import Flags, Floats, Ints
from ...support.compiled import compiled
from ...support.packed import Packed, unpacked
from ...support.streams import Purpose, Streams
from ..acoustics.bursts import burst_luck
from ..acoustics.channel import (
    NO_LOSS,
    PLAIN,
    AskedChannel,
    LevelledChannel,
    Prospects,
    Signals,
    between,
)
from ..acoustics.loss import LossTerms, chance_of
from ..acoustics.propagation import (
    NO_PROSPECTS,
    TOUCH,
    SignalBand,
    SignalPath,
    Spread,
    amend,
    arrive,
    drowns,
    lose_at_failed,
    loss_at,
    prospect,
    silence,
    spread_pings,
    within,
)
from ..acoustics.signals import Sounds, Spreading
from ..acoustics.sonar_channel import ECHO, EchoingSonar
from ..acoustics.sounds import DEAFENING, Sea, beyond, emit, interference, solve
from ..acoustics.travel_time import PASSED, travel_time
from ..geometry.crossing import crosses
from ..geometry.land import Land
from ..records.events import (
    BLOCKED,
    BURST,
    BY_CALL,
    CHANCE,
    COLLIDED,
    DOPPLER,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    Signal,
)
from ..records.rows import CALLED, NONE, EventBuffer, Recorder, Rows
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places, where

# The edges of no land
NO_SHORES = np.empty((0, 4))

# The call of a ping that answers none, and the ranging's default argument
NO_CALL = np.array([(np.nan, NONE, NONE, NONE, np.nan)], dtype=CALLED)


@lru_cache(maxsize=4096)
def members(group: tuple[int, ...]) -> Ints:
    """Return a ping group as an array; small fleets have the same groups again and again."""
    return np.array(group, dtype=np.int64)


class HfBand:
    """The HF band: AUVs ping, and ASVs listen and may call."""

    def __init__(
        self,
        auvs: VehicleFleet,
        asvs: VehicleFleet,
        band: SignalBand,
        channel: LossTerms | AskedChannel,
        streams: Streams,
        record: Recorder,
        bursts: Rows | None = None,
        doppler_limit: float | None = None,
        land: Land | None = None,
    ) -> None:
        """Build the band.  `channel`: the disc's law of loss, or a channel that is asked; where
        there is `land`, one that knows of it.

        Pings and calls are lost in `bursts` (AUVs, ASVs), :data:`..acoustics.bursts.PAIR`, if not
        None, and where the range changes faster than `doppler_limit` (m/s).
        """
        self.band, self.bursts, self._auvs, self._asvs, self._record = (
            band, bursts, auvs, asvs, record
        )  # fmt: skip
        #: The fleets that ping and that listen, and the vehicle number of the first listener.
        self.senders, self.listeners, self.first_listener = self._ends()
        self._listeners = len(self.listeners)
        self._channel = asked = None if isinstance(channel, LossTerms) else channel
        #: The level (dB re 1 uPa at 1 m) of what is sent; None where the channel has no levels.
        self.source_level_db: float | None = None
        if isinstance(asked, LevelledChannel):
            self.source_level_db = asked.source_level_db
            self._levelled = lru_cache(maxsize=16)(asked.at_level)
        #: What decides at a receiver.
        self.receiver = PLAIN if asked is None else asked.receiver
        audible = None if asked is None else asked.audible_m
        sounding = band if audible is None else band._replace(reach=audible)
        loss = channel if isinstance(channel, LossTerms) else NO_LOSS
        self._way = SignalPath(sounding, loss, NO_PROSPECTS)
        random = None if asked is None else streams.of(Purpose.CHANNEL, 0)
        #: How signals other than pings and calls propagate.
        self.spreading = Spreading(asked, loss, band.slant, band.reach, "hf", random, doppler_limit)
        self._shores = NO_SHORES if land is None else land.edges
        self._may_fail = not (auvs.failures is None and asvs.failures is None)
        self._moving = [fleet for fleet in (auvs, asvs) if not fleet.foreseen]
        self._is_sure = self.listeners is asvs or auvs.foreseen
        #: All sounds but pings: calls, data, and frames where ASVs hear nothing as they send them.
        self.sounds = Sounds(auvs, asvs, band.sound_speed, long=False)
        self._called, self._call = NO_CALL, NO_CALL.copy()  # what was handed over last, and where
        self._spread_in = self._packed()
        self._call_late_s: dict[int, Floats] = {}  # by AUV: how late its last call by each ASV is
        self._luck = cache(partial(streams.of, Purpose.CALL))
        self._predicted = 0  # pings before this one have arrived everywhere
        self._nearly_there: list[tuple[float, int]] = []  # instants (s) and receptions, a heap
        self._prospects: dict[int, Prospects] = {}  # by ping, where a channel was asked
        #: Echoes, where the channel has any, row by row of receptions, :data:`ECHO`.
        in_open_sea = getattr(asked, "open_sea", asked)
        has_echoes = isinstance(in_open_sea, EchoingSonar) and self.listeners is asvs
        self.echoes = EventBuffer(ECHO) if has_echoes else None
        #: Called in this order with pings that have just been sent: what makes senders deaf, sends
        #: data behind pings, or lets AUVs hear them; what waits for arrivals; what answers pings.
        self.on_ping: list[Callable[[range], None]] = []
        self.on_sent: Callable[[range], None] | None = None
        self.answered_by: Callable[[range], None] | None = None
        #: Called with each signal of a program that begins, and with the sounds, rows, of signals
        #: and pings.
        self.on_signal: Callable[[Signal], None] | None = None
        self.on_sounds: Callable[[Iterable[int]], None] | None = None

    def _ends(self) -> tuple[VehicleFleet, VehicleFleet, int]:
        """Return the fleets that ping and listen, and the vehicle number of the first listener."""
        return self._auvs, self._asvs, len(self._auvs)

    def at_level(self, level_db: float | None) -> Spreading:
        """Return how signals of a source level (dB re 1 uPa at 1 m; None: the channel's) travel."""
        if level_db is None:
            return self.spreading
        return self.spreading._replace(channel=self._levelled(level_db))

    def became(self, row: int, time: float) -> tuple[int, int, int]:
        """Return the outcome of the sound in a row by `time` (s), the reason, and the number of the
        signal that overlapped it; pings sound at ASVs as well.
        """
        met = self._record.receptions.rows, self._record.pings.rows, self.band.duration
        return self.sounds.outcome(row, time, self.receiver.capture, met)

    def _packed(self) -> Packed:
        """Return the packed :class:`Spread`, in which pings propagate."""
        pings, receptions = self._record.pings, self._record.receptions
        packed = Packed(
            Spread(
                pings.array, receptions.array, self._way, self.senders.motion,
                self.listeners.motion, self.senders is self._asvs, self._record.everything,
                self._call,
            )
        )  # fmt: skip
        pings.hand_on(packed, "pings")
        receptions.hand_on(packed, "receptions")
        return packed

    # Calls

    def call(self, group: Sequence[int], callers: Ints, time: float) -> Rows:
        """Let the ASVs `callers` (n,) each call one AUV of a group (n) at an instant (s), with one
        call for all AUVs of an ASV.

        Return the calls with their outcomes (n,), :data:`CALLED`.
        """
        sounds, luck, auvs = self.sounds, self._luck, members(tuple(group))
        chances = [
            luck(auv, asv).random() for auv, asv in zip(group, callers.tolist(), strict=True)
        ]
        if self._channel is not None:  # calls are sounds at all AUVs
            prospects = self._channel.prospects(self._signals(range(len(self._auvs)), time, True))
            self._foretell(prospects)
            self._call_late_s |= {auv: prospects["late_s"][auv] for auv in group}
        self._foresee(group, time)
        answers = np.empty(len(group), CALLED)
        sounds.room_for(len(set(callers.tolist())) * sounds.vehicles)
        sounds.count = interrogate(
            self._spread_in.address, sounds.sea.address, auvs, callers, np.array(chances), time,
            answers, sounds.count, self.receiver.capture, self.bursts, self._shores,
        )  # fmt: skip
        of_calls = answers["call"], answers["call_why"], HEARD
        if self._asvs.failures is not None:
            _, cut = self._asvs.failures.met(callers, time, time + self.band.duration)
            _lose(*of_calls, cut, FAILED_MEANWHILE)
        if self.spreading.doppler_limit is not None:
            self._lose_shifted(*of_calls, auvs, callers, time)
        return answers

    def _lose_shifted(
        self, outcomes: Ints, reasons: Ints, before: int, auvs: Ints, asvs: Ints, time: float
    ) -> None:
        """Mark as lost the signals between AUVs and ASVs (n,), sent at an instant (s), whose range
        changes faster than the Doppler limit; other arguments as of :func:`_lose`.
        """
        numbers, limit = len(self._auvs) + np.ascontiguousarray(asvs), self.spreading.doppler_limit
        assert limit is not None
        sea, auvs = self.sounds.sea.address, np.ascontiguousarray(auvs)
        _lose(outcomes, reasons, before, beyond(sea, auvs, numbers, time, limit), DOPPLER)

    def failed(self, time: float) -> tuple[int, ...]:
        """Return the ASVs that have failed by an instant (s): they neither hear nor call."""
        return self._asvs.failed(time)

    @property
    def foresees_calls(self) -> bool:
        """Whether the arrival of a call at an AUV is certain; else it is predicted."""
        return not self._auvs.predicted

    def call_time(self, asv: int, auv: int, time: float) -> float:
        """Return how long (s) a call sent at an instant (s) took to an AUV that it has reached."""
        caller, at = self._asvs.vehicles[asv].at(time), self._auvs.vehicles[auv].at
        late = float(self._call_late_s[auv][asv]) if auv in self._call_late_s else 0.0
        return travel_time(caller, at, time + late, self.band.sound_speed) + late

    def _foresee(self, group: Sequence[int], time: float) -> None:
        """Advance AUVs' motion until a sound sent at an instant (s) has met or passed them."""
        self._auvs.advance(time)
        self._asvs.advance(time)
        if not (self._auvs.foreseen or self._auvs.predicted):
            if self._channel is None:
                way = hypot(
                    self.band.reach, max(self._auvs.vehicles[auv].at(time).z for auv in group)
                )
            else:  # sound may reach any vehicle
                way = float(self._signals(group, time, True).ranges.max())
                late = max(float(self._call_late_s[auv].max()) for auv in group)
                way += max(late, 0.0) * self.band.sound_speed
            self._auvs.advance(time + PASSED * way / self.band.sound_speed)

    # Channels that are asked: any but the disc, which is compiled

    def _prospects_of(self, channel: AskedChannel, group: Sequence[int], time: float) -> Prospects:
        """Return the channel's prospects of a group's pings sent at an instant (s), (n, m)."""
        return channel.prospects(self._signals(group, time, False))

    def _signals(self, auvs: Sequence[int], time: float, calling: bool) -> Signals:
        """Return the signals that begin at `time` (s) between some AUVs and all ASVs: pings, or
        calls if `calling`.
        """
        self._auvs.advance(time)
        self._asvs.advance(time)
        there, asvs = (places(fleet.motion, time)[:, :3] for fleet in (self._auvs, self._asvs))
        numbers, every = members(tuple(auvs)), members(tuple(range(len(asvs))))
        there = there.take(numbers, axis=0)
        named = numbers, every, "hf", self.spreading.random
        return between(time, there, asvs, self.band.reach, calling, *named)

    def _foretell(self, prospects: Prospects) -> None:
        """Hand prospects of signals to compiled code."""
        self._spread_in.renew("way", self._way._replace(prospects=prospects))

    # Pings

    def send(
        self,
        round_number: int,
        slot: int,
        group: Sequence[int],
        time: float,
        called: Rows = NO_CALL,
        waited: float | Floats | None = None,
        level_db: float | None = None,
    ) -> range:
        """Let a group ping now, at `time` (s); return the pings.

        `called` (1,) is the call that an AUV answers, or would have answered, :data:`CALLED`;
        `waited` is how long (s) AUVs have held back their pings; `level_db` as of :meth:`at_level`.
        """
        pings, receptions = self._record.pings, self._record.receptions
        first, row = pings.count, receptions.count
        for fleet in self._moving:
            fleet.advance(time)
        channel = self._channel if level_db is None else self.at_level(level_db).channel
        if channel is not None:
            prospects = self._prospects_of(channel, group, time)
            self._foretell(prospects)
            if not self._is_sure:
                self._prospects |= {first + k: prospects[k : k + 1] for k in range(len(group))}
        pings.room_for(len(group))
        receptions.room_for(len(group) * self._listeners)
        if called is not NO_CALL or self._called is not NO_CALL:
            self._called, self._call[:] = called, called
        receptions.count = spread_pings(
            self._spread_in.address, members(tuple(group)), round_number, slot, time,
            self.sounds.count, self._is_sure, first, row,
        )  # fmt: skip
        pings.count = first + len(group)
        sent, met = range(first, pings.count), receptions.array[row : receptions.count]
        if waited is not None:
            pings.rows["waited_s"][first:] = waited
        if self.echoes is not None:
            self._echo(channel, group, first, met, self.echoes)
        if self._may_fail:
            self._cut_short(group, first, met, time)
        if self.spreading.doppler_limit is not None:
            self._lose_shifted(met["outcome"], met["why"], IN_FLIGHT, met["auv"], met["asv"], time)
        is_silent = called is not NO_CALL and called[0]["call"] not in (NONE, HEARD)
        if is_silent:
            silence(met, called[0]["call"])
        if not self._is_sure:
            for number in range(row, receptions.count):
                heappush(
                    self._nearly_there, (float(receptions.array[number]["arrived_at_s"]), number)
                )
        for tell in () if is_silent else (*self.on_ping, self.on_sent, self.answered_by):
            if tell is not None:
                tell(sent)
        return sent

    def _cut_short(self, group: Sequence[int], first: int, receptions: Rows, time: float) -> None:
        """Mark as lost the `receptions` of a group's pings, sent at `time` (s), whose sender or
        listener fails meanwhile; `first` is the first of the pings.
        """
        if self.senders.failures is not None:
            end = time + self.band.duration
            _, cut = self.senders.failures.met(group, [time] * len(group), [end] * len(group))
            outcomes, reasons = receptions["outcome"], receptions["why"]
            _lose(outcomes, reasons, IN_FLIGHT, cut[receptions["ping"] - first], FAILED_MEANWHILE)
        if self.listeners.failures is not None:
            lose_at_failed(
                self.listeners.failures, self._record.pings.rows[first:], receptions, self.band
            )

    def update_arrivals(self, time: float) -> None:
        """Correct the arrivals by an instant (s) at listeners whose motion was predicted or
        unknown: an outside program moves them, or they steer by fixes.
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
            straight = travel_time(place, at, sent_at + bent, speed)
            arrive(self._spread_in.address, row, straight, bent)

    def _echo(
        self, channel: AskedChannel | None, group: Sequence[int], first: int, receptions: Rows,
        echoes: EventBuffer,
    ) -> None:  # fmt: skip
        """Write the echoes of pings from `first` on beside their receptions, the last on record."""
        channel = getattr(channel, "open_sea", channel)
        assert isinstance(channel, EchoingSonar)
        pings, row = self._record.pings.rows, self._record.receptions.count - len(receptions)
        sent_at = float(pings["sent_at_s"][first])
        heard = channel.heard(self._signals(group, sent_at, False))[1]
        found = heard[receptions["ping"] - first, receptions["asv"]]
        found["sound"][receptions["why"] == BLOCKED] = 0.0
        echoes.room_for(len(found))[row : row + len(found)] = found
        echoes.count = row + len(found)
        for name in ("late_s", "lowered"):
            receptions[name] = found[name]
        last = (receptions["travel_time_s"] + found["later_s"].max(axis=1)).max(initial=0.0)
        longest = pings["longest_s"][first:]
        np.maximum(longest, last, out=longest)


class BeaconBand(HfBand):
    """The HF band of passive ranging: ASVs ping, and AUVs listen."""

    def _ends(self) -> tuple[VehicleFleet, VehicleFleet, int]:
        return self._asvs, self._auvs, 0

    def _prospects_of(self, channel: AskedChannel, group: Sequence[int], time: float) -> Prospects:
        prospects = channel.prospects(self._signals(range(len(self._auvs)), time, True))
        return np.ascontiguousarray(prospects[:, list(group)].T)


def _lose(outcomes: Ints, reasons: Ints, before: int, cut: Flags, why: int) -> None:
    """Where `cut` (n,) holds and a signal's outcome is still `before`, set the outcome (n,) to lost
    and the reason (n,) to `why`.
    """
    cut = cut & (outcomes == before)
    outcomes[cut], reasons[cut] = LOST, why


@compiled
def interrogate(
    packed: int, packed_sea: int, group: Ints, callers: Ints, chances: Floats, time: float,
    answers: Rows, count: int, capture: float, bursts: Rows | None, shores: Floats,
) -> int:  # fmt: skip
    """Let ASVs call the AUVs of a group at an instant (s), one for each; one call may name several.

    Write the outcome of each call to `answers` (n,), :data:`..records.rows.CALLED`, and its sounds
    at all vehicles behind the first `count`; return the new count.  Sounds that overlap a call at
    its AUV may drown it.  A call is lost as a ping over the same path is: if its entry of `chances`
    (n,), in [0, 1), or the luck of its pair in `bursts`, is below the loss probability, as of
    :func:`.reception.resolve`.  `packed` is the address of a :class:`Spread`, `packed_sea` of a
    :class:`Sea`; `capture` as of :class:`..acoustics.channel.Receiver`, `shores` (n, 4) as of
    :attr:`..geometry.land.Land.edges`.
    """
    into, sea, first = unpacked(packed, Spread), unpacked(packed_sea, Sea), count
    auvs, asvs, way, band = into.senders, into.listeners, into.way, into.way.band
    fleet = auvs.first.size - 1
    for caller in np.unique(callers):
        count = _call(caller, time, count, into, sea, shores)
    for row in range(first, count):
        if sea.sounds[row].listener >= fleet:  # may overlap pings at ASVs
            solve(sea.sounds[row], inf, sea)
    for k in range(len(group)):
        answer, auv, caller = answers[k], group[k], callers[k]
        here, there = where(auvs, auv, time), where(asvs, caller, time)
        answer.called_at_s, answer.called_by = time, caller
        answer.call, answer.call_time_s = OUT_OF_RANGE, nan
        near, _, _, _, answer.call_why = prospect(here, there, auv, caller, way)
        if not near:
            continue
        row = first
        while sea.sounds[row].sender != fleet + caller or sea.sounds[row].listener != auv:
            row += 1
        call = sea.sounds[row]
        solve(call, inf, sea)  # where the AUV will be is known, or predicted
        chance = loss_at((call.travel_s - call.late_s) * band.sound_speed, auv, caller, way)
        drawn = chances[k]
        if bursts is not None:
            drawn = chance_of(burst_luck(bursts[auv, caller], call.arrived_at_s, chance))
        answer.call, answer.call_why, answer.call_time_s = HEARD, NONE, call.travel_s
        if drawn < chance:
            answer.call, answer.call_why = LOST, CHANCE if bursts is None else BURST
        others, strongest = interference(
            sea.sounds[:count], row, row + 1, auv, call.arrived_at_s, call.ended_at_s,
            sea.sounds[count - 1].longest_s, None, sea, inf,
        )  # fmt: skip
        if drowns(call.sound, others, capture):
            answer.call, answer.call_why = COLLIDED, sea.sounds[strongest].kind
    return count


@compiled
def _call(caller: int, time: float, count: int, into: Spread, sea: Sea, shores: Floats) -> int:
    """Let an ASV call at `time` (s): write its sounds behind the first `count`; return the new
    count.

    The call deafens its ASV and all ASVs within range of it that no land hides, however strong
    pings are.  `shores` (n, 4) are the land's edges.
    """
    auvs, asvs, way, band = into.senders, into.listeners, into.way, into.way.band
    fleet, vessels = auvs.first.size - 1, asvs.first.size - 1
    strengths, lates = np.full(fleet + vessels, nan), np.zeros(fleet + vessels)
    there = where(asvs, caller, time)
    for auv in range(fleet):
        here = where(auvs, auv, time)
        heard, strength, _, lates[auv], _ = prospect(here, there, auv, caller, way)
        if strength > 0.0 or heard:
            strengths[auv] = strength
    for asv in range(vessels):
        here = where(asvs, asv, time)
        if asv != caller and (
            not within(there, here, band.slant, band.reach)
            or crosses(there[0], there[1], here[0], here[1], shores)
        ):
            continue
        strengths[fleet + asv] = DEAFENING
    lasts = band.duration
    return emit(sea, count, BY_CALL, caller, fleet + caller, time, lasts, strengths, lates)
