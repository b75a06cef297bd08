"""Integration of any hull: classical Runge-Kutta of fourth order.

Boundaries of steps lie at `start + k * step` (s) and at the instants of new commands, and nowhere
else; states in between are computed on copies.  So a vehicle that is moved rarely is bit for bit
where it would be if moved at every tick.
"""

from collections.abc import Mapping
from math import floor

import numpy as np

from ....support.arrays import Floats
from ....support.compiled import compiled, inlined
from ...records.rows import Row, Rows
from . import bluerov2, cybership2, forces, otter, remus100
from .forces import Coefficients, Current, Model, MovedVehicle

_ALL = remus100.MODEL, remus100.PVS, bluerov2.MODEL, otter.MODEL, cybership2.MODEL
MODELS: Mapping[str, Model] = {model.name: model for model in _ALL}

# The coefficients of all hulls: compiled code that moves any of them reads one kind of row.
HULL = np.dtype([
    (name, "f8")
    for name in dict.fromkeys(
        name for model in _ALL for name in vars(model.coefficients(model.body()))
    )
])  # fmt: skip

# An instant within this part of a step of a boundary is on it: 5 ns of 50 ms (0.1 * 3 is not 0.3).
SAME_INSTANT = 1e-7
# Pitch (rad) beyond which Euler angles are no longer integrated: 89 deg. cos(89 deg) = 0.01745.
STEEPEST = np.radians(89.0)
COS_STEEPEST = float(np.cos(STEEPEST))

LONGEST_COMMAND = 6  # numbers


def packed(hull: Coefficients) -> Rows:
    """Return the coefficients of a hull as one row of HULL, for compiled equations."""
    rows = np.zeros(1, dtype=HULL)
    for name, value in vars(hull).items():
        rows[name] = value
    return rows


@inlined
def moving(size: int) -> MovedVehicle:
    """Return empty work arrays for a vehicle whose state has `size` numbers."""
    return MovedVehicle(
        np.zeros(size), np.zeros(LONGEST_COMMAND), np.zeros(forces.ANGLES), np.zeros(size),
        np.zeros(size), np.zeros(size),
    )  # fmt: skip


@inlined
def look(state: Floats, angles: Floats, rates: Floats) -> None:
    """Write the angles of a state, and the rates of position and attitude."""
    if state.size >= forces.PITCHING_STATE:
        forces.move_rigid_body(state, angles, rates)
    else:
        forces.move_surface_craft(state, angles, rates)


@compiled
def accelerate(
    model: int, state: Floats, angles: Floats, command: Floats, current: Current, p: Row,
    rates: Floats,
) -> None:  # fmt: skip
    """Write the rates of velocities and actuators by the equations of a model."""
    if model == forces.REMUS100:
        remus100.accelerate(state, angles, command, current, p, rates)
    elif model == forces.BLUEROV2:
        bluerov2.accelerate(state, angles, command, current, p, rates)
    elif model == forces.OTTER:
        otter.accelerate(state, angles, command, current, p, rates)
    elif model == forces.CYBERSHIP2:
        cybership2.accelerate(state, angles, command, current, p, rates)
    else:
        remus100.accelerate_pvs(state, angles, command, current, p, rates)


@compiled
def move(model: int, vehicle: MovedVehicle, current: Current, p: Row, duration: float) -> bool:
    """Move a vehicle by `duration` (s); return whether its state is finite and not too steep.

    `angles` and `rates` must be those of the state (:func:`look`), and are updated.
    """
    state, command, angles, rates, total, probe = vehicle
    size = state.size
    accelerate(model, state, angles, command, current, p, rates)
    for k in range(size):
        total[k] = rates[k]
    for stage in range(3):
        last = stage == 2
        share, weight = duration if last else 0.5 * duration, 1.0 if last else 2.0
        for k in range(size):
            probe[k] = state[k] + share * rates[k]
        look(probe, angles, rates)
        accelerate(model, probe, angles, command, current, p, rates)
        for k in range(size):
            total[k] += weight * rates[k]
    for k in range(size):
        state[k] += duration / 6.0 * total[k]
    look(state, angles, rates)
    cosine = angles[forces.C_THETA]
    for k in range(size):
        cosine += state[k] - state[k]  # no number where the state is not finite
    return bool(cosine >= COS_STEEPEST)


@compiled
def advance(
    model: int, hull: Rows, states: Floats, commands: Floats, current_n: float, current_e: float,
    clocks: Floats, start: float, step: float, until: float, exactly: bool,
) -> int:  # fmt: skip
    """Move a fleet, in place, to the last boundary `start + k * step` at or before `until` (s).

    If `exactly`, a partial step follows: on copies of states and clocks to look ahead, on the fleet
    itself for a new command.  `states` (vehicles, state), `commands` (vehicles, command), `clocks`
    (vehicles,): the instants (s) of the states; a vehicle that is already later stays.  Returns -1,
    or the index of the first vehicle whose state became infinite or too steep: its row and clock
    are then those at the end of that step.
    """
    current, moved = Current(current_n, current_e), moving(states.shape[1])
    last = floor((until - start) / step + SAME_INSTANT)
    for vehicle in range(states.shape[0]):
        passed = (clocks[vehicle] - start) / step
        boundary = floor(passed + SAME_INSTANT)
        whole = abs(passed - boundary) <= SAME_INSTANT
        moved.state[:] = states[vehicle]
        moved.command[: commands.shape[1]] = commands[vehicle]
        look(moved.state, moved.angles, moved.rates)
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
            sound = move(model, moved, current, hull[0], duration)
        states[vehicle] = moved.state
        if not sound:
            return vehicle
    return -1
