"""A fleet under its controllers: sense, steer, hold the command for an interval, sense again.

Nothing is decided within a control interval, so the number of intervals flown in one call changes
no bit of a track.
"""

from math import ceil, hypot, inf, isfinite, nan
from typing import Annotated, NamedTuple

import numpy as np

from ....support.arrays import Flags, Floats, Ints
from ....support.compiled import compiled, inlined
from ....support.packed import unpacked
from ...records.rows import LEARNT, Row, Rows
from ..bottom import Bottom, Keeping, kept_depth
from ..currents import Field, beyond, flows
from ..hulls import bluerov2, cybership2, forces, otter, remus100, rk4
from ..hulls.forces import Current, MovedVehicle
from ..motion import (
    COLUMNS,
    COS,
    DISTANCE,
    RATES,
    SIN,
    YAW,
    Bearing,
    Stride,
    X,
    Y,
    Z,
    in_log,
    turned_over,
    walked,
)
from ..reckoning import sees, sweep
from . import sensing, tracks
from .sensing import Craft, NavigationState, Sensed, SteeringDrift
from .tracks import PathPoint, PathTracks

HEALTHY, BROKEN, ADRIFT, STUCK = range(4)  # the condition of a vehicle
HEADWAY = 0.02  # of the speed demanded: less of it along its path is no headway
ARRIVED = 1.0  # m before its path's end, a vehicle that slows down there counts as arrived
PATIENT_FOR = 3  # times in a row: a correction may take a vehicle back once

# The order to a vehicle: station or path origin (m), speed (m/s), depth (m), which changes where it
# keeps an altitude
ORDER = np.dtype([(name, "f8") for name in ("north", "east", "speed", "depth")])

# The monitor of a vehicle: how far (m) and how long (s) it may be off station, since when (s) and
# from which distance along its path (m) it counts, how often in a row it made no headway
WATCH = np.dtype(
    [("reach", "f8"), ("patience", "f8"), ("since", "f8"), ("reached", "f8"), ("failed", "i8")]
)

# Orders and memory of a vehicle; it uses the memory of one of the autopilots.
VESSEL = np.dtype(
    [
        ("order", ORDER),
        ("watch", WATCH),
        ("progress", tracks.PROGRESS),
        ("trend", sensing.TREND),
        ("bluerov2", bluerov2.MEMORY),
        ("remus100", remus100.MEMORY),
        ("otter", otter.MEMORY),
        ("cybership2", cybership2.MEMORY),
    ]
)

# A line that is being written: the columns of the log, then numbers that the next line needs: speed
# (m/s), cosine and sine of yaw.
SPEED, C_YAW, S_YAW, NOTES = range(COLUMNS, COLUMNS + 4)


class Flight(NamedTuple):
    """The state of a fleet under way, handed to compiled code once.

    The `craft` and the coefficients of its `hull`; by vehicle: `states`, `vessels`, `paths`, GNSS
    `noise` (n, intervals or 1, 2), `corrections` (n, 2), `learnt`, `logs` (n, boundaries, COLUMNS),
    `active` row of the path and `saturated` (n, intervals).  AUVs are `keeping` an altitude above
    the `bottom`, if it is known.  `currents` (any, 2): the last row persists; the `field` adds to
    it. `lost` (2,): the condition of the vehicle that was lost, and
    since when (s).
    """

    craft: Craft
    hull: Annotated[Rows, rk4.HULL]
    states: Annotated[Floats, 2]
    vessels: Annotated[Rows, VESSEL]
    paths: PathTracks
    bottom: Bottom
    keeping: Keeping
    currents: Annotated[Floats, 2]
    field: Field
    drift: SteeringDrift
    noise: Annotated[Floats, 3]
    corrections: Annotated[Floats, 2]
    learnt: Annotated[Rows, LEARNT]
    logs: Annotated[Floats, 3]
    active: Annotated[Ints, 2]
    saturated: Annotated[Flags, 2]
    lost: Floats


