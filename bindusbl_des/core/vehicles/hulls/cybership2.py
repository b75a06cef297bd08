"""CyberShip II, a 1:70 model of a supply ship in a towing tank, and its dynamic positioning.

State as IN_PLANE (m, rad, m/s, rad/s; velocities over ground in body axes); command surge force
(N), sway force (N), yaw moment (N m). Course-unstable: a straight run amplifies round-off.
The ship is 1.3 m long and pushes sideways with 1.5 N: enough for 0.19 m/s of current from abeam,
so it lies with its bow against what pushes it.  Source: Skjetne, Smogeli & Fossen 2004, Modeling,
Identification and Control 25(1); of the controller: nonlinear PID with weathervaning, Fossen 2021,
sections 15.2 and 15.3.
"""

from dataclasses import dataclass
from math import copysign, hypot

import numpy as np

from ....support.arrays import Floats
from ....support.compiled import compiled
from ...records.rows import Row
from ..guidance.sensing import Sensed, average_fixes, half_turn, within
from . import forces
from .forces import Current, Model


@dataclass(frozen=True)
class CyberShip2:
    """Mass, inertia and damping of CyberShip II.

    Units kg, kg m2, m; added masses positive.  Drag coefficients are forces (N) or moments (N m)
    per power of m/s and rad/s, positive where they resist; `sway_drag_by_yaw_rate` and the like are
    the cross terms Y_r, Y_|r|v, Y_|v|r, Y_|r|r and their moments N_*.
    """

    # Skjetne, Smogeli & Fossen 2004, table of rigid-body and added mass
    mass_kg: float = 23.8
    yaw_inertia_kg_m2: float = 1.760
    cg_forward_m: float = 0.046
    surge_added_mass_kg: float = 2.0
    sway_added_mass_kg: float = 10.0
    sway_yaw_added_kg_m: float = 0.0
    yaw_added_inertia_kg_m2: float = 1.0
    # damping: -X_u, -X_|u|u, -X_uuu
    surge_drag_linear: float = 0.72253
    surge_drag_quadratic: float = 1.32742
    surge_drag_cubic: float = 5.86643
    # -Y_v, -Y_|v|v, -Y_|r|v, -Y_r, -Y_|v|r, -Y_|r|r
    sway_drag_linear: float = 0.88965
    sway_drag_quadratic: float = 36.47287
    sway_drag_turning: float = 0.805
    sway_drag_by_yaw_rate: float = 7.250
    sway_drag_by_yaw_rate_drifting: float = 0.845
    sway_drag_by_yaw_rate_quadratic: float = 3.450
    # -N_v, -N_|v|v, -N_|r|v, -N_r, -N_|v|r, -N_|r|r
    yaw_drag_by_sway: float = -0.03130
    yaw_drag_by_sway_quadratic: float = -3.95645
    yaw_drag_by_sway_turning: float = -0.130
    yaw_drag_linear: float = 1.900
    yaw_drag_drifting: float = -0.080
    yaw_drag_quadratic: float = 0.750


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Row, out: Floats
) -> None:
    """Write the rates of the ship's velocities into `out[3:]`, with damping D(nu_r)."""
    u_c, v_c = forces.along_level_body(current, angles)
    u, v, r = state[3] - u_c, state[4] - v_c, state[5]
    au, av, ar = abs(u), abs(v), abs(r)
    d11 = p.surge_drag_linear + p.surge_drag_quadratic * au + p.surge_drag_cubic * u * u
    d22 = p.sway_drag_linear + p.sway_drag_quadratic * av + p.sway_drag_turning * ar
    d23 = p.sway_drag_by_yaw_rate + p.sway_drag_by_yaw_rate_drifting * av
    d23 += p.sway_drag_by_yaw_rate_quadratic * ar
    d32 = p.yaw_drag_by_sway + p.yaw_drag_by_sway_quadratic * av + p.yaw_drag_by_sway_turning * ar
    d33 = p.yaw_drag_linear + p.yaw_drag_drifting * av + p.yaw_drag_quadratic * ar
    tau = command[0], command[1], command[2]
    by_sway, by_yaw_rate = (d11 * u, d22 * v, d32 * v), (0.0, d23 * r, d33 * r)
    forces.accelerate_in_plane(state, (u_c, v_c), tau, by_sway, by_yaw_rate, p, out)


