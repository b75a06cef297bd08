"""The TDMA protocol: AUVs ping in groups on HF, then an ASV broadcasts their fixes on MF.

`serve` is the process that runs through the mission, round after round.  The downlink decides the
timeline of a round (:mod:`.downlinks`), written with the functions below: `ping_group`,
`broadcast`, `downlink_free` and `until`.

With passive ranging (piUSBL) ASVs take turns to ping instead (`take_turns`), and every AUV that
hears a ping fixes itself: AUVs have no slots and get no answers.
"""

from collections.abc import Generator, Sequence
from functools import partial
from itertools import count

import numpy as np
import simpy

from ...support.arrays import Ints
from ..acoustics.messages import Message
from ..records.events import Round
from .conflicts import conflict_count
from .network import BroadcastView, Fixes, Network, PassiveNetwork, Steps, Turn
from .steps import check_now, event_of, moment, some_work
from .view import TimedGroups

# Hint to a user-defined downlink that acts at another instant than now.
WAITING = "`time = yield from ping_group(...)` waits, and `yield until(network, time)`"


def take_turns(network: PassiveNetwork) -> Generator[simpy.Event, None, None]:
    """Let the ASVs ping one after the other, a slot each, from the mission's start to its end.

    Slots are so long that no AUV, wherever it is, hears two ASVs in one.  An ASV that has failed by
    the start of a round has no slot in it; one that fails later leaves its slot empty.
    """
    time, asvs = 0.0, network.asv_fleet
    for number in count():
        time = yield from some_work(network.env, asvs, network.slots.clock, time)
        failed = asvs.failed(time)
        turns = [asv for asv in range(len(asvs)) if asv not in failed]
        row = Round(number, time, colours=len(turns), conflicts=0, downlink_s=0.0)
        network.record.rounds.append(row)
        for slot, asv in enumerate(turns):
            if asv not in asvs.failed(time):
                network.deliveries.expect(network.uplink.send(number, slot, [asv], time))
            time = network.slots.clock.after(time, network.slots.uplink_slot)
            yield moment(network.env, time)
            row.uplink_s = time - row.started_at_s
            network.deliveries.settle(time)


def serve(network: Network) -> Generator[simpy.Event, None, None]:
    """Serve the AUVs round after round, from the start of the mission to its end."""
    time = 0.0
    for number in count():
        if network.frame_s:
            time = yield from frame_start(network, number, time)
        if network.asv_fleet.failures is not None:
            begins = yield from some_work(network.env, network.asv_fleet, network.slots.clock, time)
            network.paused += begins - time
            time = begins
        time = yield from network.downlink(network, scheduled(network, number, time), time)


def scheduled(network: Network, number: int, time: float) -> Turn:
    """Return the round that begins now, at `time` (s), with its ping groups.

    Positions have changed since the last downlink, and with them the conflict graph.
    """
    if network.dissemination is None:
        view = network.view(number, time)
        groups = network.schedule(view)
        network.estimates.give_turns(groups, view.heard, number)
    else:  # the schedule that frames have announced
        plan = network.dissemination.planned(number, time)
        view, groups = plan.view, plan.groups
    if isinstance(groups, TimedGroups):
        lengths: Sequence[float] = groups.lengths_s
    else:
        lengths = [network.slots.uplink_slot] * len(groups)
    row = Round(number, time, len(groups), conflict_count(view.heard))
    network.record.rounds.append(row)
    return Turn(row, groups, lengths, view)


def ping_group(network: Network, turn: Turn, slot: int, time: float) -> Steps:
    """Let the AUVs of a ping group that know their slot ping; return the end of the slot (s) once
    it has come (eq. UL_slot, UL_tick).

    With polling the slot ends as soon as all answers are decoded.

    Raises:
        ValueError: when it is not `time` (s) now.
    """
    check_now(network.env, time, WAITING)
    if network.dissemination is None:
        group = turn.groups[slot]
    else:
        group = network.dissemination.known(turn.row, slot, time)
    if group:
        network.ranging.ping(turn.row.round, slot, group, time, turn.view)
    ends = network.slots.clock.after(time, turn.lengths_s[slot])
    if network.answers is None:
        yield moment(network.env, ends)
    else:
        ends = yield from network.answers.wait(ends)
    turn.row.uplink_s = ends - turn.row.started_at_s
    return ends


