"""How CyberShip II keeps its station: dynamic positioning with a force on each axis.

The ship is 1.3 m long and pushes sideways with 1.5 N: enough for 0.19 m/s of current from abeam,
so it lies with its bow against what pushes it. Limits of thrust: Skjetne, Smogeli & Fossen 2004;
method: nonlinear PID with weathervaning, Fossen 2021, sections 15.2 and 15.3.
"""

from math import copysign, hypot

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled
from ...records.rows import Row
from ..hulls import cybership2 as hull
from .otter import average_fixes
from .sensing import Sensed, half_turn, within

# Skjetne et al. 2004: surge, sway (N), yaw (N m)
SURGE_LIMIT, SWAY_LIMIT, YAW_LIMIT = 2.0, 1.5, 1.5
WATCH_CIRCLE = 1.0  # m
FREQUENCY, DAMPING = 0.2, 1.0  # rad/s, position
LEARNING = 0.1  # of frequency times stiffness: the integrator (Fossen 2021, algorithm 15.1)
YAW_FREQUENCY, YAW_DAMPING = 0.8, 1.0  # rad/s: above the 0.2 rad/s at which the hull runs away
TURNING, FASTEST_TURN = 0.1, 0.05  # rad/s per N pushing across, and rad/s: slower than position
PUSHED = 0.03  # N from astern: it lies the wrong way round, in a current above 0.03 m/s

# What the controller remembers: averaged offset from station (m), integrators (N, N, N m), heading
# wanted (rad), whether it has begun
_NUMBERS = ("off_n", "off_e", "push_n", "push_e", "twist", "bow")
MEMORY = np.dtype([(name, "f8") for name in _NUMBERS] + [("begun", "?")])


@compiled
def steer(sensed: Sensed, interval: float, p: Floats, memory: Row, command: Floats) -> bool:
    """Write surge and sway force (N) and yaw moment (N m) that keep the ship at its station.

    It knows its offset from there by GNSS and its velocity over ground. Returns whether an axis was
    saturated; its integrator then waits.
    """
    posture, north_rate, east_rate = sensed.posture, sensed.log_n, sensed.log_e
    if not memory.begun:
        memory.begun, memory.bow = True, posture.yaw
    average_fixes(sensed, interval, memory)
    reach = hypot(memory.off_n, memory.off_e)
    near = min(1.0, 2.0 * WATCH_CIRCLE / reach) if reach > 0.0 else 1.0
    stiff_u, stiff_v = p[hull.M11] * FREQUENCY**2, p[hull.M22] * FREQUENCY**2
    brake = 2.0 * DAMPING * FREQUENCY
    c_yaw, s_yaw = posture.c_yaw, posture.s_yaw
    off_u = near * (memory.off_n * c_yaw + memory.off_e * s_yaw)
    off_v = near * (memory.off_e * c_yaw - memory.off_n * s_yaw)
    u, v = north_rate * c_yaw + east_rate * s_yaw, east_rate * c_yaw - north_rate * s_yaw
    push_u = memory.push_n * c_yaw + memory.push_e * s_yaw
    push_v = memory.push_e * c_yaw - memory.push_n * s_yaw
    surge = push_u - stiff_u * off_u - brake * p[hull.M11] * u
    sway = push_v - stiff_v * off_v - brake * p[hull.M22] * v
    # the hull is pushed across far more easily than along, so the direction of the push misleads:
    # the bow turns until nothing pushes across
    turning = within(TURNING * sway, FASTEST_TURN)
    if push_u < -PUSHED:
        turning = copysign(FASTEST_TURN, sway)
    memory.bow += turning * interval
    turn = half_turn(memory.bow - posture.yaw)
    stiff_r = YAW_FREQUENCY**2 / p[hull.I33]
    yaw = stiff_r * turn - 2.0 * YAW_DAMPING * YAW_FREQUENCY / p[hull.I33] * posture.turning
    yaw += memory.twist
    command[0], command[1] = within(surge, SURGE_LIMIT), within(sway, SWAY_LIMIT)
    command[2] = within(yaw, YAW_LIMIT)
    grow_u = grow_v = 0.0
    learning = LEARNING * FREQUENCY * interval
    if command[0] == surge:
        grow_u = learning * stiff_u * off_u
    if command[1] == sway:
        grow_v = learning * stiff_v * off_v
    memory.push_n -= c_yaw * grow_u - s_yaw * grow_v
    memory.push_e -= s_yaw * grow_u + c_yaw * grow_v
    if command[2] == yaw:
        memory.twist += LEARNING * YAW_FREQUENCY * interval * stiff_r * turn
    full: bool = command[0] != surge or command[1] != sway or command[2] != yaw
    return full
