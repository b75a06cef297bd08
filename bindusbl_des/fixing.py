"""How the surface fleet turns the receptions of pings into fixes."""

from collections.abc import Sequence
from math import hypot, sqrt

import numpy as np

from .compiled import compiled
from .events import Fix
from .fleet import Fleet
from .fusion import fuse_pair
from .motion import Floats, Ints, Motion, where
from .propagation import ARRIVED_AT, AT_ASV, OF_PING, PING_X, PING_Z
from .recorder import Recorder
from .uplink import Flight, Heard
from .usbl import NOISE_WIDTH, Usbl, locate

ESTIMATE = 10


@compiled
def fix_pings(
    rows: Ints, last: Ints, travelled: Floats, noise: Floats, pings: Floats, receptions: Floats,
    asv_table: Floats, asv_first: Ints, asv_step: float, array: Floats, metric: Floats,
    levels: Floats,
) -> Floats:  # fmt: skip
    """Measure and fuse pings; return a line (ESTIMATE,) for each.

    `rows` are receptions, `travelled` (n,) the travel time (s) and `noise` (n, NOISE_WIDTH or more)
    that belong to each; `last` tells where in `rows` each ping ends.  A line is position and its
    standard deviations (m), covariances xy, xz and yz (m2) and the horizontal error (m).
    """
    asvs, out = Motion(asv_table, asv_first, asv_step), np.empty((last.size, ESTIMATE))
    begin = 0
    for k in range(last.size):
        source = pings[int(receptions[rows[begin], OF_PING]), PING_X : PING_Z + 1]
        fix, covariance = np.zeros(3), np.zeros((3, 3))
        for item in range(begin, last[k]):
            reception = receptions[rows[item]]
            x, y, z, yaw = where(asvs, int(reception[AT_ASV]), reception[ARRIVED_AT])
            vessel = np.array((x, y, z))
            measured, spread = locate(
                source, vessel, yaw, travelled[item], noise[item, :NOISE_WIDTH], array, metric,
                levels,
            )  # fmt: skip
            if item == begin:
                fix, covariance = measured, spread
            else:
                fix, covariance = fuse_pair(fix, covariance, measured, spread)
        line = out[k]
        line[:3] = fix
        for axis in range(3):
            line[3 + axis] = sqrt(max(covariance[axis, axis], 0.0))
        line[6], line[7], line[8] = covariance[0, 1], covariance[0, 2], covariance[1, 2]
        line[9] = hypot(fix[0] - source[0], fix[1] - source[1])
        begin = last[k]
    return out


class UsblFleet:
    """The USBL arrays of all ASVs, their measurements fused ping by ping."""

    def __init__(self, usbl: Usbl, asvs: Fleet, record: Recorder) -> None:
        self._usbl, self._asvs, self._record = usbl, asvs, record

    def fix(self, flights: Sequence[Flight]) -> list[Fix]:
        """Fuse what was heard of each ping into a fix of the instant at which it was sent."""
        if not flights:
            return []
        heard: list[Heard] = []
        last = []
        for flight in flights:
            flight.heard.sort()
            heard += flight.heard
            last.append(len(heard))
        _, rows, travelled, noises = zip(*heard, strict=True)
        estimates = fix_pings(
            np.array(rows), np.array(last), np.array(travelled), np.array(noises),
            self._record.pings.array, self._record.receptions.array, *self._asvs.motion,
            self._usbl.array, self._usbl.metric, self._usbl.levels,
        )  # fmt: skip
        return [
            self._recorded(flight, *estimate)
            for flight, estimate in zip(flights, estimates.tolist(), strict=True)
        ]

    def _recorded(
        self, flight: Flight, x: float, y: float, z: float, sd_x: float, sd_y: float, sd_z: float,
        xy: float, xz: float, yz: float, error: float,
    ) -> Fix:  # fmt: skip
        asvs = " ".join([f"ASV{heard[0]}" for heard in flight.heard])
        fix = Fix(
            len(self._record.fixes), flight.ping, flight.round, flight.auv, asvs, flight.sent_at,
            x, y, z, sd_x, sd_y, sd_z, xy, xz, yz, error,
        )  # fmt: skip
        self._record.fixes.append(fix)
        return fix
