"""The downlinks: each decides when which fixes travel, written as the timeline of one round.

All return the instant at which the next round may start.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Literal

from ..scenario.families import DownlinkTraits
from ..scenario.key_types import key
from ..scenario.part_choice import Settings

if TYPE_CHECKING:
    from .network import Network, Steps, Turn


@cache
def _tdma() -> Any:
    """Return the module with the steps of a round, :mod:`.tdma`.

    Commands that only read a scenario do without it, and without numpy; asking once is quicker than
    an import in each round.
    """
    from . import tdma

    return tdma


@DownlinkTraits(
    waits=True,
    is_foreseen=True,
    advised=3,
    in_words="the fixes of a round are broadcast after its last slot; then the next begins.",
)
def sequential(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; then the fixes of the round are broadcast; then the next round starts."""
    tdma = _tdma()
    for slot in range(len(turn.groups)):
        time = yield from tdma.ping_group(network, turn, slot, time)
    tdma.broadcast(network, turn, time)
    ends: float = yield from tdma.downlink_free(network, time)
    return ends


@DownlinkTraits(
    is_foreseen=True,
    advised=1,
    in_words="the fixes of a round are broadcast while the next round pings.",
)
def pipelined_round(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; their fixes are broadcast while the next round pings."""
    tdma = _tdma()
    for slot in range(len(turn.groups)):
        time = yield from tdma.ping_group(network, turn, slot, time)
    time = yield from tdma.downlink_free(network, time)
    tdma.broadcast(network, turn, time)
    return time


@DownlinkTraits(
    by_group=True,
    advised=4,
    in_words="the fixes of a ping group are broadcast while the next group pings.",
)
def pipelined_group(network: Network, turn: Turn, time: float) -> Steps:
    """Each group's fixes are broadcast while the next group pings."""
    tdma = _tdma()
    for slot in range(len(turn.groups)):
        time = yield from tdma.ping_group(network, turn, slot, time)
        time = yield from tdma.downlink_free(network, time)
        tdma.broadcast(network, turn, time)
    return time


class DirectReply(Settings):
    """The settings of the downlink `direct_reply`."""

    reply: Literal["frame", "instant"] = key(
        "frame",
        "",
        "form of a reply: an MF frame of header and one fix, or without airtime (instant), as "
        "in the paper's baseline",
        "sec:baseline",
    )
    reply_at: Literal["ping_front", "ping_end"] = key(
        "ping_end",
        "",
        "when an instant reply is sent: as the ping's front arrives, or once the ping is decoded",
    )

    @property
    def takes_airtime(self) -> bool:
        """Whether an answer is a frame."""
        return self.reply == "frame"


@DownlinkTraits(
    settings=DirectReply, replies=True, advised=2, in_words="a round is its uplink slots."
)
def direct_reply(
    network: Network, turn: Turn, time: float, *, settings: DirectReply | None = None
) -> Steps:
    """All groups ping; the ASV that first hears a ping answers it at once (conventional USBL).

    :class:`.frames.Replies` sends the answers, by the settings.
    """
    tdma = _tdma()
    for slot in range(len(turn.groups)):
        time = yield from tdma.ping_group(network, turn, slot, time)
    turn.row.downlink_s = 0.0
    return time
