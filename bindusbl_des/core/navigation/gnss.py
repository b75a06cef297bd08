"""GNSS fixes that AUVs at the surface make themselves, each at its instant; delivered at once."""

from math import nan

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.streams import Purpose, Streams
from ..records.events import DELIVERED
from ..records.rows import FIX, NONE, EventBuffer, Rows
from ..scenario.sections.navigation import GnssFixSection
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import lines

# Instants that are processed at once
AT_ONCE = 20_000


class GnssReceivers:
    """The receivers of a fleet of AUVs.

    Each makes a fix at the instants k `every_s` (s), k = 1, 2, ..., before the mission's `end` (s)
    at which its AUV is no deeper than `depth_m`, with white noise of `sd_m` per axis (m).  Noise is
    drawn for each instant, from a stream of each AUV's own, whether it is at the surface or not.
    """

    def __init__(
        self,
        fleet: VehicleFleet,
        receiver: GnssFixSection,
        end: float,
        streams: Streams,
        fixes: EventBuffer,
    ) -> None:
        """`fixes`, :data:`FIX`, gets their rows, without ping, ASV or frame."""
        self._fleet, self._end, self.fixes = fleet, end, fixes
        self._depth, self._sd, self.every_s = receiver.depth_m, receiver.sd_m, receiver.every_s
        self._noise = [streams.of(Purpose.GNSS_FIX, auv) for auv in range(len(fleet))]
        self._next = 1  # k of the first instant that has not been processed

    def among(self, fixes: Rows, due: Ints, time: float) -> Ints:
        """Make the GNSS fixes up to `time` (s); return their numbers, -1 - k for row k, among the
        rows `due` of other fixes, in the order of delivery.
        """
        before = self.fixes.count
        while self._next * self.every_s <= time and self._next * self.every_s < self._end:
            last = min(int(time / self.every_s) + 1, self._next + AT_ONCE)
            numbers = np.arange(self._next, last + 1, dtype=np.float64)
            instants = numbers * self.every_s
            instants = instants[(instants <= time) & (instants < self._end)]
            begin = self.fixes.count
            for auv in range(len(self._fleet)):
                self._fix(auv, instants)
            # By time, then AUV, however many instants are processed at once
            made = self.fixes.rows[begin:]
            made[:] = made[np.lexsort((made["auv"], made["delivered_at_s"]))]
            made["fix"] = np.arange(begin, self.fixes.count)
            self._next += len(instants)
        own = self.fixes.rows[before:]["delivered_at_s"]
        if not len(own):
            return due
        numbers = np.concatenate((-1 - np.arange(before, self.fixes.count), due))
        order = np.argsort(np.concatenate((own, fixes["delivered_at_s"][due])), kind="stable")
        return np.ascontiguousarray(numbers[order])

    def _fix(self, auv: int, instants: Floats) -> None:
        """Make the fixes of one AUV at instants (n,), s."""
        noise = self._sd * self._noise[auv].standard_normal((len(instants), 2))
        places = lines(*self._fleet.motion, auv, instants)[:, :3]
        up = places[:, 2] <= self._depth
        count = int(up.sum())
        first = self.fixes.count
        rows = self.fixes.room_for(count)[first : first + count]
        for name in FIX.names or ():
            rows[name] = nan if FIX[name] == np.float64 else NONE
        self.fixes.count += count
        rows["fix"], rows["auv"], rows["outcome"] = np.arange(first, first + count), auv, DELIVERED
        for name in ("pinged_at_s", "valid_at_s", "arrives_at_s", "delivered_at_s"):
            rows[name] = instants[up]
        rows["x_m"], rows["y_m"] = (places[up, :2] + noise[up]).T
        rows["z_m"], rows["sd_z_m"], rows["latency_s"] = 0.0, self._depth, 0.0
        rows["sd_x_m"] = rows["sd_y_m"] = self._sd
        for name in ("cov_xy_m2", "cov_xz_m2", "cov_yz_m2"):
            rows[name] = 0.0
        rows["error_m"] = np.hypot(*noise[up].T)
