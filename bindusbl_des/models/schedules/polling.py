"""Polling: an ASV calls AUV after AUV, the next as soon as it has decoded an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.scenario.families import ScheduleSettings, ScheduleTraits
from ...core.scenario.key_types import key

if TYPE_CHECKING:
    from ...core.protocol.view import Groups, View


class Polling(ScheduleSettings):
    """Settings of the schedule `polling`."""

    side_by_side: bool = key(
        False, "", "call AUVs at once if no ASV hears two of them, each by its nearest ASV"
    )

    @property
    def shares_calls(self) -> bool:
        """Whether AUVs are called at once if no ASV hears two of them."""
        return self.side_by_side


@ScheduleTraits(
    settings=Polling,
    groups="each",
    approximation="is taken for one_per_slot, AUVs answering from two thirds of the HF range.",
    pace="answered",
    turn_by="calls",
)
def polling(view: View, *, settings: Polling) -> Groups:
    """Call one AUV after another; side by side, AUVs at once if no ASV hears two of them."""
    return view.grouped("first_fit" if settings.side_by_side else "each")
