"""The downlinks: each decides when which fixes travel, written as the timeline of one round.

All return the instant at which the next round may start.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from ..scenario.families import DownlinkTraits
from ..scenario.key_types import key
from ..scenario.part_choice import Settings

if TYPE_CHECKING:
    from .network import Network, Steps, Turn


@DownlinkTraits(
    waits=True,
    is_foreseen=True,
    advised=3,
    in_words="the fixes of a round are broadcast after its last slot; then the next begins.",
)
def sequential(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; then the fixes of the round are broadcast; then the next round starts."""
    from .tdma import broadcast, downlink_free, ping_group

    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    broadcast(network, turn, time)
    return (yield from downlink_free(network, time))


@DownlinkTraits(
    is_foreseen=True,
    advised=1,
    in_words="the fixes of a round are broadcast while the next round pings.",
)
def pipelined_round(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; their fixes are broadcast while the next round pings."""
    from .tdma import broadcast, downlink_free, ping_group

    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    time = yield from downlink_free(network, time)
    broadcast(network, turn, time)
    return time


@DownlinkTraits(
    by_group=True,
    advised=4,
    in_words="the fixes of a ping group are broadcast while the next group pings.",
)
def pipelined_group(network: Network, turn: Turn, time: float) -> Steps:
    """Each group's fixes are broadcast while the next group pings."""
    from .tdma import broadcast, downlink_free, ping_group

    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
        time = yield from downlink_free(network, time)
        broadcast(network, turn, time)
    return time


class DirectReply(Settings):
    """The settings of the downlink `direct_reply`."""

    reply: Literal["frame", "instant"] = key(
        "frame",
        "",
        "what an answer is: an MF frame of header and one fix, or without airtime (instant), as "
        "the paper's baseline has it",
        "sec:baseline",
    )
    reply_at: Literal["ping_front", "ping_end"] = key(
        "ping_end",
        "",
        "when an instant reply sets out: as the ping's front arrives, or once it is decoded",
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
    from .tdma import ping_group

    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    turn.row.downlink_s = 0.0
    return time
