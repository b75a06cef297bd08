"""Moving vehicles through time: classical Runge-Kutta of fourth order, for four of them at once.

The boundaries of the steps lie at `start + k * step` (s) and at the instants of new commands, and
nowhere else; what is asked in between is computed aside. So a vehicle moved once in a long while
is bit for bit where it would be if moved at every tick.
"""

from math import floor
from typing import NamedTuple

import numpy as np

from ...core.compiled import compiled, entry, inlined
from ...core.lanes.blocks import block
from ...core.lanes.numbers import LANES, all_at_least
from . import bluerov2, cybership2, otter, remus100
from .frames import C_THETA, Current, Floats, move_rigid_body, move_surface_craft

REMUS100, REMUS100_PVS, BLUEROV2, OTTER, CYBERSHIP2 = range(5)  # which equations are taken

# Within this part of a step of a boundary is on it: 5 ns of 50 ms, while 0.1 * 3 is not 0.3.
SAME_INSTANT = 1e-7
# Pitch (rad) beyond which Euler angles are no longer integrated: 89 deg. cos(89 deg) = 0.01745.
STEEPEST = np.radians(89.0)
COS_STEEPEST = float(np.cos(STEEPEST))
PITCHING_STATE = 12  # states this long or longer hold a pitch angle, in place 4

# Where things lie among the rows of four vehicles that are moved together: their states (of 15
# numbers at most) and commands, sines and cosines, and what a step works with.
STATE, COMMAND, ANGLE, RATE, TOTAL, PROBE, ROWS = 0, 15, 21, 27, 42, 57, 72


class Four(NamedTuple):
    """Four vehicles that are moved together: `state`, `command`, the `angles` and `rates` of the
    state, the `total` of a step's rates, and the `probe` that feels them; each a row per number.
    """

    state: Floats
    command: Floats
    angles: Floats
    rates: Floats
    total: Floats
    probe: Floats


def room() -> Floats:
    """Return an array for four vehicles at the origin."""
    return np.zeros((ROWS, LANES))


@inlined
def four(rows: Floats) -> Four:
    """Return four vehicles in an array (ROWS, LANES)."""
    return Four(
        block(rows, STATE), block(rows, COMMAND), block(rows, ANGLE), block(rows, RATE),
        block(rows, TOTAL), block(rows, PROBE),
    )  # fmt: skip


@compiled
def board(states: Floats, vehicle: int, lane: int, rows: Floats) -> None:
    """Have a vehicle of some state take a lane."""
    for k in range(states.shape[1]):
        rows[STATE + k, lane] = states[vehicle, k]


@compiled
def tell(command: Floats, lane: int, rows: Floats) -> None:
    """Have the vehicle in a lane hold a command."""
    for k in range(command.size):
        rows[COMMAND + k, lane] = command[k]


@compiled
def leave(rows: Floats, lane: int, states: Floats, vehicle: int) -> None:
    """Note the state of the vehicle in a lane."""
    for k in range(states.shape[1]):
        states[vehicle, k] = rows[STATE + k, lane]


@inlined
def look(size: int, state: Floats, angles: Floats, rates: Floats) -> None:
    """Write the angles of states of some size, and the rates of place and attitude."""
    if size >= PITCHING_STATE:
        move_rigid_body(state, angles, rates)
    else:
        move_surface_craft(state, angles, rates)


@compiled
def accelerate(
    model: int, state: Floats, angles: Floats, command: Floats, current: Current, p: Floats,
    rates: Floats,
) -> None:  # fmt: skip
    """Write the remaining rates of vehicles by the equations of their model."""
    if model == REMUS100:
        remus100.accelerate(state, angles, command, current, p, rates)
    elif model == BLUEROV2:
        bluerov2.accelerate(state, angles, command, current, p, rates)
    elif model == OTTER:
        otter.accelerate(state, angles, command, current, p, rates)
    elif model == CYBERSHIP2:
        cybership2.accelerate(state, angles, command, current, p, rates)
    else:
        remus100.accelerate_pvs(state, angles, command, current, p, rates)


@compiled
def move(
    model: int, size: int, vehicles: Four, current: Current, p: Floats, duration: float
) -> bool:
    """Move four vehicles, which have looked, by `duration` (s) and have them look again.

    Their states have `size` numbers.  Returns whether all of them are still where they can be.
    """
    state, command, angles, rates, total, probe = vehicles
    accelerate(model, state, angles, command, current, p, rates)
    for k in range(size):
        total[k] = rates[k]
    for stage in range(3):
        last = stage == 2
        share, weight = duration if last else 0.5 * duration, 1.0 if last else 2.0
        for k in range(size):
            probe[k] = state[k] + share * rates[k]
        look(size, probe, angles, rates)
        accelerate(model, probe, angles, command, current, p, rates)
        for k in range(size):
            total[k] += weight * rates[k]
    for k in range(size):
        state[k] += duration / 6.0 * total[k]
    look(size, state, angles, rates)
    return all_at_least(_levelness(size, state, angles), COS_STEEPEST)


@inlined
def _levelness(size: int, state: Floats, angles: Floats) -> float:
    """Return the cosine of the pitch, or no number where the state is not finite."""
    cosine: float = angles[C_THETA]
    for k in range(size):
        cosine += state[k] - state[k]
    return cosine


@compiled
def is_sound(size: int, rows: Floats, lane: int) -> bool:
    """Tell whether the vehicle in a lane is still where it can be."""
    cosine = rows[ANGLE + C_THETA, lane]
    for k in range(size):
        cosine += rows[STATE + k, lane] - rows[STATE + k, lane]
    return bool(cosine >= COS_STEEPEST)


@entry
def advance(
    model: int, p: Floats, states: Floats, commands: Floats, current_n: float, current_e: float,
    clocks: Floats, start: float, step: float, until: float, exactly: bool, rows: Floats,
) -> int:  # fmt: skip
    """Move a fleet, in place, to the last boundary `start + k * step` at or before `until` (s).

    If `exactly`, go on from there by a partial step: on a copy of states and clocks that is a peek,
    on the fleet itself the instant of a new command. `states` (vehicles, state), `commands`
    (vehicles, command), `clocks` (vehicles,) the instants of the states; a vehicle already later
    stays. `rows` is a :func:`room`. Returns -1, or the first vehicle whose state became infinite or
    stood on end: its row and clock are then those at the end of that step.
    """
    size, current, vehicles = states.shape[1], Current(current_n, current_e), four(rows)
    last = floor((until - start) / step + SAME_INSTANT)
    for vehicle in range(states.shape[0]):
        passed = (clocks[vehicle] - start) / step
        boundary = floor(passed + SAME_INSTANT)
        whole = abs(passed - boundary) <= SAME_INSTANT
        board(states, vehicle, 0, rows)
        tell(commands[vehicle], 0, rows)
        look(size, vehicles.state, vehicles.angles, vehicles.rates)
        sound = True
        while sound:
            duration = until - clocks[vehicle]
            if boundary < last:
                boundary += 1
                instant = start + boundary * step
                duration = step if whole else instant - clocks[vehicle]
                whole, clocks[vehicle] = True, instant
            elif exactly and duration > SAME_INSTANT * step:
                clocks[vehicle] = until
            else:
                break
            sound = move(model, size, vehicles, current, p, duration) or is_sound(size, rows, 0)
        leave(rows, 0, states, vehicle)
        if not sound:
            return vehicle
    return -1
