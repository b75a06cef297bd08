"""The TDMA protocol: AUVs ping in groups on HF, then an ASV broadcasts their fixes on MF.

``serve`` is the process that runs through the mission, round after round.  How a round reads, the
downlink decides (:mod:`.downlinks`), in the words that follow.
"""

from collections.abc import Generator
from functools import partial
from itertools import count

import simpy

from ..acoustics.modem import Message
from ..records.events import Broadcast, Round
from .colouring import conflict_count
from .network import Carried, Network, Steps, Turn
from .own.steps import check_now, event_of, moment, some_work

# What is said to a downlink whose words are not of now.
WAITING = "`time = yield from uplink_slot(...)` waits, and `yield until(network, time)`"


def serve(network: Network) -> Generator[simpy.Event, None, None]:
    """Serve the AUVs round after round, from the start of the mission to its end."""
    time = 0.0
    for number in count():
        if network.frame:
            time = yield from frame_start(network, number, time)
        if network.asv_fleet.failures is not None:
            began = yield from some_work(network.env, network.asv_fleet, network.slots.clock, time)
            network.paused += began - time
            time = began
        # Positions have changed since the last downlink, and with them the conflict graph.
        view, groups = network.planned(number, time)
        row = Round(number, time, len(groups), conflict_count(view.heard))
        turn = Turn(row, groups, view, network.slots.uplink_slot)
        network.record.rounds.append(turn.row)
        time = yield from network.policy(network, turn, time)


def uplink_slot(network: Network, turn: Turn, slot: int, time: float) -> Steps:
    """Let those of a ping group that know it ping, and wait for the end of its slot (eq. UL_slot,
    UL_tick).

    Polled AUVs end it when they have answered.

    Raises:
        ValueError: when it is not `time` (s) now.
    """
    check_now(network.env, time, WAITING)
    group = network.pinging(turn, slot, time)
    if group:
        network.ranging.ping(turn.row.round, slot, group, time, turn.view)
    ends = network.slots.clock.after(time, turn.length(slot))
    if network.answers is None:
        yield moment(network.env, ends)
    else:
        ends = yield from network.answers.wait(ends)
    turn.row.uplink_s = ends - turn.row.started_at_s
    return ends


def broadcast(network: Network, turn: Turn, time: float) -> None:
    """Broadcast every fix made since the last broadcast; none still costs a header.

    One ASV does, or several share it: those that send at once are given time for the longest of
    their frames and its guard, and the others follow them.  Where AUVs have to be told their slots,
    frames name those that have one in a round to come.  While all ASVs have failed, the fixes wait.

    Raises:
        ValueError: when it is not `time` (s) now.
    """
    check_now(network.env, time, WAITING)
    turn.row.downlink_s = turn.row.downlink_s or 0.0
    if network.asv_fleet.works_from(time) > time:
        return
    begins, slots = time, network.slots
    for shares in network.shared(turn, time):
        airtime = max([_send_all(network, turn, share, time, begins) for share in shares])
        begins = slots.clock.after(begins, airtime + slots.downlink_guard)
    ends = max(begins, slots.clock.after(time, slots.shortest_downlink))
    network.downlink_free_at = ends
    network.foretell(turn, ends)
    turn.row.downlink_s += ends - time


def _send_all(network: Network, turn: Turn, share: Carried, time: float, begins: float) -> float:
    """Let an ASV send its fixes from when it `begins` (s), now or later; return how long (s) it
    sends.  Where one message does not hold them, several follow each other.
    """
    airtime, messages = 0.0, network.slots.messages.packed(len(share.fixes), len(share.named))
    for part, carried in enumerate(share.split(messages)):
        message, when = messages[part], (part, begins)
        if begins == time:
            _send(network, turn, carried, message, when)
        else:
            send = partial(_send, network, turn, carried, message, when)
            moment(network.env, begins).callbacks.append(send)
        begins += message.airtime_s
        airtime += message.airtime_s
    return airtime


def _send(
    network: Network,
    turn: Turn,
    carried: Carried,
    message: Message,
    when: tuple[int, float],
    _: simpy.Event | None = None,
) -> None:
    """Let an ASV send one message of a broadcast, its number among them and instant (s) given.

    It carries fixes, and the next slots of the AUVs that it names.
    """
    (asv, fixes, named), (part, time) = carried, when
    count, told, size, airtime, delay = message
    on_air = network.asv_fleet.works_for(asv, time, airtime)
    network.record.broadcasts.append(
        Broadcast(turn.row.round, asv, time, on_air, size, count, part, told)
    )
    network.downlink.send(fixes, asv, time, airtime, delay, size)
    if named or part == 0:
        network.tell(turn, named)
    turn.row.fixes += count


def downlink_free(network: Network, time: float) -> Steps:
    """Wait until the downlink slot of the last broadcast is over (eq. DL_slot)."""
    free_at = max(time, network.downlink_free_at)
    if free_at > time:
        yield until(network, free_at)
    return free_at


def frame_start(network: Network, number: int, time: float) -> Steps:
    """Wait for the round's frame."""
    starts = network.opens(number)
    if starts > time:
        yield until(network, starts)
    return max(time, starts)


def until(network: Network, instant: float) -> simpy.Timeout:
    """Return the event of an instant (s) that is not past.

    Raises:
        ValueError: when that is no instant.
    """
    return event_of(network.env, instant)