# Skjetne et al. 2004: surge, sway (N), yaw (N m)
SURGE_LIMIT, SWAY_LIMIT, YAW_LIMIT = 2.0, 1.5, 1.5
WATCH_CIRCLE = 1.0  # m
FREQUENCY, DAMPING = 0.2, 1.0  # rad/s, position
LEARNING = 0.1  # of frequency times stiffness: the integrator (Fossen 2021, algorithm 15.1)
YAW_FREQUENCY, YAW_DAMPING = 0.8, 1.0  # rad/s: above the 0.2 rad/s at which the hull runs away
TURNING, FASTEST_TURN = 0.1, 0.05  # rad/s per N pushing across, and rad/s: slower than position
PUSHED = 0.03  # N from astern: the ship must turn round; a current above 0.03 m/s

# Memory of the controller: averaged offset from station (m), integrators (N, N, N m), wanted
# heading (rad), whether it has begun
_NUMBERS = ("off_n", "off_e", "push_n", "push_e", "twist", "bow")
MEMORY = np.dtype([(name, "f8") for name in _NUMBERS] + [("begun", "?")])


@compiled
def steer(sensed: Sensed, interval: float, p: Row, memory: Row, command: Floats) -> bool:
    """Write surge and sway force (N) and yaw moment (N m) that keep the ship at its station.

    The controller reads the offset by GNSS and the velocity over ground.  Returns whether an axis
    was saturated; its integrator then stops.
    """
    posture, north_rate, east_rate = sensed.posture, sensed.log_n, sensed.log_e
    if not memory.begun:
        memory.begun, memory.bow = True, posture.yaw
    average_fixes(sensed, interval, memory)
    reach = hypot(memory.off_n, memory.off_e)
    near = min(1.0, 2.0 * WATCH_CIRCLE / reach) if reach > 0.0 else 1.0
    stiff_u, stiff_v = p.m11 * FREQUENCY**2, p.m22 * FREQUENCY**2
    brake = 2.0 * DAMPING * FREQUENCY
    c_yaw, s_yaw = posture.c_yaw, posture.s_yaw
    off_u = near * (memory.off_n * c_yaw + memory.off_e * s_yaw)
    off_v = near * (memory.off_e * c_yaw - memory.off_n * s_yaw)
    u, v = north_rate * c_yaw + east_rate * s_yaw, east_rate * c_yaw - north_rate * s_yaw
    push_u = memory.push_n * c_yaw + memory.push_e * s_yaw
    push_v = memory.push_e * c_yaw - memory.push_n * s_yaw
    surge = push_u - stiff_u * off_u - brake * p.m11 * u
    sway = push_v - stiff_v * off_v - brake * p.m22 * v
    # water pushes the hull across far more easily than along, so the direction of the force is
    # misleading: the bow turns until no force is left across
    turning = within(TURNING * sway, FASTEST_TURN)
    if push_u < -PUSHED:
        turning = copysign(FASTEST_TURN, sway)
    memory.bow += turning * interval
    turn = half_turn(memory.bow - posture.yaw)
    stiff_r = YAW_FREQUENCY**2 / p.i33
    yaw = stiff_r * turn - 2.0 * YAW_DAMPING * YAW_FREQUENCY / p.i33 * posture.turning
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


MODEL = Model(
    "cybership2", forces.CYBERSHIP2, forces.IN_PLANE, ("tau_u", "tau_v", "tau_r"),
    CyberShip2, forces.masses_in_plane,
    full_ahead=lambda _: [SURGE_LIMIT, 0.0, 0.0],
    step_s=0.05,
    settling_step_s=0.05,
    watch_circle_m=WATCH_CIRCLE,
)  # fmt: skip
