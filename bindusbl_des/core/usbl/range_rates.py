"""Range rates, measured by the Doppler shift of a ping at its receiver.

The rate is that of both vehicles' velocities along the path: the sender's as it pings, the
receiver's as the ping arrives.  It is scaled by the assumed sound speed.
"""

from math import isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...support.compiled import compiled
from ...support.packed import unpacked
from ...support.streams import Purpose, Streams, normal, pair_keys
from ..acoustics.signals import Sounds
from ..acoustics.sounds import Sea, place_of, rate_of, velocity_of
from ..records.events import HEARD
from ..records.rows import Rows


class Shift(NamedTuple):
    """How range rates are measured: the keys that draw the noise of each pair of an AUV and an ASV
    (AUVs, ASVs), its standard deviation (m/s), the `scale` by the wrong sound speed, and whether
    ASVs ping.
    """

    keys: NDArray[np.uint64]
    sd: float
    scale: float
    asvs_ping: bool


class RangeRates:
    """Measures the range rates of receptions that were heard."""

    def __init__(
        self, sd: float, scale: float, streams: Streams, auvs: int, asvs: int, *, asvs_ping: bool
    ) -> None:
        """Measure with a standard deviation (m/s), and `scale` as of :class:`Shift`; the noise
        depends on a ping's number and its pair of vehicles alone.
        """
        keys = np.array([pair_keys(streams, Purpose.RANGE_RATE, auv, asvs) for auv in range(auvs)])
        self._shift = Shift(keys, sd, scale, asvs_ping)

    def note(self, sounds: Sounds, pings: Rows, receptions: Rows) -> None:
        """Write the range rates of those receptions of `pings` (all on record) that were heard."""
        measure(sounds.sea.address, pings, receptions, *self._shift)


@compiled
def measure(
    packed: int, pings: Rows, receptions: Rows, keys: NDArray[np.uint64], sd: float, scale: float,
    asvs_ping: bool,
) -> None:  # fmt: skip
    """Write range rates to those receptions that were heard and have none, and their ASVs'
    velocities.

    `packed` is the address of a :class:`..acoustics.sounds.Sea`; `pings` are all on record; other
    arguments are the fields of :class:`Shift`.
    """
    sea = unpacked(packed, Sea)
    auvs = sea.auvs.first.size - 1
    for line in receptions:
        if line.outcome != HEARD or not isnan(line.range_rate_m_per_s):
            continue
        auv, asv, sent_at = line.auv, auvs + line.asv, pings[line.ping].sent_at_s
        by_auv, by_asv = sent_at, line.arrived_at_s
        if asvs_ping:
            by_auv, by_asv = by_asv, by_auv
        here, there = place_of(auv, by_auv, sea), place_of(asv, by_asv, sea)
        moves, goes = velocity_of(auv, by_auv, sea), velocity_of(asv, by_asv, sea)
        noise = normal(keys[auv, line.asv], 0, line.ping, 0)
        line.range_rate_m_per_s = scale * rate_of(here, moves, there, goes) + sd * noise
        line.own_x_m_per_s, line.own_y_m_per_s, line.own_z_m_per_s = goes
