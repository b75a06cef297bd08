"""AUVs whose estimates are worst go first, in few slots: short rounds, in which not all ping."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.scenario.families import ScheduleSettings, ScheduleTraits
from ...core.scenario.key_types import Whole, key

if TYPE_CHECKING:
    from ...core.protocol.view import Groups, View


class WorstFirst(ScheduleSettings):
    """The settings of the schedule `worst_first`."""

    # As long as the shortest downlink slot, which every round pays: 10 t_C of at least 2.5 t_C each
    slots: Whole = key(
        4, "1", "ping groups of a round, at most; further AUVs wait for a later one", ge=1, le=9_999
    )

    @property
    def most_groups(self) -> int | None:
        """How many ping groups a round has at most."""
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
    """Let those AUVs ping whose estimates are worst, in at most so many slots.

    In the order of their claims, each AUV joins the first group in which no ASV would hear it and
    another; those that have no room wait for a later round.  An AUV's claim is the error that is
    expected of it times the chance that a turn will mend it: after k turns in vain, 1 / (k + 2)
    (Laplace's rule of succession).  So an AUV that is not where it is believed to be cannot keep
    the others waiting, and one that drifts has its turn again after a number of rounds that is
    bounded by its turns in vain.  An AUV that no ASV is believed to hear pings in the first slot,
    where it disturbs nobody.  Where frames tell of a round first, who may come within range until
    it begins counts as heard.
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
