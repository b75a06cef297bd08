"""Otter, a two-metre catamaran with two propellers: the surface vehicle that hears the AUVs.

State: IN_PLANE, then n1, n2 (m, rad, m/s, rad/s; velocities over ground in body axes; n1 port and
n2 starboard propeller, rad/s).  Command: n1, n2 (rad/s).  It moves in the horizontal plane and
cannot push sideways.  Source: reduction to three degrees of freedom of the Otter of
PythonVehicleSimulator (Fossen, otter.py @c717e073), Munk moment kept.

To keep its station the controller integrates the force of the sea, points the bow against it like a
weathervane, and bears away a little to move across.  In still water it does not follow noise: the
Otter rests within its watch circle and returns when it has left it. Method: nonlinear PID with
weathervaning, Fossen 2021, sections 15.2 and 15.3.
"""

from dataclasses import dataclass
from math import atan2, hypot, sqrt

import numpy as np

from ....support.arrays import Floats
from ....support.compiled import compiled
from ...records.rows import Row
from ..guidance.sensing import Sensed, average_fixes, half_turn, within
from . import forces
from .forces import Current, Model


@dataclass(frozen=True)
class Otter:
    """Mass, inertia, damping and propellers of the Otter.

    Units kg, m, kg m2, N, rad/s; added masses positive; `*_drag_linear` N per m/s or N m per rad/s;
    `yaw_drag_quadratic` N m s2/rad2; `thrust_*` N s2/rad2.
    """

    # otter.py: hull 55 kg and payload 25 kg, their centre of gravity and inertia about midships
    mass_kg: float = 80.0
    cg_forward_m: float = 0.153125
    yaw_inertia_kg_m2: float = 16.977881
    # otter.py: fractions 0.1, 1.0 of the 55 kg hull (+ payload) and 1.7 of its yaw inertia
    surge_added_mass_kg: float = 5.5
    sway_added_mass_kg: float = 82.5
    yaw_added_inertia_kg_m2: float = 25.673569
    # otter.py: thrust at 6 knots; time constants of 1 s in sway and yaw; ten times as much in r|r|
    surge_drag_linear: float = 77.554432
    sway_drag_linear: float = 162.5
    yaw_drag_linear: float = 42.65145
    yaw_drag_quadratic: float = 426.5145
    # otter.py: cross-flow drag of the hulls, coefficient from Hoerner's curve
    length_m: float = 2.0
    draught_m: float = 0.195122
    cross_flow_drag: float = 1.0041845
    water_density_kg_per_m3: float = 1026.0
    # otter.py: bollard pull, propeller positions and first-order lag
    propeller_lever_m: float = 0.395
    thrust_ahead: float = 0.01108
    thrust_astern: float = 0.006445
    propeller_limit_ahead_rad_per_s: float = 103.931
    propeller_limit_astern_rad_per_s: float = 101.737
    propeller_time_constant_s: float = 0.1


def _derived(otter: Otter) -> dict[str, float]:
    """Return masses, drag of a strip of the hull, and the largest thrust of one propeller (N)."""
    ahead, astern = otter.propeller_limit_ahead_rad_per_s, -otter.propeller_limit_astern_rad_per_s
    return {
        **forces.masses_in_plane(otter),
        "strip": 0.5 * otter.water_density_kg_per_m3 * otter.draught_m * otter.cross_flow_drag,
        "most_ahead": otter.thrust_ahead * ahead * ahead,
        "most_astern": otter.thrust_astern * astern * astern,
    }


@compiled
def _thrust(n: float, p: Row) -> float:
    """Return the bollard pull (N) of one propeller at n (rad/s)."""
    given: float = (p.thrust_ahead if n > 0.0 else p.thrust_astern) * n * abs(n)
    return given


@compiled
def _propeller(thrust: float, p: Row) -> float:
    """Return the revolutions (rad/s) that give a thrust (N)."""
    if thrust >= 0.0:
        return sqrt(thrust / p.thrust_ahead)
    return -sqrt(-thrust / p.thrust_astern)


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Row, out: Floats
) -> None:
    """Write the rates of the Otter's velocities and propellers into `out[3:]`.

    Damping is linear, with cross-flow; propellers follow their clipped command with a first-order
    lag.
    """
    u_c, v_c = forces.along_level_body(current, angles)
    u, v, r = state[3] - u_c, state[4] - v_c, state[5]
    port, starboard = _thrust(state[6], p), _thrust(state[7], p)
    push, twist = forces.cross_flow(v, r, p.length_m)
    tau = port + starboard, 0.0, p.propeller_lever_m * (port - starboard)
    turning = (p.yaw_drag_linear + p.yaw_drag_quadratic * abs(r)) * r + p.strip * twist
    damped = p.surge_drag_linear * u, p.sway_drag_linear * v, turning
    forces.accelerate_in_plane(state, (u_c, v_c), tau, damped, (0.0, p.strip * push, 0.0), p, out)
    for side in range(2):
        wanted = max(command[side], -p.propeller_limit_astern_rad_per_s)
        wanted = min(wanted, p.propeller_limit_ahead_rad_per_s)
        out[6 + side] = (wanted - state[6 + side]) / p.propeller_time_constant_s


