"""The HF band with passive ranging: pings of ASVs, and where and when they arrive at AUVs."""

from collections.abc import Callable
from functools import cache, partial
from heapq import heappop, heappush
from math import hypot

import numpy as np

from ...acoustics.channel import AskedChannel, Prospects, between, deciding
from ...acoustics.loss import LossTerms
from ...acoustics.propagation import TOUCH, SignalBand
from ...acoustics.travel_time import travel_time
from ...core.packed import Packed
from ...core.streams import Purpose, Streams
from ...records.events import FAILED_MEANWHILE, IN_FLIGHT, LOST
from ...records.rows import NONE, EventBuffer, Recorder, Row, Rows
from ...usbl.instrument import note
from ...usbl.own_instrument import OwnInstrument, mirrored
from ...usbl.systematic_fixes import Systematic
from ...vehicles.fleet import VehicleFleet
from ...vehicles.motion import places
from ..hf.outcomes import Measuring
from ..hf.uplink import spread_in
from .reception import PassiveDecided, arrive, radiate, resolve

# How far off an ASV believes to be as it pings, in standard deviations: x, y, z
GNSS_NOISE = np.dtype(("f8", (3,)))


class Beacons:
    """ASVs ping: sound spreads at a finite speed; where it arrives is on record as it is sent.

    What becomes of it there is decided later (:class:`PassiveOutcomes`).
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
    ) -> None:
        """Put a band together; channel and bursts as of :class:`..hf.uplink.Uplink`."""
        self.band = band
        self._auvs, self._asvs, self._record = auvs, asvs, record
        self._channel, self.receiver, self._way = deciding(channel, band)
        self._gnss = cache(partial(streams.of, Purpose.BEACON))
        self.bursts = bursts
        #: :data:`GNSS_NOISE`, ping by ping.
        self.gnss_noise = EventBuffer(GNSS_NOISE)
        self._spread_in = spread_in(record, self._way, auvs, asvs)
        self._prospects: dict[int, Prospects] = {}  # of pings, where the channel was asked
        self._nearly_there: list[tuple[float, int]] = []  # instants (s) and receptions, a heap
        #: Whom to tell of pings that have just been sent; nobody unless somebody waits for them.
        self.on_sent: Callable[[range], None] | None = None

    def send(self, round_number: int, slot: int, asv: int, time: float) -> range:
        """Let an ASV ping now, at `time` (s); return its receptions."""
        pings, receptions, noise = self._record.pings, self._record.receptions, self.gnss_noise
        ping, first = pings.count, receptions.count
        self._auvs.advance(time)
        self._asvs.advance(time)
        self._ask(ping, time)
        noise.room_for(1)[ping] = self._gnss(asv).standard_normal(3)
        pings.room_for(1)
        receptions.room_for(len(self._auvs))
        receptions.count = radiate(
            self._spread_in.address, asv, round_number, slot, time, self._auvs.foreseen, ping,
            first,
        )  # fmt: skip
        pings.count = noise.count = ping + 1
        if self._asvs.works_for(asv, time, self.band.duration) < self.band.duration:  # it is cut
            cut = receptions.array[first : receptions.count]
            is_cut = cut["outcome"] == IN_FLIGHT
            cut["outcome"][is_cut], cut["why"][is_cut] = LOST, FAILED_MEANWHILE
        rows = range(first, receptions.count)
        if not self._auvs.foreseen:
            for row in rows:
                instant = float(receptions.array[row]["arrived_at_s"])
                heappush(self._nearly_there, (instant, row))
        if self.on_sent is not None:
            self.on_sent(range(ping, ping + 1))
        return rows

    def _ask(self, ping: int, time: float) -> None:
        """Ask what becomes of the signals of a ping, but for the disc, which is compiled."""
        if self._channel is None:
            return
        auvs, asvs = (places(fleet.motion, time)[:, :3] for fleet in (self._auvs, self._asvs))
        reach = self.band.reach
        prospects = self._channel.prospects(between(time, auvs, asvs, reach, calling=True))
        self._foretell(prospects)
        if not self._auvs.foreseen:
            self._prospects[ping] = prospects

    def _foretell(self, prospects: Prospects) -> None:
        """Have compiled code know what becomes of signals."""
        self._spread_in.renew("way", self._way._replace(prospects=prospects))

    def update_arrivals(self, time: float) -> None:
        """Work out the arrivals that are nearly there by an instant (s), at AUVs that have no sure
        future: they steer by their fixes, or an outside program moves them.
        """
        pings, receptions = self._record.pings, self._record.receptions
        while self._nearly_there and self._nearly_there[0][0] <= time + TOUCH:
            row = heappop(self._nearly_there)[1]
            reception = receptions.array[row]
            ping = pings.array[reception["ping"]]
            place = ping["x_m"], ping["y_m"], ping["z_m"]
            auv, sent_at, bent = int(reception["auv"]), float(ping["sent_at_s"]), 0.0
            if self._channel is not None:
                prospects = self._prospects[int(reception["ping"])]
                self._foretell(prospects)
                bent = float(prospects["late_s"][auv, reception["asv"]])
            at, speed = self._auvs.vehicles[auv].at, self.band.sound_speed
            straight = travel_time(place, at, sent_at + bent, speed)
            arrive(self._spread_in.address, row, straight, bent)


class PassiveOutcomes:
    """What becomes of the pings of ASVs: overlapping arrivals destroy each other.

    A reception is decided (what becomes of it, and the fix that its AUV makes of it) not before it
    has ended, when all sound that could overlap it is on record; it does not matter how long after.
    """

    def __init__(
        self, beacons: Beacons, auvs: VehicleFleet, measuring: Measuring, record: Recorder
    ) -> None:
        """Decide pings at AUVs, and have them measured."""
        self.band, self.receiver = beacons.band, beacons.receiver
        self._beacons, self._auvs, self._record = beacons, auvs, record
        self._measuring = measuring
        self._decided_by = self._packed()
        self._undecided = 0  # receptions before this one are decided

    def _packed(self) -> Packed:
        """Return what receptions are decided by, :class:`.reception.PassiveDecided`."""
        record, measuring, gnss_noise = self._record, self._measuring, self._beacons.gnss_noise
        packed = Packed(
            PassiveDecided(
                record.pings.array,
                record.receptions.array,
                record.fixes.array,
                gnss_noise.array.view(np.float64),
                measuring.noise_with(self._beacons.bursts),
                self._auvs.motion,
                measuring.instrument,
                self.band.duration,
                self.receiver.capture,
                self.receiver.shadowing_sd_db,
            )
        )
        record.pings.hand_on(packed, "pings")
        record.receptions.hand_on(packed, "receptions")
        record.fixes.hand_on(packed, "fixes")
        gnss_noise.hand_on(packed, "gnss_noise")
        measuring.hand_on(packed, self._beacons.bursts)
        return packed

    def resolve(self, time: float) -> None:
        """Decide all receptions that have ended by an instant (s), and what AUVs make of them."""
        self.update_arrivals(time)
        fixes, made = self._record.fixes, self._record.fixes.count
        if self._undecided < self._record.receptions.count:
            self._auvs.advance(time)
            while (dry := self._resolve(time)) != NONE:
                self._refill(dry)
        rows = fixes.array[made : fixes.count]
        for number, count in zip(*np.unique(rows["round"], return_counts=True), strict=True):
            self._record.rounds[number].fixes += int(count)
        if self._measuring.own is not None:
            for fix in rows:
                self._measure(self._measuring.own, fix)

    def _resolve(self, time: float) -> int:
        """Decide what has ended; return a reception whose pair has no noise left, or NONE."""
        pings, receptions, fixes = self._record.pings, self._record.receptions, self._record.fixes
        self._measuring.make_room(receptions.count - self._undecided)
        fixes.count, self._undecided, dry = resolve(
            self._decided_by.address, time, self._undecided, pings.count, receptions.count,
            fixes.count, self._measuring.errors,
        )  # fmt: skip
        return dry

    def _refill(self, row: int) -> None:
        """Draw noise for all that hear the ping of a reception: settling begins anew each time."""
        receptions = self._record.receptions.array
        ping = self._record.pings.array[receptions[row]["ping"]]
        heard = receptions[max(ping["first"], self._undecided) : ping["end"]]
        heard = heard[heard["outcome"] == IN_FLIGHT]
        self._measuring.noise.refill_spent(heard["auv"], heard["asv"])

    def _measure(self, instrument: OwnInstrument, fix: Row) -> None:
        """Have a ping measured by an instrument of somebody's own."""
        reception = self._record.receptions.array[fix["first"]]
        ping, auv = self._record.pings.array[reception["ping"]], int(reception["auv"])
        pose = self._auvs.vehicles[auv].at(float(reception["arrived_at_s"]))
        estimate, covariance = mirrored(
            instrument, ping, reception, pose, self._measuring.draw(auv)
        )
        note(fix, ping, estimate, covariance)
        fix["error_m"] = hypot(estimate[0] - pose.x, estimate[1] - pose.y)

    def update_arrivals(self, time: float) -> None:
        """Work out the arrivals that are nearly there by an instant (s)."""
        self._beacons.update_arrivals(time)

    @property
    def systematic(self) -> Systematic | None:
        """What is wrong all the time, if anything."""
        return self._measuring.systematic

    def outcome_of(self, row: int) -> tuple[int, float]:
        """Return what has become of a ping at an AUV where it has just ended, and its SNR (dB)."""
        reception = self._record.receptions.array[row]
        self.resolve(float(reception["arrived_at_s"]) + self.band.duration)
        reception = self._record.receptions.array[row]
        return int(reception["outcome"]), float(reception["snr_db"])

    def first_under_way(self, time: float) -> int:
        """Return the first reception that may not be over by an instant (s), the latest known."""
        return self._undecided
