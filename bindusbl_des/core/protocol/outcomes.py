"""Outcomes of pings, decided when fixes are asked for: all pings at once that have passed by then.

Compiled code decides them (:mod:`.reception`).
"""

import math
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np
import simpy

from ...support.arrays import Floats
from ...support.packed import Packed
from ...support.streams import NoiseStore, Purpose, Streams
from ..acoustics.bursts import PAIR, burst_luck
from ..acoustics.travel_time import PASSED
from ..records.events import HEARD, IN_FLIGHT
from ..records.rows import NONE, EventBuffer, Recorder, Row, Rows
from ..usbl.array import ELEMENTS, plus, scaled
from ..usbl.fixes import OUTLIER_WIDTH, UsblWithErrors, measured, measured_with_errors, note
from ..usbl.instrument import Usbl, packed
from ..usbl.measuring import HEADING_NOISE, NO_INSTRUMENT, NOISE_WIDTH, gnss_noise
from ..usbl.own_instrument import OwnInstrument, mirrored, sounding_of
from ..usbl.range_rates import RangeRates
from ..usbl.sights import Heard
from ..usbl.slow_errors import SLOW, advance, blend
from ..usbl.systematic_effects import PackedErrors, Systematic, gnss_error
from .pings import HfBand
from .reception import Decided, PairNoise, foretold, resolve
from .steps import moment


class Measuring:
    """How a fleet measures the pings of a band: the instrument, its noise, its systematic errors.

    `own` is a user-defined instrument, which measures in Python the pings that compiled code has
    decided, with a `draw` for each AUV; None where one that ships measures.
    """

    def __init__(
        self,
        instrument: Sequence[Usbl] | UsblWithErrors | OwnInstrument,
        streams: Streams,
        auvs: int,
        asvs: int,
        record: Recorder,
        slow: Rows | None = None,
        range_rates: RangeRates | None = None,
    ) -> None:
        """Measure pings between so many AUVs and ASVs, and write fixes to a record.

        `slow` as of :func:`..usbl.slow_errors.slow_numbers`; `range_rates` None: none are measured.
        """
        self.range_rates = range_rates
        self._record, self._errors, outliers = record, None, 0
        #: Systematic errors; None without any.
        self.systematic: Systematic | None = None
        if isinstance(instrument, UsblWithErrors):
            (instrument, systematic), outliers = instrument, OUTLIER_WIDTH
            self.systematic = systematic._replace(levels=systematic.levels[0])
            jacobians = record.jacobians
            self._errors = Packed(PackedErrors(*systematic, jacobians.of, jacobians.left))
            jacobians.hand_on(self._errors)
        further = outliers
        self.own, self.instrument = None, NO_INSTRUMENT
        if isinstance(instrument, OwnInstrument):
            self.own = instrument
        else:
            self.instrument = packed(instrument)
            further += max(self.instrument.array.shape[1] - ELEMENTS, 0)
        self.noise = NoiseStore(streams, auvs, asvs, NOISE_WIDTH + 1, further)
        self.draw = cache(partial(streams.of, Purpose.INSTRUMENT))
        self.slow = np.zeros((auvs, asvs, 0), SLOW) if slow is None else slow
        #: The address of the packed systematic errors; None without any: their code is left out.
        self.errors = None if self._errors is None else self._errors.address

    def make_room(self, fixes: int) -> None:
        """Reserve rows for so many further fixes, and for their Jacobians."""
        room = self._record.fixes.room_for(fixes)
        if self._errors is not None:
            self._record.jacobians.make_room(len(room))

    def hand_on(self, to: Packed, bursts: Rows | None) -> None:
        """Renew the field `noise` of a packed tuple whenever the noise store grows."""
        slow = self.slow  # the store refers to nothing that refers to it: no reference cycle
        self.noise.on_grown = lambda store: to.renew("noise", noise_of(store, slow, bursts))

    def noise_with(self, bursts: Rows | None) -> PairNoise:
        """Return the noise for compiled code; `bursts` None: pings are not lost in bursts."""
        return noise_of(self.noise, self.slow, bursts)


