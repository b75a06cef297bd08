"""Each AUV has a turn in every round: in a slot of its own, or shared with AUVs far enough away."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.scenario.families import ScheduleTraits

if TYPE_CHECKING:
    from ...core.protocol.view import Groups, View


@ScheduleTraits(groups="first_fit", is_proved=True, is_proposed=True, advised=2)
def spatial_reuse(view: View) -> Groups:
    """Let AUVs without a common listener ping together, coloured greedily (the paper)."""
    return view.grouped("first_fit")


@ScheduleTraits(groups="saturation", is_proved=True, advised=3)
def dsatur(view: View) -> Groups:
    """Let AUVs without a common listener ping together, coloured by DSATUR."""
    return view.grouped("saturation")


@ScheduleTraits(groups="each", is_proved=True, is_proposed=True, advised=1)
def one_per_slot(view: View) -> Groups:
    """Give every AUV a slot of its own: TDMA without spatial reuse."""
    return view.grouped("each")
