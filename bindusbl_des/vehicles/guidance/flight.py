"""A fleet under its controllers: look, steer, hold the command for an interval, look again.

Within a control interval nothing is decided; so how many intervals are flown at a time changes no
bit of where anybody goes.
"""

from math import ceil, hypot, isfinite, nan
from typing import Annotated, NamedTuple

import numpy as np

from ...core.compiled import compiled, entry, inlined
from ...core.handing.opened import opened
from ...core.lanes.blocks import block
from ...core.lanes.numbers import LANES
from ...records.rows import LEARNT, Row, Rows
from ..hulls import rk4
from ..hulls.frames import Current, Floats, along_body
from ..logs import X, Y, Z, place_at
from . import bluerov2, cybership2, drift, logbook, otter, remus100, sensing, tracks
from .belief import Sensed, SteeringDrift
from .sensing import Craft, Knowledge
from .tracks import Aim, Flags, Ints, Tracks

HEALTHY, BROKEN, ADRIFT, STUCK = range(4)  # how a vehicle fares
HEADWAY = 0.02  # of the speed demanded: less of it along its path is no headway
ARRIVED = 1.0  # m before its path's end, a vehicle that slows down there counts as arrived
PATIENT_FOR = 3  # times in a row: a correction may take a vehicle back once

# Where a vehicle was told to be (m), how fast (m/s), how deep (m)
ORDER = np.dtype([(name, "f8") for name in ("north", "east", "speed", "depth")])

# The look-out: how far a vehicle may be off (m), for how long (s), since when (s) and from where
# (m) it counts, how often in a row no headway was made
WATCH = np.dtype(
    [("reach", "f8"), ("patience", "f8"), ("since", "f8"), ("reached", "f8"), ("failed", "i8")]
)

# All that is told to a vehicle and remembered by it; of the autopilots it has one.
VESSEL = np.dtype(
    [
        ("order", ORDER),
        ("watch", WATCH),
        ("progress", tracks.PROGRESS),
        ("trend", drift.TREND),
        ("bluerov2", bluerov2.MEMORY),
        ("remus100", remus100.MEMORY),
        ("otter", otter.MEMORY),
        ("cybership2", cybership2.MEMORY),
    ]
)


class Flight(NamedTuple):
    """A fleet under way, handed over once.

    What its vehicles are and the coefficients of their `hull`; by vehicle: `states`, `vessels`,
    `paths`, `noise` (n, intervals or 1, 2), `corrections` (n, 2), `learnt`, `logs` (n, boundaries,
    COLUMNS), `active` and `saturated` (n, intervals).  Of `currents` (any, 2) the last row holds;
    `rows` is a :func:`sensing.room`; `lost` (2,) tells how the one fares that was lost, and since
    when (s).
    """

    craft: Craft
    hull: Floats
    states: Annotated[Floats, 2]
    vessels: Annotated[Rows, VESSEL]
    paths: Tracks
    currents: Annotated[Floats, 2]
    drift: SteeringDrift
    noise: Annotated[Floats, 3]
    corrections: Annotated[Floats, 2]
    learnt: Annotated[Rows, LEARNT]
    logs: Annotated[Floats, 3]
    active: Annotated[Ints, 2]
    saturated: Annotated[Flags, 2]
    lost: Floats
    rows: Annotated[Floats, 2]


@compiled
def _look_out(
    time: float, north: float, east: float, reached: float, speed: float, watch: Row
) -> int:
    """Tell whether a vehicle has been off its station, or made no headway, for too long.

    It is so far `north` and `east` of its station (m), and has come so far along its path
    (`reached`, m; not a number for who keeps a station or has arrived); `speed` is what it was told
    to make (m/s).
    """
    if not isfinite(reached):
        if hypot(north, east) <= watch.reach:
            watch.since = time
        return ADRIFT if time - watch.since > watch.patience else HEALTHY
    spent = time - watch.since
    if spent < watch.patience:
        return HEALTHY
    idle = reached - watch.reached < HEADWAY * speed * spent
    watch.failed = watch.failed + 1 if idle else 0
    watch.since, watch.reached = time, reached
    return STUCK if watch.failed >= PATIENT_FOR else HEALTHY


@inlined
def _turning(sensed: Sensed, aim: Aim, paths: Tracks, bounds: Row, progress: Row) -> float:
    """Return the yaw rate (rad/s) that the path will soon ask for."""
    north, east = sensed.log_n + sensed.set_n, sensed.log_e + sensed.set_e
    ground = north * aim.cosine + east * aim.sine
    ahead = max(ground, 0.0) * remus100.LEAD
    return ground * tracks.bend_ahead(paths.rows, bounds, progress, ahead)


@inlined
def _steer(
    craft: Craft, sensed: Sensed, aim: Aim, turning: float, p: Floats, vessel: Row, work: Floats,
    command: Floats,
) -> bool:  # fmt: skip
    """Write the command for the next interval; return whether it reached a limit."""
    control, order = craft.control, vessel.order
    if craft.model == rk4.BLUEROV2:
        return bluerov2.steer(sensed, aim, order, control, p, vessel.bluerov2, work, command)
    if craft.model == rk4.OTTER:
        return otter.steer(sensed, control, p, vessel.otter, command)
    if craft.model == rk4.CYBERSHIP2:
        return cybership2.steer(sensed, control, p, vessel.cybership2, command)
    return remus100.steer(sensed, aim, turning, order, control, p, vessel.remus100, command)


