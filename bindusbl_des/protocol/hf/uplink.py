"""The HF band: who hears a ping, how late, and whether at all."""

from collections.abc import Callable, Sequence
from functools import cache, partial
from math import hypot

import numpy as np

from ...acoustics.channel import (
    NO_LOSS,
    AskedChannel,
    Bending,
    Signals,
    between,
    deciding,
)
from ...acoustics.deafness import deafen
from ...acoustics.loss import LossTerms
from ...acoustics.prediction import amend
from ...acoustics.propagation import DISC, Band, Way, spread
from ...acoustics.sonar.echoing import ECHO, EchoingSonar
from ...acoustics.travel_time import travel_time
from ...core.streams import Purpose, Streams
from ...records.events import HEARD, IN_FLIGHT, LOST
from ...records.recorder import EventBuffer, Recorder
from ...records.rows import CALLED, NONE, Row, Rows
from ...usbl.instrument import NOISE_WIDTH, Usbl
from ...usbl.measurement import note
from ...usbl.own_instrument import OwnInstrument, sounding_of
from ...usbl.systematic import Astray
from ...vehicles.fleet import Fleet
from ...vehicles.motion import Floats, Ints, places
from .calling import CALL, interrogate
from .handed import NO_CALL, NOT_CALLED, decided_by, members, spread_in
from .measuring import Measuring
from .reception import foretold, settle

# Factor on the longest way after which sound has met whoever was in range; nobody is as fast.
PASSED = 1.05