@compiled
def _look_out(
    time: float, north: float, east: float, reached: float, speed: float, watch: Row
) -> int:
    """Return whether a vehicle has been off its station, or without headway, for too long.

    It is `north` and `east` of its station (m), and has come `reached` (m) along its path (NaN if
    it keeps a station or has arrived); `speed` is that of its order (m/s).
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
def _turning(
    sensed: Sensed, aim: PathPoint, paths: PathTracks, bounds: Row, progress: Row
) -> float:
    """Return the yaw rate (rad/s) that the path will need LEAD ahead."""
    north, east = sensed.log_n + sensed.set_n, sensed.log_e + sensed.set_e
    ground = north * aim.cosine + east * aim.sine
    ahead = max(ground, 0.0) * remus100.LEAD
    return ground * tracks.bend_ahead(paths.rows, bounds, progress, ahead)


@inlined
def _steer(
    craft: Craft, sensed: Sensed, aim: PathPoint, turning: float, p: Row, vessel: Row,
    work: Floats, command: Floats,
) -> bool:  # fmt: skip
    """Write the command for the next interval; return whether an actuator reached its limit."""
    control, order = craft.control, vessel.order
    if craft.model == forces.BLUEROV2:
        return bluerov2.steer(sensed, aim, order, control, p, vessel.bluerov2, work, command)
    if craft.model == forces.OTTER:
        return otter.steer(sensed, control, p, vessel.otter, command)
    if craft.model == forces.CYBERSHIP2:
        return cybership2.steer(sensed, control, p, vessel.cybership2, command)
    return remus100.steer(sensed, aim, turning, order, control, p, vessel.remus100, command)


@compiled
def fly(packed: int, has_learnt: bool, first: int, last: int) -> int:
    """Move a fleet, in place, through the control intervals `first` to `last` (not included).

    `packed` is the address of a :class:`Flight`; `has_learnt` as in
    :class:`.sensing.NavigationState`. Returns -1, or the index of a vehicle that was lost: `lost`
    holds its condition and the instant (s).
    """
    by = unpacked(packed, Flight)
    craft, p, paths, currents = by.craft, by.hull[0], by.paths, by.currents
    known = NavigationState(by.drift, by.noise, by.corrections, by.learnt, has_learnt, by.logs)
    model, size, control, step, steps = craft
    swept, has_field = by.drift.wrong.swept, flows(by.field)
    keeps, sees_m = by.keeping.altitude_m > 0.0, by.drift.sees_m
    vehicle, wanted = rk4.moving(size), np.empty(6)
    aim, turning, reached = PathPoint(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), 0.0, nan
    for i in range(by.states.shape[0]):
        vessel, bound, log = by.vessels[i], paths.bounds[i], by.logs[i]
        order, way = vessel.order, vessel.progress
        vehicle.state[:] = by.states[i]
        line = _take_up_line(log, first * steps, order.depth)
        rk4.look(vehicle.state, vehicle.angles, vehicle.rates)
        _begin_line(vehicle, line)
        _enter_line(line, log, first * steps)
        for interval in range(first, last):
            time, now = interval * control, min(interval, currents.shape[0] - 1)
            current = Current(currents[now, 0], currents[now, 1])
            if has_field:
                more_n, more_e = beyond(by.field, time, line[X], line[Y], line[Z])
                current = Current(current.north + more_n, current.east + more_e)
                if swept.shape[1] > 1 and by.drift.through_water:
                    sweep(swept, i, interval, more_n, more_e)
            misses = by.drift.through_water
            if sees_m < inf and not misses:
                misses = not sees(by.bottom, sees_m, line[X], line[Y], line[Z])
                share = 1.0 if misses else 0.0
                if swept.shape[1] > 1:
                    sweep(swept, i, interval, share * current.north, share * current.east)
            ahead, aside, _ = forces.along_body(current, vehicle.angles)
            sensed = sensing.sense(
                craft, i, vehicle, line, (ahead, aside), interval, current, known, vessel, misses
            )
            if paths.rows.size > 0:  # there are paths, and stations are at the origin
                aim = tracks.locate(paths.rows, bound, way, sensed.off_n, sensed.off_e)
                by.active[i, interval] = way.row
                reached = tracks.travelled(paths.rows, way) if aim.left > ARRIVED else nan
                if model != forces.BLUEROV2:  # a BlueROV2 begins turns where the path does
                    turning = _turning(sensed, aim, paths, bound, way)
            if keeps:
                order.depth = kept_depth(by.bottom, line[X], line[Y], by.keeping, order.depth)
            full = _steer(craft, sensed, aim, turning, p, vessel, wanted, vehicle.command)
            by.saturated[i, interval] = full
            north, east = line[X] - order.north, line[Y] - order.east
            status = _look_out(time, north, east, reached, order.speed, vessel.watch)
            for k in range(1, steps + 1):
                if not rk4.move(model, vehicle, current, p, step):
                    status = BROKEN
                    break
                _next_line(vehicle, step, line)
                _enter_line(line, log, interval * steps + k)
            if status != HEALTHY:
                by.states[i] = vehicle.state
                by.lost[0], by.lost[1] = status, time
                return i
        by.states[i] = vehicle.state
    return -1


@compiled
def beside(packed: int, vehicle: int, times: Floats, errors: Floats) -> None:
    """Write the distance (m) of a vehicle from the path it flew, at instants (s), to `errors`.

    `packed` is the address of a :class:`Flight`.
    """
    by = unpacked(packed, Flight)
    log, active, step, control = (
        by.logs[vehicle],
        by.active[vehicle],
        by.craft.step,
        by.craft.control,
    )
    for k in range(times.size):
        last = ceil(times[k] / control) - 1  # at the instant of a control, that before
        interval = min(max(last, 0), active.size - 1)
        x, y, _, _, _, _ = in_log(log, 0, len(log), step, times[k])
        errors[k] = tracks.distance_from(
            by.paths.rows, by.paths.bounds[vehicle], active[interval], x, y
        )


@inlined
def _take_up_line(log: Floats, number: int, depth: float) -> Floats:
    """Return a line with the integrals and distance of row `number` of a log, at a depth (m)."""
    line = np.zeros(NOTES)
    for column in (COS, SIN, DISTANCE):
        line[column] = log[number, column]
    line[Z] = depth
    return line


@inlined
def _begin_line(vehicle: MovedVehicle, line: Floats) -> None:
    """Write position, rates and yaw of a vehicle to its line; integrals and distance stay.

    The depth of a surface craft stays, too.
    """
    state, rates = vehicle.state, vehicle.rates
    line[X], line[Y] = state[0], state[1]
    line[RATES + X], line[RATES + Y] = rates[0], rates[1]
    if state.size >= forces.PITCHING_STATE:
        line[Z], line[YAW] = state[2], state[5]
        line[RATES + Z], line[RATES + YAW] = rates[2], rates[5]
    else:
        line[YAW], line[RATES + YAW] = state[2], rates[2]
    line[SPEED] = hypot(rates[0], rates[1])
    line[C_YAW], line[S_YAW] = vehicle.angles[forces.C_PSI], vehicle.angles[forces.S_PSI]


@inlined
def _bearing(line: Floats) -> Bearing:
    return Bearing(line[C_YAW], line[S_YAW], line[RATES + YAW])


@inlined
def _stride(line: Floats) -> Stride:
    return Stride(line[X], line[Y], line[RATES + X], line[RATES + Y], line[SPEED])


@compiled
def _next_line(vehicle: MovedVehicle, step: float, line: Floats) -> None:
    """Advance a line by a step (s) of the vehicle."""
    bearing, stride = _bearing(line), _stride(line)
    _begin_line(vehicle, line)
    ahead, aside = turned_over(bearing, _bearing(line), step)
    line[COS] += ahead
    line[SIN] += aside
    line[DISTANCE] += walked(stride, _stride(line), step)


@compiled
def _enter_line(line: Floats, log: Floats, number: int) -> None:
    """Copy a line to a row of a log."""
    for column in range(COLUMNS):
        log[number, column] = line[column]
