"""A fleet under its controllers: look, steer, hold the command for an interval, look again.

Within a control interval nothing is decided; so how many intervals are flown at a time changes no
bit of where anybody goes.
"""

from math import cos, hypot, isfinite, nan, sin

import numpy as np

from ...core.compiled import compiled, inlined
from ...records.rows import Rows
from ..hulls import rk4
from ..hulls.frames import Floats, move_rigid_body, move_surface_craft
from . import belief, bluerov2, cybership2, drift, logbook, otter, remus100, tracks
from .belief import LOG_E, LOG_N, OFF_E, OFF_N, SET_E, SET_N
from .tracks import Flags, Ints

MEMORY = 8  # numbers that a controller may remember
# Which numbers `watch` holds: where the vehicle was told to be (m), how fast (m/s), how deep (m);
# for the look-out: how far it may be off (m), for how long (s), since when (s) and from where (m)
# it counts, how often in a row it made no headway
NORTH, EAST, SPEED, DEPTH, REACH, PATIENCE, SINCE, REACHED, FAILED, WATCH = range(10)
HEALTHY, BROKEN, ADRIFT, STUCK = range(4)  # how a vehicle fares
HEADWAY = 0.02  # of the speed demanded: less of it along its path is no headway
ARRIVED = 1.0  # m before its path's end, a vehicle that slows down there counts as arrived
PATIENT_FOR = 3  # times in a row: a correction may take a vehicle back once

# What `spot` holds: x, y, z (m), yaw (rad), their rates, as a line of the log does; then the
# current ahead and to starboard (m/s)
AHEAD, ASIDE, SPOT = 8, 9, 10


@compiled
def _observe(state: Floats, current: Floats, depth: float, rates: Floats, spot: Floats) -> None:
    """Write the rates of a state's first half, and `spot` (SPOT,), of one instant."""
    if state.size >= rk4.PITCHING_STATE:
        flow = move_rigid_body(state, current[0], current[1], rates)
        spot[8], spot[9] = flow[0], flow[1]
        spot[2], spot[3], spot[6], spot[7] = state[2], state[5], rates[2], rates[5]
    else:
        spot[8], spot[9] = move_surface_craft(state, current[0], current[1], rates)
        spot[2], spot[3], spot[6], spot[7] = depth, state[2], 0.0, rates[2]
    spot[0], spot[1], spot[4], spot[5] = state[0], state[1], rates[0], rates[1]


@inlined
def _read_log(
    model: int, state: Floats, spot: Floats, current: Floats, missed: float, bias: Floats,
    in_body: bool, sensed: Floats,
) -> None:  # fmt: skip
    """Write what a vehicle's log measures, as `belief.read_log` does, into `sensed`.

    Without bottom lock it misses the current (`missed` is 1). Ahead and to starboard a REMUS
    measures its velocity through the water in any case; surface craft do not ask for it.
    """
    if state.size >= rk4.PITCHING_STATE:
        share = missed if model == rk4.BLUEROV2 else 1.0
        own = state[6] - share * spot[AHEAD], state[7] - share * spot[ASIDE]
    else:
        own = 0.0, 0.0
    belief.read_log(spot, own, current, missed, bias, in_body, sensed)


@compiled
def _look_out(time: float, off: float, reached: float, watch: Floats) -> int:
    """Return whether a vehicle has been off its station, or made no headway, for too long.

    `off` is its distance from station (m), `reached` how far along its path it has come (m; not a
    number for who keeps a station or has arrived).
    """
    if not isfinite(reached):
        if off <= watch[REACH]:
            watch[SINCE] = time
        return ADRIFT if time - watch[SINCE] > watch[PATIENCE] else HEALTHY
    spent = time - watch[SINCE]
    if spent < watch[PATIENCE]:
        return HEALTHY
    idle = reached - watch[REACHED] < HEADWAY * watch[SPEED] * spent
    watch[FAILED] = watch[FAILED] + 1.0 if idle else 0.0
    watch[SINCE], watch[REACHED] = time, reached
    return STUCK if watch[FAILED] >= PATIENT_FOR else HEALTHY


@compiled
def _steer(
    model: int, state: Floats, rates: Floats, sensed: Floats,
    aim: tuple[float, float, float, float], turning: float, watch: Floats, control: float,
    p: Floats, gains: Floats, memory: Floats, work: Floats, command: Floats,
) -> bool:  # fmt: skip
    """Write the command for the next interval; return whether it reached a limit.

    `sensed` (belief.SENSED,) is what the vehicle knows of its place and velocity; of `state` and
    `rates` it knows attitude, turn rates and depth.
    """
    north, east, north_rate, east_rate = sensed[OFF_N], sensed[OFF_E], sensed[LOG_N], sensed[LOG_E]
    if model == rk4.BLUEROV2:
        return bluerov2.steer(
            state, rates, sensed, aim, watch[SPEED], watch[DEPTH], control, p,
            gains[0], memory, work, command,
        )  # fmt: skip
    if model == rk4.OTTER:
        return otter.steer(
            state, north, east, north_rate, east_rate, control, p, gains, memory, command
        )
    if model == rk4.CYBERSHIP2:
        return cybership2.steer(
            state, north, east, north_rate, east_rate, control, p, memory, command
        )
    return remus100.steer(
        state, sensed, aim, turning, watch[SPEED], watch[DEPTH], control, p, gains, memory, command
    )  # fmt: skip


