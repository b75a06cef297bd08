"""What becomes of pings at AUVs with passive ranging, and the fixes that they make of them."""

from math import hypot, inf

import numpy as np

from ...core.handed import Handed
from ...records.events import IN_FLIGHT
from ...records.recorder import Recorder
from ...records.rows import NONE, Row
from ...usbl.measurement import note
from ...usbl.own_instrument import OwnInstrument, mirrored
from ...vehicles.fleet import Fleet
from ..hf.measuring import Measuring, noise_of
from .beacons import Beacons
from .reception import Decided, settle


class PassiveOutcomes:
    """What becomes of the pings of ASVs: overlapping arrivals destroy each other.

    A reception is decided (what becomes of it, and the fix that its AUV makes of it) not before it
    has ended, when all sound that could overlap it is on record; it does not matter how long after.
    """

    def __init__(
        self, beacons: Beacons, auvs: Fleet, measuring: Measuring, record: Recorder
    ) -> None:
        """Decide pings at AUVs, and have them measured."""
        self.band, self.receiver = beacons.band, beacons.receiver
        self._beacons, self._auvs, self._record = beacons, auvs, record
        self._measuring = measuring
        self._decided_by = self._handed()
        self._undecided = 0  # receptions before this one are decided

    def _handed(self) -> Handed:
        """Return what receptions are decided by, :class:`.reception.Decided`."""
        record, measuring, gnss_noise = self._record, self._measuring, self._beacons.gnss_noise
        handed = Handed(
            Decided(
                record.pings.array,
                record.receptions.array,
                record.fixes.array,
                gnss_noise.array.view(np.float64),
                noise_of(measuring.noise),
                self._auvs.motion,
                measuring.instrument,
                self.band.duration,
                self.receiver.capture,
                self.receiver.shadowing_sd_db,
            )
        )
        record.pings.hand_on(handed, "pings")
        record.receptions.hand_on(handed, "receptions")
        record.fixes.hand_on(handed, "fixes")
        gnss_noise.hand_on(handed, "gnss_noise")
        measuring.hand_on(handed)
        return handed

    def decide(self, time: float) -> None:
        """Decide all receptions that have ended by an instant (s), and what AUVs make of them."""
        self.amend(time)
        fixes, made = self._record.fixes, self._record.fixes.count
        if self._undecided < self._record.receptions.count:
            self._auvs.advance(time)
            while (dry := self._settle(time)) != NONE:
                self._refill(dry)
        rows = fixes.array[made : fixes.count]
        for number, count in zip(*np.unique(rows["round"], return_counts=True), strict=True):
            self._record.rounds[number].fixes += int(count)
        if self._measuring.own is not None:
            for fix in rows:
                self._measure(self._measuring.own, fix)

    def _settle(self, time: float) -> int:
        """Decide what has ended; return a reception whose pair has no noise left, or NONE."""
        pings, receptions, fixes = self._record.pings, self._record.receptions, self._record.fixes
        self._measuring.make_room(receptions.count - self._undecided)
        fixes.count, self._undecided, dry = settle(
            self._decided_by.address, time, self._undecided, pings.count, receptions.count,
            fixes.count, *self._measuring.made_for,
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
        it = self._record.receptions.array[fix["first"]]
        ping, auv = self._record.pings.array[it["ping"]], int(it["auv"])
        pose = self._auvs.vehicles[auv].at(float(it["arrived_at_s"]))
        estimate, covariance = mirrored(instrument, ping, it, pose, self._measuring.draw(auv))
        note(fix, ping, estimate, covariance)
        fix["error_m"] = hypot(estimate[0] - pose.x, estimate[1] - pose.y)

    def amend(self, time: float) -> None:
        """Work out the arrivals that are nearly there by an instant (s)."""
        self._beacons.amend(time)

    def outcome_of(self, row: int) -> tuple[int, float]:
        """Return what has become of a ping at an AUV where it has just ended, and its SNR (dB)."""
        it = self._record.receptions.array[row]
        self.decide(float(it["arrived_at_s"]) + self.band.duration)
        it = self._record.receptions.array[row]
        return int(it["outcome"]), float(it["snr_db"])

    def first_under_way(self, time: float) -> int:
        """Return the first reception that may not be over by an instant (s), the latest known."""
        return self._undecided

    def close(self, time: float) -> None:
        """Decide what has ended by an instant (s), the mission's last; tell when the rest would."""
        self.decide(time)
        self.amend(inf)
