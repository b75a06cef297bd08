"""The TDMA protocol: AUVs ping in groups on HF, then an ASV broadcasts their fixes on MF.

``serve`` is the process that runs through the mission.  Each downlink policy below is one round as
its timeline reads; all return the instant at which the next round may start.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from itertools import count

import simpy

from .conflicts import conflict_count
from .events import Broadcast, Round
from .schedules import Groups, View
from .world import World

Steps = Generator[simpy.Event, None, float]


@dataclass(slots=True)
class Turn:
    """A round under way: its row in the record, its ping groups, one for each slot, and what the
    fleet knew when it began.
    """

    row: Round
    groups: Groups
    view: View


def serve(world: World) -> Generator[simpy.Event, None, None]:
    """Serve the AUVs round after round, from the start of the mission to its end."""
    time = 0.0
    for number in count():
        if world.frame:
            time = yield from frame_start(world, number, time)
        # Positions have changed since the last downlink, and with them the conflict graph.
        view = world.view(number, time)
        groups = world.schedule(view)
        turn = Turn(Round(number, time, len(groups), conflict_count(view.conflicts)), groups, view)
        world.record.rounds.append(turn.row)
        time = yield from DOWNLINKS[world.policy](world, turn, time)


def sequential(world: World, turn: Turn, time: float) -> Steps:
    """All groups ping; then the fixes of the round are broadcast; then the next round starts."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(world, turn, slot, time)
    broadcast(world, turn, time)
    return (yield from downlink_free(world, time))


def pipelined_round(world: World, turn: Turn, time: float) -> Steps:
    """All groups ping; their fixes are broadcast while the next round pings."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(world, turn, slot, time)
    time = yield from downlink_free(world, time)
    broadcast(world, turn, time)
    return time


def pipelined_group(world: World, turn: Turn, time: float) -> Steps:
    """Each group's fixes are broadcast while the next group pings."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(world, turn, slot, time)
        time = yield from downlink_free(world, time)
        broadcast(world, turn, time)
    return time


def direct_reply(world: World, turn: Turn, time: float) -> Steps:
    """All groups ping; the ASV that hears a ping first answers it at once (conventional USBL)."""
    for slot in range(len(turn.groups)):
        time = yield from uplink_slot(world, turn, slot, time)
    turn.row.downlink_s = 0.0
    return time


DOWNLINKS: dict[str, Callable[[World, Turn, float], Steps]] = {
    policy.__name__: policy
    for policy in (sequential, pipelined_round, pipelined_group, direct_reply)
}


def uplink_slot(world: World, turn: Turn, slot: int, time: float) -> Steps:
    """Let one ping group ping and wait for the end of its slot (eq. UL_slot, UL_tick)."""
    world.ranging.ping(turn.row.round, slot, turn.groups[slot], time, turn.view)
    ends = world.slots.clock.after(time, world.slots.uplink_slot)
    yield until(world, ends)
    turn.row.uplink_s = ends - turn.row.started_at_s
    return ends


def broadcast(world: World, turn: Turn, time: float) -> None:
    """Let one ASV broadcast every fix made since the last broadcast; none still costs a header."""
    slots, clock = world.slots, world.slots.clock
    frame = world.board.take(time)
    asv, fixes = world.next_broadcaster(frame, time), len(frame)
    airtime = slots.airtime(fixes)
    world.record.broadcasts.append(
        Broadcast(turn.row.round, asv, time, airtime, slots.payload_bytes(fixes), fixes)
    )
    world.downlink.send(frame.rows, asv, time, airtime)
    world.downlink_free_at = clock.after(time, slots.downlink_slot(fixes))
    turn.row.downlink_s = (turn.row.downlink_s or 0.0) + world.downlink_free_at - time
    turn.row.fixes += fixes


def downlink_free(world: World, time: float) -> Steps:
    """Wait until the downlink slot of the last broadcast is over (eq. DL_slot)."""
    free_at = max(time, world.downlink_free_at)
    if free_at > time:
        yield until(world, free_at)
    return free_at


def frame_start(world: World, number: int, time: float) -> Steps:
    """Wait for the round's frame."""
    starts = world.slots.clock.after(0.0, number * world.frame)
    if starts > time:
        yield until(world, starts)
    return max(time, starts)


def until(world: World, instant: float) -> simpy.Timeout:
    """Return the event of an instant (s) that is not past."""
    now = world.env.now
    return world.env.timeout(instant - now if instant > now else 0.0)
