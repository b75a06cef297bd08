"""What compiled code of the HF band is handed: at each call, and once for all of them."""

from functools import lru_cache

import numpy as np

from ...acoustics.channel import Receiver
from ...acoustics.propagation import Spread, Way
from ...core.handed import Handed
from ...records.recorder import EventBuffer, Recorder
from ...records.rows import CALLED, NONE
from ...vehicles.fleet import Fleet
from ...vehicles.motion import Ints
from .measuring import Measuring, noise_of
from .reception import Decided

# What a ping has that nobody called
NO_CALL = np.array([(np.nan, NONE, NONE, np.nan)], dtype=CALLED)


@lru_cache(maxsize=4096)
def members(group: tuple[int, ...]) -> Ints:
    """Return a ping group as an array; small fleets have the same groups again and again."""
    return np.array(group, dtype=np.int64)


def spread_in(record: Recorder, way: Way, auvs: Fleet, asvs: Fleet) -> Handed:
    """Return what pings spread in, :class:`.propagation.Spread`."""
    pings, receptions, fleets = record.pings, record.receptions, (auvs.motion, asvs.motion)
    handed = Handed(Spread(pings.array, receptions.array, way, *fleets, record.everything))
    pings.hand_on(handed, "pings")
    receptions.hand_on(handed, "receptions")
    return handed


def decided_by(
    record: Recorder,
    calls: EventBuffer,
    asvs: Fleet,
    measuring: Measuring,
    duration: float,
    receiver: Receiver,
) -> Handed:
    """Return what pings of a duration (s) are decided by, :class:`.reception.Decided`."""
    handed = Handed(
        Decided(
            record.pings.array,
            record.receptions.array,
            calls.array,
            record.fixes.array,
            np.empty(1, dtype=np.int64),
            noise_of(measuring.noise),
            asvs.motion,
            measuring.instrument,
            duration,
            receiver.capture,
            receiver.shadowing_sd_db,
        )
    )
    record.pings.hand_on(handed, "pings")
    record.receptions.hand_on(handed, "receptions")
    calls.hand_on(handed, "calls")
    record.fixes.hand_on(handed, "fixes")
    measuring.hand_on(handed)
    return handed