def noise_of(store: NoiseStore, slow: Rows, bursts: Rows | None) -> PairNoise:
    """Return a noise store, slow errors and bursts as compiled code takes them."""
    lost_in = np.empty((0, 0), PAIR) if bursts is None else bursts
    taken_now = np.zeros((store.shelf.shape[1], store.blocks.shape[2]))
    return PairNoise(store.shelf, store.taken, store.blocks, taken_now, slow, lost_in)


class Sight(NamedTuple):
    """What one ASV alone has measured of a ping, in the survey frame.

    `place` (3,), m, is the measured position of the AUV, `covariance` (3, 3), m2; `own` (m) and
    `yaw` (rad) are the ASV's position and heading by its own instruments as it heard the ping.
    """

    place: Floats
    covariance: Floats
    own: tuple[float, float, float]
    yaw: float


# GNSS error of an ASV as it pings, in standard deviations: x, y, z
GNSS_DRAW = np.dtype(("f8", (3,)))


class Outcomes:
    """Outcomes of the pings of AUVs.

    A ping's outcome at each ASV, and its fix, are decided when it has passed all ASVs or later: by
    then all sound that could overlap it is on record.
    """

    def __init__(
        self,
        band: HfBand,
        measuring: Measuring,
        strayed: Floats,
        record: Recorder,
    ) -> None:
        """Decide pings and measure them; `strayed` (n,), m2, as of :class:`.reception.Decided`."""
        self.band, self.receiver, self._listeners = band.band, band.receiver, band.listeners
        self._band, self._record = band, record
        self._measuring, self._strayed = measuring, strayed
        self._decided_by = self._packed(record)
        self._room = 1  # length of `due`, for the numbers of pings
        self._undecided = 0  # pings before this one are decided

    def _packed(self, record: Recorder) -> Packed:
        """Return the packed :class:`.reception.Decided`."""
        measuring, band = self._measuring, self._band
        packed = Packed(
            Decided(
                record.pings.array,
                record.receptions.array,
                band.sounds.array,
                record.fixes.array,
                np.empty(1, dtype=np.int64),
                measuring.noise_with(band.bursts),
                self._listeners.motion,
                measuring.instrument,
                self._strayed,
                self.band.duration,
                band.first_listener,
                self.receiver.capture,
                self.receiver.shadowing_sd_db,
            )
        )
        record.pings.hand_on(packed, "pings")
        record.receptions.hand_on(packed, "receptions")
        band.sounds.hand_on(packed, "sounds")
        record.fixes.hand_on(packed, "fixes")
        measuring.hand_on(packed, band.bursts)
        return packed

    @property
    def _echoes(self) -> Rows | None:
        """Echoes of pings; None where the channel has none."""
        return None if self._band.echoes is None else self._band.echoes.rows

    def resolve_passed(self, time: float) -> range:
        """Decide pings that have passed all listeners by an instant (s); return new fixes."""
        fixes = self._record.fixes
        first = fixes.count
        self.update_arrivals(time)
        while True:
            self._undecided, _, dry = self._decide_and_measure(time, self._undecided)
            if dry == NONE:
                return range(first, fixes.count)
            self._refill_noise()  # of all pairs at once: deciding begins anew each time

    def _decide_and_measure(self, time: float, ping: int, only: int = NONE) -> tuple[int, int, int]:
        """Decide pings from `ping` on that have passed by an instant (s), or the reception `only`.

        Return the first undecided ping, and the AUV and ASV whose noise is used up, or NONE.
        """
        pings, receptions, fixes = self._record.pings, self._record.receptions, self._record.fixes
        count, measuring = fixes.count, self._measuring
        most = pings.count - self._undecided + 1
        measuring.make_room(most * self._fixes_of_ping)
        if most > self._room:
            self._room = 2 * most
            self._decided_by.renew("due", np.empty(self._room, dtype=np.int64))
        fixes.count, undecided, auv, asv = resolve(
            self._decided_by.address, time, ping, only, pings.count, receptions.count,
            self._band.sounds.count, count, measuring.errors, self._echoes,
            self._gnss_noise(),
        )  # fmt: skip
        if measuring.range_rates is not None:
            self._note_rates(measuring.range_rates, ping, only)
        if measuring.own is not None:
            for fix in fixes.array[count : fixes.count]:
                self._measure(measuring.own, fix)
        return undecided, auv, asv

    def _note_rates(self, rates: RangeRates, ping: int, only: int) -> None:
        """Measure the range rates of all pings from `ping` on, or of the reception `only`."""
        pings, receptions = self._record.pings.rows, self._record.receptions.rows
        if only != NONE:
            rates.note(self._band.sounds, pings, receptions[only : only + 1])
        elif ping < len(pings):
            rates.note(self._band.sounds, pings, receptions[pings["first"][ping] :])

    #: Most fixes that are made of one ping.
    _fixes_of_ping = 1

    def _gnss_noise(self) -> Floats | None:
        """Return the GNSS error of the ASV at each ping (pings, 3), in standard deviations; None
        where AUVs ping.
        """
        return None

    def _measure(self, instrument: OwnInstrument, fix: Row) -> None:
        """Let a user-defined instrument measure a ping; write the fix."""
        ping, draw = self._record.pings.array[fix["ping"]], self._measuring.draw(int(fix["auv"]))
        met = self._record.receptions.array[fix["first"] : fix["end"]]
        heard = met[met["outcome"] == HEARD]
        poses = [
            self._listeners.vehicles[reception["listener"]].at(float(reception["arrived_at_s"]))
            for reception in heard
        ]
        note(fix, ping, *instrument.fused(sounding_of(ping, heard, np.array(poses), draw)))

    def _refill_noise(self) -> None:
        """Draw noise for every pair that has a ping in flight and no noise left."""
        rows = self._record.receptions.rows[self._record.pings.array[self._undecided]["first"] :]
        under_way = rows["outcome"] == IN_FLIGHT
        self._measuring.noise.refill_spent(rows["auv"][under_way], rows["asv"][under_way])

    def decide_one(self, ping: int, row: int) -> bool:
        """Decide one reception of a ping that has passed its ASV; return whether it made a fix."""
        count = self._record.fixes.count
        _, auv, asv = self._decide_and_measure(0.0, ping, row)
        while asv != NONE:
            self._measuring.noise.refill(auv, asv)
            _, auv, asv = self._decide_and_measure(0.0, ping, row)
        return self._record.fixes.count > count

    def update_arrivals(self, time: float) -> None:
        """Correct the arrivals by an instant (s) at listeners whose motion was not known ahead."""
        self._band.update_arrivals(time)

    def when_over(
        self, env: simpy.Environment, pings: range, verb: Callable[[int, float], None],
        only: int = NONE,
    ) -> None:  # fmt: skip
        """Call `verb` once each arrival of some pings that may be heard (at the ASV `only`, if not
        NONE) is over: with its row of receptions and the instant (s) at which it began.
        """
        for ping in self._record.pings.array[pings.start : pings.stop]:
            for row in range(ping["first"], ping["end"]):
                reception = self._record.receptions.array[row]
                if reception["outcome"] == IN_FLIGHT and only in (NONE, reception["asv"]):
                    self._wait(env, row, verb)

    def _wait(self, env: simpy.Environment, row: int, verb: Callable[[int, float], None]) -> None:
        """Wait for the end of a reception (a row), and again where its listener was predicted too
        near; then call `verb` as :meth:`when_over` does.
        """
        receptions = self._record.receptions
        expected = float(receptions.array[row]["arrived_at_s"])

        def look(_: simpy.Event) -> None:
            self.update_arrivals(env.now)
            arrived = float(receptions.array[row]["arrived_at_s"])
            if arrived > expected:
                self._wait(env, row, verb)
            else:
                verb(row, arrived)

        moment(env, expected + self.band.duration).callbacks.append(look)

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
        """Return the outcome of a reception (a row) that is over by now, decided or not, and its
        SNR (dB).

        One not yet decided takes the next noise of its pair, behind earlier receptions that are not
        decided either: the noise that will decide it.
        """
        record = self._record
        reception = record.receptions.rows[row]
        if reception["outcome"] != IN_FLIGHT:
            return int(reception["outcome"]), float(reception["snr_db"])
        luck = float(self._noise_at(row)[NOISE_WIDTH])
        if (bursts := self._band.bursts) is not None:
            pair = bursts[reception["auv"], reception["asv"]]
            luck = burst_luck(pair, float(reception["arrived_at_s"]), float(reception["loss"]))
        outcome = foretold(
            self._decided_by.address, row, luck, record.pings.count, record.receptions.count,
            self._band.sounds.count, self._echoes,
        )  # fmt: skip
        return outcome, float(reception["snr_db"]) + self.receiver.shadowing_sd_db * luck

    def _noise_at(self, row: int) -> Floats:
        """Return the noise (columns,) that decides a reception which has just ended."""
        receptions = self._record.receptions.rows
        reception, pending = receptions[row], receptions[row:row]
        if reception["outcome"] == IN_FLIGHT:
            before = receptions[self._first_undecided() : row + 1]
            same = (before["auv"] == reception["auv"]) & (before["asv"] == reception["asv"])
            pending = before[same & (before["outcome"] == IN_FLIGHT)]
        slow = self._measuring.slow[reception["auv"], reception["asv"]]
        noise = self._measuring.noise.peek(
            int(reception["auv"]), int(reception["asv"]), len(pending) - 1
        )
        if slow.size:
            noise, numbers = noise.copy(), slow.copy()
            for time in pending["arrived_at_s"].tolist():
                advance(numbers, time)
            blend(noise, numbers)
        return noise

    @property
    def systematic(self) -> Systematic | None:
        """The systematic errors of measurements; None without any."""
        return self._measuring.systematic

    def sight_of(self, ping: int, asv: int) -> Sight | None:
        """Return what an ASV that has just decoded a ping measures of it, with the noise that the
        fix will have; None with a user-defined instrument, which is asked only once.

        The mission's state does not change.
        """
        measuring = self._measuring
        if measuring.own is not None:
            return None
        sent = self._record.pings.array[ping]
        rows = self._record.receptions.rows[sent["first"] : sent["end"]]
        row = int(sent["first"]) + int(np.flatnonzero(rows["asv"] == asv)[0])
        noise, (_, snr_db) = self._noise_at(row), self.outcome_of(row)
        alone = self._record.receptions.rows[row : row + 1].copy()
        alone["outcome"], alone["snr_db"] = HEARD, snr_db
        instruments, levels = measuring.instrument, measuring.instrument.levels[asv]
        heard = Heard(sent, alone, noise[np.newaxis])
        *vessel, yaw = self._listeners.vehicles[asv].at(float(alone["arrived_at_s"][0]))
        gnss_sd, heading_sd = float(levels["gnss_sd_m"]), levels["attitude_sd_rad"][2]
        own = plus((vessel[0], vessel[1], vessel[2]), scaled(gnss_noise(noise), gnss_sd))
        if measuring.systematic is None:
            place, covariance = measured(heard, self._listeners.motion, instruments, self._strayed)
        else:
            place, covariance, *_ = measured_with_errors(
                heard, self._listeners.motion, instruments, self._strayed, measuring.systematic
            )
            arrived_at = float(alone["arrived_at_s"][0])
            own = plus(own, gnss_error(asv, arrived_at, measuring.systematic))
        heading = math.remainder(yaw + heading_sd * float(noise[HEADING_NOISE]), math.tau)
        return Sight(place, covariance, own, heading)

    def newest_fixes(self, time: float) -> Floats:
        """Return the newest fix of each AUV made by an instant (s), (n, 3): x, y (m), when its ping
        was sent (s); NaN before the first.
        """
        self.resolve_passed(time)
        found, fixes = np.full((len(self._strayed), 3), np.nan), self._record.fixes.rows
        for fix in fixes[np.argsort(fixes["pinged_at_s"], kind="stable")]:
            found[fix["auv"]] = fix["x_m"], fix["y_m"], fix["pinged_at_s"]
        return found

    def close(self, time: float) -> None:
        """Decide the receptions of pings in flight that are over by the end of the mission (s)."""
        self.update_arrivals(time)
        receptions, fixes = self._record.receptions.rows, self._record.fixes
        arrived = receptions["arrived_at_s"] + self.band.duration < time
        count = fixes.count
        for row in np.flatnonzero((receptions["outcome"] == IN_FLIGHT) & arrived).tolist():
            self.decide_one(int(receptions["ping"][row]), row)
        fixes.count = count  # no broadcast would carry these fixes any more