@compiled
def _hold(
    model: int, state: Floats, command: Floats, current: Floats, p: Floats, depth: float,
    step: float, steps: int, log: Floats, line: int, spot: Floats, rates: Floats, work: Floats,
) -> bool:  # fmt: skip
    """Move one vehicle through an interval, logging what lies within; return whether it is sound.

    `line` of the log is the interval's beginning, already written; its end is not yet.
    """
    for k in range(1, steps + 1):
        if not rk4.move(model, state, command, current[0], current[1], p, step, work):
            return False
        if k < steps:
            _observe(state, current, depth, rates, spot)
            logbook.note(log, line + k, step, spot)
    return True


@compiled
def fly(
    model: int, p: Floats, gains: Floats, states: Floats, memory: Floats, watch: Floats,
    rows: Floats, bounds: Ints, progress: Floats, active: Ints, currents: Floats, noise: Floats,
    bias: Floats, in_body: bool, walk: Floats, walk_rate: float, corrections: Floats,
    learnt: Rows, has_learnt: bool, missed: float, lines: Floats, logs: Floats,
    saturated: Flags, first: int, last: int, control: float, step: float, steps: int, lost: Floats,
) -> int:  # fmt: skip
    """Move a fleet, in place, through the control intervals `first` to `last` (not included).

    Vehicles are the first axis of `gains` (2,), `states`, `memory` (MEMORY,), `watch` (WATCH,),
    `bounds`, `progress` (tracks.PROGRESS,), `active` (intervals,), `noise` (intervals or 1, 2),
    `bias` (2,), `walk` (samples, 2), `corrections` (2,), `learnt`, `lines`
    (drift.MEMORIES,), `logs` (boundaries, logbook.COLUMNS), `saturated` (intervals,). Of `currents`
    (any, 2) the last row holds; velocity logs miss the share `missed` (0 or 1) of it. Returns -1,
    or the vehicle lost, with `lost` holding how it fares and when (s).
    """
    size = states.shape[1]
    work, rates, spot = np.empty((5, size)), np.empty(size), np.empty(SPOT)
    command, scratch, sensed = np.empty(6), np.empty(6), np.zeros(belief.SENSED)
    aim, turning, reached = (0.0, 0.0, 0.0, 0.0), 0.0, nan
    for i in range(states.shape[0]):
        state, told, log, recalls = states[i], watch[i], logs[i], memory[i]
        bound, way, gain, own_bias, wander = bounds[i], progress[i], gains[i], bias[i], walk[i]
        for interval in range(first, last):
            time, line = interval * control, interval * steps
            current = currents[min(interval, currents.shape[0] - 1)]
            _observe(state, current, told[DEPTH], rates, spot)
            logbook.note(log, line, step, spot)
            off_n, off_e = belief.error(time, log[line], own_bias, in_body, wander, walk_rate)
            fix = noise[i, min(interval, noise.shape[1] - 1)]
            sensed[OFF_N] = spot[0] + off_n + fix[0] + corrections[i, 0] - told[NORTH]
            sensed[OFF_E] = spot[1] + off_e + fix[1] + corrections[i, 1] - told[EAST]
            _read_log(model, state, spot, current, missed, own_bias, in_body, sensed)
            if has_learnt:
                told_off = learnt[i]
                north, east = belief.carried_on(time, log[line], told_off, in_body)
                sensed[OFF_N], sensed[OFF_E] = sensed[OFF_N] - north, sensed[OFF_E] - east
                belief.set_of(spot[3] if in_body else 0.0, told_off, sensed)
            elif missed > 0.0:
                drift.learn(time, corrections[i, 0], corrections[i, 1], lines[i])
                sensed[SET_N], sensed[SET_E] = lines[i, drift.RATE_N], lines[i, drift.RATE_E]
            if rows.shape[0] > 0:  # there are paths, and stations are at the origin
                aim = tracks.locate(rows, bound, way, sensed[OFF_N], sensed[OFF_E])
                active[i, interval] = int(way[tracks.ROW])
                reached = tracks.travelled(rows, way) if aim[3] > ARRIVED else nan
                north, east = sensed[LOG_N] + sensed[SET_N], sensed[LOG_E] + sensed[SET_E]
                ground = north * cos(aim[1]) + east * sin(aim[1])
                ahead = max(ground, 0.0) * remus100.LEAD
                turning = ground * tracks.bend_ahead(rows, bound, way, ahead)
            saturated[i, interval] = _steer(
                model, state, rates, sensed, aim, turning, told, control, p, gain, recalls, scratch,
                command,
            )  # fmt: skip
            off = hypot(spot[0] - told[NORTH], spot[1] - told[EAST])
            status = _look_out(time, off, reached, told)
            if not _hold(
                model, state, command, current, p, told[DEPTH], step, steps, log, line, spot,
                rates, work,
            ):  # fmt: skip
                status = BROKEN
            if status != HEALTHY:
                lost[0], lost[1] = status, time
                return i
        _observe(state, currents[0], told[DEPTH], rates, spot)
        logbook.note(log, last * steps, step, spot)
    return -1
