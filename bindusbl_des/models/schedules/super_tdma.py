"""Super-TDMA: transmit times allow for travel times, so that arrivals are packed at the ASVs.

A ping departs so that it arrives as the one before it ends, t_i = a_i - D_i, rather than after the
longest travel time: the schedule of bound B1, 1 / (T_P + T_clear) pings per second and ASV.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.scenario.families import ScheduleSettings, ScheduleTraits
from ...core.scenario.key_types import Real, key

if TYPE_CHECKING:
    from ...core.protocol.view import Groups, View


class SuperTdma(ScheduleSettings):
    """Settings of the schedule `super_tdma`."""

    clear_s: Real = key(0.02, "s", "pause between two arrivals at an ASV", ge=0, le=60)
    sds: Real = key(
        2.0,
        "1",
        "assumed largest error of AUV positions, in standard deviations of fixes",
        ge=0,
        le=100,
    )

    @property
    def pause_s(self) -> float:
        """The pause (s) between two arrivals."""
        return self.clear_s


@ScheduleTraits(
    settings=SuperTdma,
    groups="first_fit",
    renumbers=True,
    approximation="is taken for spatial_reuse with slots of T_P + clear_s.",
    pace="packed",
    turn_by="arrivals",
)
def super_tdma(view: View, *, settings: SuperTdma) -> Groups:
    """Let every AUV ping at an instant of its own, so that arrivals follow each other closely.

    Where one ASV may hear two AUVs, their arrivals are predicted to be `clear_s` (s) apart, and
    more by the position errors of both: so many `sds` of fixes, the distance travelled since, and
    the vehicles' motion meanwhile.  AUVs ping as early as that allows, those heard farthest away
    first.
    """
    import numpy as np

    from ...core.protocol.view import TimedGroups
    from .departures import departures

    slots = view.slots
    if slots is None:
        raise LookupError("super_tdma plans with the protocol's slots; this view has none")
    lasts, speed = slots.ping_duration + settings.clear_s + slots.answer, slots.sound_speed
    longest, rates = slots.longest_travel_time, view.range_rates_m_per_s / speed
    misplaced = view.misplaced_m(settings.sds) + view.range_rates_m_per_s * view.ahead_s
    ways = np.linalg.norm(view.auvs[:, None] - view.asvs[None], axis=2) / speed
    ways, blurs = np.minimum(ways, longest), np.minimum(misplaced / speed, longest)
    horizon = len(rates) * lasts + longest  # about as long as the round pings
    while True:
        heard = view.may_hear(misplaced + view.range_rates_m_per_s * horizon)
        departs = departures(ways, heard, blurs, rates, lasts, slots.clock.rate)
        last = float(departs.max())
        if last <= horizon:
            break
        horizon = 1.1 * last
    farthest = np.where(heard, ways, 0.0).max(axis=1) + blurs
    comes = np.where(heard.any(axis=1), farthest, longest)
    ends = float((departs * (1.0 + rates) + comes).max()) + lasts
    instants, slot_of = np.unique(departs, return_inverse=True)
    groups = [np.flatnonzero(slot_of == slot).tolist() for slot in range(len(instants))]
    return TimedGroups(groups, np.diff([*instants, ends]).tolist())