class AnsweredOutcomes(Outcomes):
    """Outcomes of pings that are answered one by one: each reception is decided as it is over, for
    the ASV that answers.  Nothing is left to decide later, and no fix waits.
    """

    def resolve_passed(self, time: float) -> range:
        """Return no new fixes: each was made as its ping was answered."""
        count = self._record.fixes.count
        return range(count, count)


class OwnOutcomes(Outcomes):
    """Outcomes of the pings of ASVs: each reception is decided by itself, and the AUV that hears
    the ping fixes itself, without a broadcast.
    """

    def __init__(
        self, band: HfBand, measuring: Measuring, streams: Streams, record: Recorder
    ) -> None:
        """Decide pings, which answer no calls."""
        super().__init__(band, measuring, np.zeros(len(band.listeners)), record)
        self._fixes_of_ping = len(band.listeners)
        self._gnss = cache(partial(streams.of, Purpose.BEACON))
        self._drawn = EventBuffer(GNSS_DRAW)  # GNSS errors, a row for each ping

    def _decide_and_measure(self, time: float, ping: int, only: int = NONE) -> tuple[int, int, int]:
        fixes, count = self._record.fixes, self._record.fixes.count
        found = super()._decide_and_measure(time, ping, only)
        for number in fixes.array["round"][count : fixes.count].tolist():
            self._record.rounds[number].fixes += 1
        return found

    def _gnss_noise(self) -> Floats:
        noise, pings = self._drawn, self._record.pings
        for ping in pings.array[noise.count : pings.count]:
            noise.room_for(1)[noise.count] = self._gnss(int(ping["asv"])).standard_normal(3)
            noise.count += 1
        return noise.rows.view(np.float64)

    def _measure(self, instrument: OwnInstrument, fix: Row) -> None:
        ping, draw = self._record.pings.array[fix["ping"]], self._measuring.draw(int(fix["auv"]))
        heard = self._record.receptions.array[fix["first"]]
        pose = self._listeners.vehicles[heard["listener"]].at(float(heard["arrived_at_s"]))
        place, covariance = mirrored(instrument, ping, heard, pose, draw)
        note(fix, ping, place, covariance)
        fix["error_m"] = math.hypot(place[0] - pose.x, place[1] - pose.y)

    def outcome_of(self, row: int) -> tuple[int, float]:
        over = float(self._record.receptions.array[row]["arrived_at_s"]) + self.band.duration
        self.resolve_passed(over)
        return super().outcome_of(row)

    def newest_fixes(self, time: float) -> Floats:
        return np.full((len(self._strayed), 3), np.nan)

    def sight_of(self, ping: int, asv: int) -> None:
        return None