def broadcast(network: Network, turn: Turn, time: float) -> None:
    """Broadcast every fix made since the last broadcast, and those to be repeated; without any fix
    a broadcast still costs a header (eq. payload).

    One ASV sends them, or several share them.  ASVs that send at once are given the longest of
    their frames and its guard (eq. DL_slot), and others follow.  Fixes that do not fit into one
    message go into several in a row.  With `knowledge: broadcast` frames also name the AUVs that
    have a slot in a round to come.  While all ASVs have failed, fixes wait.

    Raises:
        ValueError: when it is not `time` (s) now.
    """
    check_now(network.env, time, WAITING)
    turn.row.downlink_s = turn.row.downlink_s or 0.0
    if network.asv_fleet.failures is not None and network.asv_fleet.works_from(time) > time:
        return
    slots, after = network.slots, network.slots.clock.after
    waiting = network.take_fixes(time)
    shares = _shared(network, waiting, time)
    named: dict[int, Sequence[int]] = {}  # by ASV: the AUVs whose slots it announces
    if network.dissemination is not None:
        senders = [asv for at_once in shares for asv, _ in at_once]
        named.update(network.dissemination.assign(turn.row.round, time, senders))
    begins = time
    for at_once in shares:
        longest = 0.0
        for asv, fixes in at_once:
            sends_at, airtime, names = begins, 0.0, named.get(asv, ())
            messages = slots.messages.packed(len(fixes), len(names))
            if slots.behind is not None:
                airtime = network.behind_s(asv, begins, messages, fixes)
            for part, message in enumerate(messages):
                own = fixes[: message.fixes], names[: message.named]
                frame = network, turn, asv, sends_at, message, part, *own
                if sends_at == time:
                    _send(*frame)
                else:
                    moment(network.env, sends_at).callbacks.append(partial(_send, *frame))
                fixes, names = fixes[message.fixes :], names[message.named :]
                sends_at += message.airtime_s
                airtime += message.airtime_s
            longest = max(longest, airtime)
        begins = after(begins, longest + slots.downlink_guard)
    ends = max(begins, after(time, slots.shortest_downlink))
    network.downlink_free_at = ends
    if network.dissemination is not None:
        network.dissemination.foretell(turn.row.round, ends)
    turn.row.downlink_s += ends - time


def _shared(network: Network, waiting: Fixes, time: float) -> list[list[tuple[int, Ints]]]:
    """Return which ASVs send which fixes, as pairs of an ASV and rows of the record (k,): the pairs
    of one inner list are sent at once, one list after the other.
    """
    number, fixes = network.broadcasts, waiting
    if isinstance(fixes, range):
        fixes = np.arange(fixes.start, fixes.stop)
    network.broadcasts += 1
    view = BroadcastView(
        number, time, network.record, waiting, network.asv_fleet, network.broadcaster_draw,
        network.listeners, network.acknowledged,
    )  # fmt: skip
    chosen = network.broadcaster(view)
    if isinstance(chosen, int):
        return [[(chosen, fixes)]]
    return [[(asv, fixes[own]) for asv, own in at_once] for at_once in chosen]


def _send(
    network: Network,
    turn: Turn,
    asv: int,
    time: float,
    message: Message,
    part: int,
    fixes: Ints,
    names: Sequence[int],
    _: simpy.Event | None = None,
) -> None:
    """Let an ASV send one message of a broadcast at an instant (s): its `part`, with fixes `fixes`
    (k,) and AUVs `names` whose slots it announces.
    """
    network.deliveries.send(turn.row.round, fixes, asv, time, message, part)
    turn.row.fixes += message.fixes
    if network.dissemination is not None and (names or part == 0):
        broadcast = len(network.record.broadcasts) - 1
        network.dissemination.send(turn.row.round, broadcast, part, names)


def downlink_free(network: Network, time: float) -> Steps:
    """Wait until the downlink slot of the last broadcast is over (eq. DL_slot)."""
    free_at = max(time, network.downlink_free_at)
    if free_at > time:
        yield until(network, free_at)
    return free_at


def frame_start(network: Network, number: int, time: float) -> Steps:
    """Wait for the start of a round's time frame; return that instant (s)."""
    starts = network.opens(number)
    if starts > time:
        yield until(network, starts)
    return max(time, starts)


def until(network: Network, instant: float) -> simpy.Timeout:
    """Return the event of an instant (s) that is not past.

    Raises:
        ValueError: when it is not finite.
    """
    return event_of(network.env, instant)
