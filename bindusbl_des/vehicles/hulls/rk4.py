"""Moving vehicles through time: classical Runge-Kutta of fourth order, for a whole fleet at once.

The boundaries of the steps lie at `start + k * step` (s) and at the instants of new commands, and
nowhere else; what is asked in between is computed aside. So a vehicle moved once in a long while
is bit for bit where it would be if moved at every tick.
"""

from math import cos, floor, isfinite

import numpy as np

from ...core.compiled import compiled, entry
from . import bluerov2, cybership2, otter, remus100
from .frames import Floats

REMUS100, REMUS100_PVS, BLUEROV2, OTTER, CYBERSHIP2 = range(5)  # which equations `derivative` takes

# Within this part of a step of a boundary is on it: 5 ns of 50 ms, while 0.1 * 3 is not 0.3.
SAME_INSTANT = 1e-7
# Pitch (rad) beyond which Euler angles are no longer integrated: 89 deg. cos(89 deg) = 0.01745.
STEEPEST = np.radians(89.0)
COS_STEEPEST = float(np.cos(STEEPEST))
PITCHING_STATE = 12  # states this long or longer hold a pitch angle, in place 4


@compiled
def derivative(
    model: int, state: Floats, command: Floats, current_n: float, current_e: float, p: Floats,
    out: Floats,
) -> None:  # fmt: skip
    """Write the rates of a vehicle's state into `out`, by the equations of its model."""
    if model == REMUS100:
        remus100.derivative(state, command, current_n, current_e, p, out)
    elif model == BLUEROV2:
        bluerov2.derivative(state, command, current_n, current_e, p, out)
    elif model == OTTER:
        otter.derivative(state, command, current_n, current_e, p, out)
    elif model == CYBERSHIP2:
        cybership2.derivative(state, command, current_n, current_e, p, out)
    else:
        remus100.derivative_pvs(state, command, current_n, current_e, p, out)


@compiled
def move(
    model: int, state: Floats, command: Floats, current_n: float, current_e: float, p: Floats,
    duration: float, work: Floats,
) -> bool:  # fmt: skip
    """Move one vehicle by `duration` (s) in place; return whether it is still where it can be.

    `work` has five rows of the state's length.
    """
    k1, k2, k3, k4, probe = work[0], work[1], work[2], work[3], work[4]
    derivative(model, state, command, current_n, current_e, p, k1)
    for i in range(state.size):
        probe[i] = state[i] + 0.5 * duration * k1[i]
    derivative(model, probe, command, current_n, current_e, p, k2)
    for i in range(state.size):
        probe[i] = state[i] + 0.5 * duration * k2[i]
    derivative(model, probe, command, current_n, current_e, p, k3)
    for i in range(state.size):
        probe[i] = state[i] + duration * k3[i]
    derivative(model, probe, command, current_n, current_e, p, k4)
    sound = True
    for i in range(state.size):
        state[i] += duration / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
        sound = sound and isfinite(state[i])
    if state.size >= PITCHING_STATE:
        sound = sound and cos(state[4]) >= COS_STEEPEST
    return sound


@entry
def advance(
    model: int, p: Floats, states: Floats, commands: Floats, current_n: float, current_e: float,
    clocks: Floats, start: float, step: float, until: float,
) -> int:  # fmt: skip
    """Move a fleet, in place, to the last boundary `start + k * step` at or before `until` (s).

    `states` (vehicles, state), `commands` (vehicles, command), `clocks` (vehicles,) the instants of
    the states; a vehicle already later stays. Returns -1, or the first vehicle whose state became
    infinite or stood on end: its row and clock are then those at the end of that step.
    """
    work = np.empty((5, states.shape[1]))
    last = floor((until - start) / step + SAME_INSTANT)
    for vehicle in range(states.shape[0]):
        state, command = states[vehicle], commands[vehicle]
        passed = (clocks[vehicle] - start) / step
        boundary = floor(passed + SAME_INSTANT)
        whole = abs(passed - boundary) <= SAME_INSTANT
        while boundary < last:
            boundary += 1
            instant = start + boundary * step
            duration = step if whole else instant - clocks[vehicle]
            whole = True
            clocks[vehicle] = instant
            if not move(model, state, command, current_n, current_e, p, duration, work):
                return vehicle
    return -1


@entry
def leap(
    model: int, p: Floats, states: Floats, commands: Floats, current_n: float, current_e: float,
    clocks: Floats, step: float, until: float,
) -> int:  # fmt: skip
    """Move a fleet, in place, to `until` (s) by one partial step each; returns as `advance` does.

    On a copy of states and clocks this is a peek; on the fleet itself it is the instant of a new
    command. No vehicle's clock may lie more than a step before `until`.
    """
    work = np.empty((5, states.shape[1]))
    for vehicle in range(states.shape[0]):
        duration = until - clocks[vehicle]
        if duration > SAME_INSTANT * step:
            clocks[vehicle] = until
            state, command = states[vehicle], commands[vehicle]
            if not move(model, state, command, current_n, current_e, p, duration, work):
                return vehicle
    return -1
