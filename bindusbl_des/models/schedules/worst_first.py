"""A schedule with few slots for the AUVs with the worst estimates: short rounds in which not all
ping.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.scenario.families import ScheduleSettings, ScheduleTraits
from ...core.scenario.key_types import Whole, key

if TYPE_CHECKING:
    from ...core.protocol.view import Groups, View


class WorstFirst(ScheduleSettings):
    """Settings of the schedule `worst_first`."""

    # 4 slots of at least 2.5 t_C are as long as the shortest downlink slot of a round, 10 t_C
    slots: Whole = key(
        4, "1", "ping groups of a round, at most; further AUVs wait for a later one", ge=1, le=9_999
    )

    @property
    def most_groups(self) -> int | None:
        """The largest number of ping groups in a round."""
        return self.slots


@ScheduleTraits(
    settings=WorstFirst,
    groups="first_fit",
    is_proved=True,
    renumbers=True,
    chooses=True,
    approximation="is taken for spatial_reuse: each AUV has a turn in every round.",
    turn_by="expected_error",
)
def worst_first(view: View, *, settings: WorstFirst) -> Groups:
    """Let the AUVs with the worst estimates ping, in a limited number of slots.

    In the order of their claims, each AUV joins the first group in which no ASV would hear it and
    another; AUVs that fit into none wait for a later round.  An AUV's claim is its expected error
    times the chance that a turn brings a fix: after k turns in vain, 1 / (k + 2) (Laplace's rule of
    succession).  So an AUV that is not at its believed position cannot delay the others for long,
    and one that drifts has its turn again after a number of rounds that is bounded by its turns in
    vain.  An AUV that no ASV is believed to hear pings in the first slot, where it disturbs no
    other.  Where frames announce a round, an AUV that may come within range until it begins counts
    as heard.
    """
    import numpy as np

    heard = view.heard
    if view.ahead_s > 0.0:
        heard = view.may_hear(view.range_rates_m_per_s * view.ahead_s)
    claims = view.expected_error_m / (view.turns_in_vain + 2.0)
    groups: list[list[int]] = [[] for _ in range(settings.slots)]
    met = np.zeros(
        (settings.slots, heard.shape[1]), dtype=np.bool_
    )  # ASVs that hear one of a group
    for auv in np.argsort(-claims, kind="stable").tolist():
        room = np.flatnonzero(~(met & heard[auv]).any(axis=1))
        if len(room):
            groups[room[0]].append(auv)
            met[room[0]] |= heard[auv]
    return [group for group in groups if group]