@compiled
def _board(
    states: Floats, vessels: Rows, logs: Floats, line: int, first: int, count: int, rows: Floats
) -> None:
    """Have so many vehicles, of which one is the first, go on from a line of their logs."""
    rows[:] = 0.0  # lanes that nobody takes rest at the origin
    for lane in range(count):
        vehicle = first + lane
        rk4.board(states, vehicle, lane, rows)
        logbook.take_up(logs, line, vehicle, lane, rows)
        rows[logbook.LINE + Z, lane] = vessels[vehicle].order.depth


@compiled
def _note_broken(states: Floats, first: int, count: int, rows: Floats, status: Ints) -> None:
    """Note which of so many vehicles cannot be where they are, and their states as they broke."""
    for lane in range(count):
        if status[lane] != BROKEN and not rk4.is_sound(states.shape[1], rows, lane):
            status[lane] = BROKEN
            rk4.leave(rows, lane, states, first + lane)


@entry
def fly(handed: int, has_learnt: bool, first: int, last: int) -> int:
    """Move a fleet, in place, through the control intervals `first` to `last` (not included).

    `handed` is the address of a :class:`Flight`; `has_learnt` as of :class:`.sensing.Knowledge`.
    Returns -1, or the vehicle lost, with `lost` holding how it fares and when (s).
    """
    by = opened(handed, Flight)
    craft, p, states, vessels, paths = by.craft, by.hull, by.states, by.vessels, by.paths
    currents, logs, rows = by.currents, by.logs, by.rows
    known = Knowledge(by.drift, by.noise, by.corrections, by.learnt, has_learnt, logs)
    model, size, control, step, steps = craft
    vehicles, line, flow = rk4.four(rows), block(rows, logbook.LINE), block(rows, sensing.FLOW)
    wanted, command, status = np.empty(6), np.zeros(6), np.zeros(LANES, np.int64)
    aim, turning, reached = Aim(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), 0.0, nan
    for i in range(0, states.shape[0], LANES):
        count, gone = min(LANES, states.shape[0] - i), -1
        _board(states, vessels, logs, first * steps, i, count, rows)
        rk4.look(size, vehicles.state, vehicles.angles, vehicles.rates)
        logbook.begin(size, vehicles, line)
        logbook.keep(rows, logs, first * steps, i, count)
        for interval in range(first, last):
            time, now = interval * control, min(interval, currents.shape[0] - 1)
            current = Current(currents[now, 0], currents[now, 1])
            flow[0], flow[1], _ = along_body(current, vehicles.angles)
            for lane in range(count):
                vehicle = i + lane
                vessel, bound = vessels[vehicle], paths.bounds[vehicle]
                order, way = vessel.order, vessel.progress
                sensed = sensing.sense(craft, vehicle, lane, interval, current, rows, known, vessel)
                if paths.rows.size > 0:  # there are paths, and stations are at the origin
                    aim = tracks.locate(paths.rows, bound, way, sensed.off_n, sensed.off_e)
                    by.active[vehicle, interval] = way.row
                    reached = tracks.travelled(paths.rows, way) if aim.left > ARRIVED else nan
                    if model != rk4.BLUEROV2:  # whose turns begin where the path's do
                        turning = _turning(sensed, aim, paths, bound, way)
                full = _steer(craft, sensed, aim, turning, p, vessel, wanted, command)
                by.saturated[vehicle, interval] = full
                rk4.tell(command, lane, rows)
                north = rows[logbook.LINE + X, lane] - order.north
                east = rows[logbook.LINE + Y, lane] - order.east
                status[lane] = _look_out(time, north, east, reached, order.speed, vessel.watch)
            for k in range(1, steps + 1):
                if not rk4.move(model, size, vehicles, current, p, step):
                    _note_broken(states, i, count, rows, status)
                logbook.go_on(size, vehicles, step, line)
                logbook.keep(rows, logs, interval * steps + k, i, count)
            for lane in range(count):
                if status[lane] != HEALTHY:
                    by.lost[0], by.lost[1] = status[lane], time
                    gone, count = i + lane, lane  # the others may be lost as well
                    if status[lane] != BROKEN:
                        rk4.leave(rows, lane, states, gone)
                    break
            if count == 0:
                break
        for lane in range(count):
            rk4.leave(rows, lane, states, i + lane)
        if gone >= 0:
            return gone
    return -1


@entry
def beside(handed: int, vehicle: int, times: Floats, errors: Floats) -> None:
    """Write how far (m) a vehicle was from the path that it flew at instants (s).

    `handed` is the address of a :class:`Flight`.
    """
    by = opened(handed, Flight)
    log, active, step, control = (
        by.logs[vehicle],
        by.active[vehicle],
        by.craft.step,
        by.craft.control,
    )
    for k in range(times.size):
        last = ceil(times[k] / control) - 1  # at the instant of a control, that before
        interval = min(max(last, 0), active.size - 1)
        x, y, _, _ = place_at(log, 0, len(log), step, times[k])
        errors[k] = tracks.distance_from(
            by.paths.rows, by.paths.bounds[vehicle], active[interval], x, y
        )
