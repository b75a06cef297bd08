"""Schedules with one AUV in each round, a time frame of `protocol.frame_s`: the conventional
baseline.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.scenario.families import ScheduleTraits

if TYPE_CHECKING:
    from ...core.protocol.view import Groups, View


@ScheduleTraits(framed=True, groups="frame", turn="rotation", is_proved=True)
def round_robin(view: View) -> Groups:
    """Give every frame to one AUV, in turn."""
    return [[view.round % len(view.auvs)]]


@ScheduleTraits(framed=True, groups="frame", turn="lot", is_proved=True)
def random(view: View) -> Groups:
    """Give every frame to an AUV drawn at random."""
    return [[int(view.random.integers(len(view.auvs)))]]
