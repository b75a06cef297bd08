"""How the surface fleet turns the receptions of one ping into one fix."""

import math
from collections.abc import Sequence

import numpy as np

from .events import Fix, Reception
from .fleet import Asv
from .fusion import fuse
from .recorder import Recorder
from .uplink import Flight, Row
from .usbl import NOISE_WIDTH, Usbl


class UsblFleet:
    """The USBL arrays of all ASVs, their measurements fused ping by ping."""

    def __init__(self, usbl: Usbl, asvs: Sequence[Asv], record: Recorder) -> None:
        self._usbl, self._asvs, self._record = usbl, asvs, record

    def fix(self, flight: Flight, heard: Sequence[tuple[Reception, Row]]) -> Fix:
        """Fuse what was heard of one ping into a fix of the instant at which it was sent."""
        ping = flight.ping
        heard = sorted(heard, key=lambda item: item[0].asv)
        measured = [self._measure(flight, arrival, noise) for arrival, noise in heard]
        position, covariance = fuse([m[0] for m in measured], [m[1] for m in measured])
        x, y, z = position.tolist()
        sd_x, sd_y, sd_z = np.sqrt(np.maximum(covariance.diagonal(), 0.0)).tolist()
        fix = Fix(
            fix=len(self._record.fixes),
            ping=ping.ping,
            round=ping.round,
            auv=ping.auv,
            asvs=" ".join(self._asvs[arrival.asv].name for arrival, _ in heard),
            pinged_at_s=ping.sent_at_s,
            x_m=x,
            y_m=y,
            z_m=z,
            sd_x_m=sd_x,
            sd_y_m=sd_y,
            sd_z_m=sd_z,
            cov_xy_m2=float(covariance[0, 1]),
            cov_xz_m2=float(covariance[0, 2]),
            cov_yz_m2=float(covariance[1, 2]),
            error_m=math.hypot(x - ping.x_m, y - ping.y_m),
        )
        self._record.fixes.append(fix)
        return fix

    def _measure(self, flight: Flight, arrival: Reception, noise: Row) -> tuple[Row, Row]:
        vessel = self._asvs[arrival.asv].vehicle.at(arrival.arrived_at_s)
        travelled = arrival.travel_time_s
        if flight.interrogation is not None and flight.interrogation[0] == arrival.asv:
            travelled = (flight.interrogation[1] + travelled) / 2  # eq. rtt, turnaround removed
        source = np.array(flight.source[:3])
        return self._usbl.locate(
            source, np.array(vessel[:3]), vessel.yaw, travelled, noise[:NOISE_WIDTH]
        )
