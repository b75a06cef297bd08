"""The rangings: those of :mod:`..core.protocol.ranging` by what they declare alone; a further one
is a function of a :class:`..core.protocol.ranging.Slot`, as a user's own.
"""

from ..core.scenario.families import RangingTraits
from ..core.scenario.key_types import Real, key
from ..core.scenario.part_choice import Settings


class TwoWaySettings(Settings):
    """Settings of the ranging `twtt`."""

    turnaround_s: Real = key(0.0, "s", "turnaround time of AUVs", ge=0, le=60)


# Synchronised clocks: AUVs ping on time
owtt_sync = RangingTraits(own_clocks=True)
# AUVs answer calls, and the round trip is measured
twtt = RangingTraits(settings=TwoWaySettings, calls=True)
# ASVs ping in turn, and AUVs fix themselves
passive = RangingTraits(asvs_ping=True)