class Uplink:
    """The HF uplink: sound spreads at a finite speed, overlapping arrivals destroy each other.

    A ping is decided (what becomes of it at each ASV, and the fix of it) not before it has passed,
    when all sound that could overlap it is on record; it does not matter how long after.
    """

    def __init__(
        self,
        auvs: Fleet,
        asvs: Fleet,
        band: Band,
        channel: LossTerms | AskedChannel,
        instrument: Usbl | Astray | OwnInstrument,
        streams: Streams,
        strayed: Floats | None,
        record: Recorder,
    ) -> None:
        """Put a band together; `strayed` (n,), m2, as of :func:`.reception.settle`.

        The channel is the compiled disc with its loss, or one that is asked; the instrument ships
        or is somebody's own.
        """
        self.band = band
        self.receiver, air = deciding(channel, band)
        self._auvs, self._asvs, self._record, self._vessels = auvs, asvs, record, len(asvs)
        self._channel = None if isinstance(channel, LossTerms) else channel
        self._loss = channel if isinstance(channel, LossTerms) else NO_LOSS
        self._bending = channel if isinstance(channel, Bending) else None
        self._echoes = EventBuffer(ECHO) if isinstance(channel, EchoingSonar) else None
        self._moving = [fleet for fleet in (auvs, asvs) if not fleet.foreseen]
        self._strayed, self._way = strayed, Way(air, self._loss, DISC)
        self._measuring = Measuring(instrument, streams, len(auvs), len(asvs), record)
        self._luck = cache(partial(streams.of, Purpose.CALL))
        self._calls = EventBuffer(CALL)
        self._spread_in = spread_in(record, self._way, auvs, asvs)
        self._decided_by = decided_by(
            record, self._calls, asvs, self._measuring, band.duration, self.receiver
        )
        self._undecided = 0  # pings before this one are decided
        self._predicted = 0  # pings before this one have arrived everywhere
        self.deafening: EventBuffer | None = None  # frames whose ASVs are deaf meanwhile
        #: Whom to tell of pings that have just been sent; nobody unless somebody waits for them.
        self.on_sent: Callable[[range], None] | None = None

    def call(self, group: Sequence[int], callers: Ints, time: float) -> Rows:
        """Let ASVs call AUVs at an instant (s), one for each, who may name several in its call.

        Return for each AUV what became of its call (n,), :data:`.rows.CALLED`.
        """
        calls, luck = self._calls, self._luck
        chances = [
            luck(auv, asv).random() for auv, asv in zip(group, callers.tolist(), strict=True)
        ]
        self._ask(group, time, calling=True)
        self._foresee(group, time)
        answers, sounds = np.empty(len(group), CALLED), len(set(callers.tolist())) * len(self._asvs)
        calls.count = interrogate(
            self._spread_in.address, members(tuple(group)), callers, np.array(chances), time,
            answers, calls.room_for(sounds), calls.count, self.receiver.capture,
        )  # fmt: skip
        if self._asvs.failures is not None:
            _, cut = self._asvs.failures.met(callers, time, time + self.band.duration)
            answers["call"][cut & (answers["call"] == HEARD)] = LOST
        return answers

    def failed(self, time: float) -> tuple[int, ...]:
        """Return the ASVs that have failed by an instant (s): they neither hear nor call."""
        return self._asvs.failed(time)

    @property
    def _beside(self) -> tuple[Rows | None, Rows | None]:
        """Sound that few bands have: echoes of pings, and frames that deafen ASVs."""
        return (
            None if self._echoes is None else self._echoes.rows,
            None if self.deafening is None else self.deafening.rows,
        )

    @property
    def foresees_calls(self) -> bool:
        """Whether it is sure when a call will be at an AUV; else it is predicted."""
        return not self._auvs.predicted

    def call_time(self, asv: int, auv: int, time: float) -> float:
        """Return how long (s) a call at an instant (s) was under way, once it has arrived."""
        caller = self._asvs.vehicles[asv].at(time)
        return travel_time(caller, self._auvs.vehicles[auv].at, time, self.band.sound_speed)

    def _ask(self, group: Sequence[int], time: float, calling: bool = False) -> None:
        """Ask what becomes of signals of AUVs, or calls for them; not the disc, it is compiled."""
        if self._channel is not None:
            prospects = self._channel.prospects(self._signals(group, time, calling))
            self._spread_in.renew("way", self._way._replace(prospects=prospects))

    def _signals(self, group: Sequence[int], time: float, calling: bool) -> Signals:
        """Return the signals that begin at an instant (s) between AUVs and all ASVs."""
        self._auvs.advance(time)
        self._asvs.advance(time)
        auvs = places(self._auvs.motion, time).take(members(tuple(group)), axis=0)[:, :3]
        asvs = places(self._asvs.motion, time)[:, :3]
        return between(time, auvs, asvs, self.band.reach, calling)

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
            self._auvs.advance(time + PASSED * way / self.band.sound_speed)

    def send(
        self,
        round_number: int,
        slot: int,
        group: Sequence[int],
        time: float,
        called: Rows = NO_CALL,
        waited: float | None = None,
    ) -> range:
        """Let AUVs ping now, at `time` (s); return their pings.

        What became of a call that they answer, or should have, tells `called` (1,); how long (s)
        they have held back, `waited`.
        """
        pings, receptions = self._record.pings, self._record.receptions
        first, count = pings.count, len(group)
        row = receptions.count
        for fleet in self._moving:
            fleet.advance(time)
        self._ask(group, time)
        pings.room_for(count)
        receptions.room_for(count * self._vessels)
        call: tuple[float, int, int, float]
        call = NOT_CALLED if called is NO_CALL else called[0].item()
        receptions.count = spread(
            self._spread_in.address, members(tuple(group)), round_number, slot, time,
            *call, self._calls.count, first, row,
        )  # fmt: skip
        pings.count = first + count
        if waited is not None:
            pings.rows["waited_s"][first:] = waited
        if self._echoes is not None:
            self._echo(group, first, row, self._echoes)
        elif self._bending is not None:
            self._bend(self._bending, group, first, row)
        if self._asvs.failures is not None:
            deafen(self._asvs.failures, pings.rows[first:], receptions.rows[row:], self.band)
        if self.on_sent is not None:
            self.on_sent(range(first, pings.count))
        return range(first, pings.count)

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

    def _bend(self, channel: Bending, group: Sequence[int], first: int, row: int) -> None:
        """Note how late pings from `first` on come, whose receptions begin with a row."""
        receptions = self._record.receptions.rows[row:]
        sent_at = float(self._record.pings.rows["sent_at_s"][first])
        late = channel.late_s(self._signals(group, sent_at, calling=False))
        receptions["late_s"] = late[receptions["ping"] - first, receptions["asv"]]
        receptions["lowered"] = 0.0

    def decide_passed(self, time: float) -> range:
        """Decide every ping that has passed all ASVs by an instant (s); return the new fixes."""
        first = self._record.fixes.count
        self.amend(time)
        while True:
            undecided, _, asv = self._settle(time, self._undecided)
            if asv == NONE:
                break
            self._refill_noise()  # of all at once: settling begins anew each time
        self._undecided = undecided
        return range(first, self._record.fixes.count)

    def _settle(self, time: float, ping: int, only: int = NONE) -> tuple[int, int, int]:
        """Decide what has passed; return the first ping that has not, and an AUV and an ASV whose
        noise is used up, or NONE.
        """
        pings, receptions, fixes = self._record.pings, self._record.receptions, self._record.fixes
        count, measuring = fixes.count, self._measuring
        measuring.make_room(pings.count - self._undecided + 1)
        fixes.count, undecided, auv, asv = settle(
            self._decided_by.address, time, ping, only, pings.count, receptions.count,
            self._calls.count, count, *measuring.made_for, self._strayed, *self._beside,
        )  # fmt: skip
        if measuring.own is not None:
            for fix in fixes.array[count : fixes.count]:
                self._measure(measuring.own, fix)
        return undecided, auv, asv

    def _measure(self, instrument: OwnInstrument, fix: Row) -> None:
        """Have a ping measured by an instrument of somebody's own."""
        met = self._record.receptions.array[fix["first"] : fix["end"]]
        heard = met[met["outcome"] == HEARD]
        poses = [self._asvs.vehicles[it["asv"]].at(float(it["arrived_at_s"])) for it in heard]
        ping, draw = self._record.pings.array[fix["ping"]], self._measuring.draw(int(fix["auv"]))
        note(fix, ping, *instrument.fused(sounding_of(ping, heard, np.array(poses), draw)))

    def _refill_noise(self) -> None:
        """Draw noise for every pair that a ping is under way between and that has none left."""
        rows = self._record.receptions.rows[self._record.pings.array[self._undecided]["first"] :]
        under_way = rows["outcome"] == IN_FLIGHT
        self._measuring.noise.refill_spent(rows["auv"][under_way], rows["asv"][under_way])

    def decide(self, ping: int, row: int) -> bool:
        """Decide one reception of a ping that has passed its ASV; tell whether it made a fix."""
        count = self._record.fixes.count
        while (dry := self._settle(0.0, ping, row)[1:])[1] != NONE:
            self._measuring.noise.refill(*dry)
        return self._record.fixes.count > count

    def amend(self, time: float) -> None:
        """Amend what has arrived by now, an instant (s), at ASVs whose way was predicted."""
        if self._asvs.predicted:
            self._asvs.advance(time)
            self._predicted = amend(
                time, self._predicted, self._record.pings.rows, self._record.receptions.rows,
                self.band.duration, self.band.sound_speed, *self._asvs.motion,
            )  # fmt: skip

    def first_under_way(self, time: float) -> int:
        """Return the first reception that may not be over by an instant (s)."""
        pings = self._record.pings.rows
        if not len(pings):
            return 0
        lasts = PASSED * float(pings["longest_s"][-1]) + self.band.duration
        first = int(np.searchsorted(pings["sent_at_s"], time - lasts))
        return int(pings["first"][first]) if first < len(pings) else self._record.receptions.count

    def _first_undecided(self) -> int:
        """Return the first reception that is not decided; there must be one."""
        outcomes = self._record.receptions.rows["outcome"]
        while True:
            ping = self._record.pings.array[self._undecided]
            undecided = np.flatnonzero(outcomes[ping["first"] : ping["end"]] == IN_FLIGHT)
            if len(undecided):
                return int(ping["first"] + undecided[0])
            self._undecided += 1

    def outcome_of(self, row: int) -> tuple[int, float]:
        """Return what becomes of a ping at an ASV that it has just passed, decided or not; and its
        SNR (dB) there.

        Its noise is that of the pair's next reception, after those of pings not yet decided.
        """
        pings, receptions = self._record.pings.rows, self._record.receptions.rows
        it = receptions[row]
        if it["outcome"] != IN_FLIGHT:
            return int(it["outcome"]), float(it["snr_db"])
        before = receptions[self._first_undecided() : row]
        same = (before["auv"] == it["auv"]) & (before["asv"] == it["asv"])
        ahead = int((same & (before["outcome"] == IN_FLIGHT)).sum())
        luck = float(self._measuring.noise.peek(int(it["auv"]), int(it["asv"]), ahead)[NOISE_WIDTH])
        duration, receiver = self.band.duration, self.receiver
        outcome = foretold(
            row, luck, pings, receptions, self._calls.rows, *self._beside, duration,
            receiver.capture,
        )  # fmt: skip
        return outcome, float(it["snr_db"]) + receiver.shadowing_sd_db * luck

    def close(self, time: float) -> None:
        """Decide what of pings still under way has arrived by the end of the mission (s)."""
        self.amend(time)
        receptions, fixes = self._record.receptions.rows, self._record.fixes
        arrived = receptions["arrived_at_s"] + self.band.duration < time
        count = fixes.count
        for row in np.flatnonzero((receptions["outcome"] == IN_FLIGHT) & arrived).tolist():
            self.decide(int(receptions["ping"][row]), row)
        fixes.count = count  # nobody waits for what others hear of them any more