WATCH_CIRCLE = 2.0  # m: leaving it sends the Otter back to within HOME
HOME = 0.4  # m
FAR = 10.0  # m, beyond which the demanded force grows no more
FREQUENCY, DAMPING = 0.25, 1.0  # rad/s, position; Fossen 2021: 0.1 to 0.5 rad/s for station keeping
LEARNING = 0.1  # of frequency times stiffness: the integrator (Fossen 2021, algorithm 15.1)
YAW_FREQUENCY, YAW_DAMPING = 1.0, 0.9  # rad/s, four times that of position
PUSHED, CALM = 6.0, 3.0  # N of sea: above the first it weathervanes, below the second it rests
FARTHEST_OFF = 0.9  # rad by which it bears away at most while it weathervanes
YAW_THRUST = 60.0  # N of difference between the propellers that steering may take: half of one

# Memory of the controller: averaged offset from station (m), integrator (N), wanted heading (rad),
# whether it weathervanes, whether it returns to its station, whether it has begun
_NUMBERS = ("off_n", "off_e", "push_n", "push_e", "bow")
MEMORY = np.dtype(
    [(name, "f8") for name in _NUMBERS] + [(name, "?") for name in ("is_vane", "returns", "begun")]
)


@compiled
def _bow(north: float, east: float, memory: Row) -> tuple[float, bool]:
    """Return the heading (rad) for a wanted force (N), and whether the Otter may go astern."""
    push = hypot(memory.push_n, memory.push_e)
    off = hypot(memory.off_n, memory.off_e)
    if push > PUSHED:
        memory.is_vane = True
    elif push < CALM:
        memory.is_vane = False
    if off > WATCH_CIRCLE:
        memory.returns = True
    elif off < HOME:
        memory.returns = False
    if memory.is_vane and off <= 2.0 * WATCH_CIRCLE:
        along = (north * memory.push_n + east * memory.push_e) / push
        across = (east * memory.push_n - north * memory.push_e) / push
        away = within(atan2(across, max(along, push)), FARTHEST_OFF)
        memory.bow = atan2(memory.push_e, memory.push_n) + away
        return memory.bow, True
    if memory.returns:
        memory.bow = atan2(east, north)
        return memory.bow, off <= WATCH_CIRCLE
    return memory.bow, True


@compiled
def steer(sensed: Sensed, interval: float, p: Row, memory: Row, command: Floats) -> bool:
    """Write the revolutions (rad/s) that keep the Otter at its station.

    The controller reads the offset by GNSS and the velocity over ground.  Returns whether a
    propeller was saturated; the integrators then stop.
    """
    posture = sensed.posture
    if not memory.begun:  # it has lain at its station for long
        memory.begun, memory.bow = True, posture.yaw
    average_fixes(sensed, interval, memory)
    stiff = p.m11 * FREQUENCY**2
    damping = 2.0 * DAMPING * FREQUENCY * p.m11
    reach = hypot(memory.off_n, memory.off_e)
    near = min(1.0, FAR / reach) if reach > 0.0 else 1.0
    north = memory.push_n - stiff * near * memory.off_n - damping * sensed.log_n
    east = memory.push_e - stiff * near * memory.off_e - damping * sensed.log_e
    bow, astern = _bow(north, east, memory)
    turn = half_turn(bow - posture.yaw)
    wanted = north * posture.c_yaw + east * posture.s_yaw
    if not astern:
        wanted = max(wanted, 0.0)
    twist = YAW_FREQUENCY**2 * turn - 2.0 * YAW_DAMPING * YAW_FREQUENCY * posture.turning
    moment = twist / p.i33 + p.yaw_drag_linear * posture.turning
    difference = within(0.5 * moment / p.propeller_lever_m, YAW_THRUST)
    ahead_most = p.most_ahead - abs(difference)
    astern_most = p.most_astern - abs(difference)
    half = min(max(0.5 * wanted, -max(astern_most, 0.0)), ahead_most)
    command[0], command[1] = _propeller(half + difference, p), _propeller(half - difference, p)
    full: bool = half != 0.5 * wanted
    if not full:
        learning = LEARNING * FREQUENCY * stiff * near * interval
        memory.push_n -= learning * memory.off_n
        memory.push_e -= learning * memory.off_e
    return full


MODEL = Model(
    "otter", forces.OTTER, (*forces.IN_PLANE, "n1", "n2"), ("n1", "n2"), Otter, _derived,
    full_ahead=lambda hull: [hull.propeller_limit_ahead_rad_per_s] * 2,
    step_s=0.02,  # its propellers reverse within a few hundredths of a second
    settling_step_s=0.02,
    watch_circle_m=WATCH_CIRCLE,
)  # fmt: skip
