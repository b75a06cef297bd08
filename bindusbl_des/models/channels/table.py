"""The channel `table`: sound takes bent rays; its equations are :mod:`.table_channel`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.acoustics.sound_settings import PingTable, Table
from ...core.scenario.families import ChannelTraits

if TYPE_CHECKING:
    from ...core.acoustics.asking import Asking
    from ...core.acoustics.channel import AskedChannel


@ChannelTraits(settings=PingTable, frame_settings=Table, has_levels=True, traces_rays=True)
def table(asking: Asking, *, settings: Table) -> AskedChannel:
    """Return the channel of a table of rays, given or traced."""
    from .table_channel import table_channel  # brings pyarrow

    return table_channel(asking.site, asking.as_sold(settings), asking.message, asking.range_m)
