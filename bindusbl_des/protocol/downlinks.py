"""When which fixes travel: the downlinks, each one round as its timeline reads.

All return the instant at which the next round may start.  A scenario can name one of one's own as
``module:object``.
"""

from ..scenario.families import DOWNLINK
from ..scenario.part_settings import own_part, shipped_part
from .network import Downlink, Network, Steps, Turn
from .own.downlink import OwnDownlink
from .tdma import broadcast, downlink_free, uplink_slot


def sequential(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; then the fixes of the round are broadcast; then the next round starts."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(network, turn, slot, time)
    broadcast(network, turn, time)
    return (yield from downlink_free(network, time))


def pipelined_round(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; their fixes are broadcast while the next round pings."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(network, turn, slot, time)
    time = yield from downlink_free(network, time)
    broadcast(network, turn, time)
    return time


def pipelined_group(network: Network, turn: Turn, time: float) -> Steps:
    """Each group's fixes are broadcast while the next group pings."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(network, turn, slot, time)
        time = yield from downlink_free(network, time)
        broadcast(network, turn, time)
    return time


def direct_reply(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; the ASV that hears a ping first answers it at once (conventional USBL)."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(network, turn, slot, time)
    turn.row.downlink_s = 0.0
    return time


DOWNLINKS: dict[str, Downlink] = {
    policy.__name__: policy
    for policy in (sequential, pipelined_round, pipelined_group, direct_reply)
}


def downlink_named(name: str) -> Downlink:
    """Return a downlink by its name in the scenario; one's own is named ``module:object``.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
    """
    if name in DOWNLINKS:
        return shipped_part(DOWNLINK, name, DOWNLINKS[name])
    return OwnDownlink(name, own_part(DOWNLINK, name))
