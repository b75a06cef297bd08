"""How a body moves through the sea: positions, body axes, and the motion of the water itself.

Body axes: x forward, y starboard, z down; yaw clockwise from North; velocities in a state are over
ground, in body axes (m/s, rad/s). The current is uniform, horizontal and constant in
North-East-Down (m/s). Source: Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion
Control, chapters 2 (kinematics) and 10 (currents).
"""

from math import cos, sin
from typing import NamedTuple

from ...core.arrays import Floats
from ...core.compiled import inlined

STATION_PAIRS = (
    10  # 21 stations along the hull, one amidships (PythonVehicleSimulator crossFlowDrag)
)


# What is known of an attitude: sines and cosines of roll, pitch and yaw.
S_PHI, C_PHI, S_THETA, C_THETA, S_PSI, C_PSI, ANGLES = range(7)


class Current(NamedTuple):
    """A uniform, horizontal current (m/s)."""

    north: float
    east: float


@inlined
def move_rigid_body(state: Floats, angles: Floats, out: Floats) -> None:
    """Write the six rates of position and attitude of a diving body into `out[:6]`.

    `state` begins with x, y, z, phi, theta, psi, u, v, w, p, q, r; its `angles` are written, too.
    Singular at theta = +-90 deg. Source: Fossen 2021 eq. 2.31 and 2.41.
    """
    s_phi, c_phi = sin(state[3]), cos(state[3])
    s_theta, c_theta = sin(state[4]), cos(state[4])
    s_psi, c_psi = sin(state[5]), cos(state[5])
    angles[S_PHI], angles[C_PHI] = s_phi, c_phi
    angles[S_THETA], angles[C_THETA] = s_theta, c_theta
    angles[S_PSI], angles[C_PSI] = s_psi, c_psi
    r12, r22 = c_psi * s_theta * s_phi - s_psi * c_phi, s_psi * s_theta * s_phi + c_psi * c_phi
    r13, r23 = c_psi * s_theta * c_phi + s_psi * s_phi, s_psi * s_theta * c_phi - c_psi * s_phi
    u, v, w, p, q, r = state[6], state[7], state[8], state[9], state[10], state[11]
    out[0] = c_psi * c_theta * u + r12 * v + r13 * w
    out[1] = s_psi * c_theta * u + r22 * v + r23 * w
    out[2] = -s_theta * u + c_theta * (s_phi * v + c_phi * w)
    yaw_rate = (s_phi * q + c_phi * r) / c_theta
    out[3] = p + s_theta * yaw_rate
    out[4] = c_phi * q - s_phi * r
    out[5] = yaw_rate


@inlined
def along_body(current: Current, angles: Floats) -> tuple[float, float, float]:
    """Return a current in body axes (m/s). Source: Fossen 2021 eq. 2.31."""
    s_phi, c_phi = angles[S_PHI], angles[C_PHI]
    s_theta, c_theta = angles[S_THETA], angles[C_THETA]
    s_psi, c_psi = angles[S_PSI], angles[C_PSI]
    r12, r22 = c_psi * s_theta * s_phi - s_psi * c_phi, s_psi * s_theta * s_phi + c_psi * c_phi
    r13, r23 = c_psi * s_theta * c_phi + s_psi * s_phi, s_psi * s_theta * c_phi - c_psi * s_phi
    ahead = c_psi * c_theta * current.north + s_psi * c_theta * current.east
    return ahead, r12 * current.north + r22 * current.east, r13 * current.north + r23 * current.east


@inlined
def move_surface_craft(state: Floats, angles: Floats, out: Floats) -> None:
    """Write the rates of North, East and yaw of a surface craft into `out[:3]`.

    `state` begins with x, y, psi, u, v, r; its `angles` are written, too.
    """
    s_psi, c_psi = sin(state[2]), cos(state[2])
    angles[S_PHI], angles[C_PHI], angles[S_THETA], angles[C_THETA] = 0.0, 1.0, 0.0, 1.0
    angles[S_PSI], angles[C_PSI] = s_psi, c_psi
    u, v = state[3], state[4]
    out[0] = u * c_psi - v * s_psi
    out[1] = u * s_psi + v * c_psi
    out[2] = state[5]


@inlined
def along_level_body(current: Current, angles: Floats) -> tuple[float, float]:
    """Return a current in the body axes of a surface craft (m/s)."""
    s_psi, c_psi = angles[S_PSI], angles[C_PSI]
    ahead = current.north * c_psi + current.east * s_psi
    return ahead, current.east * c_psi - current.north * s_psi


@inlined
def cross_flow(v: float, r: float, length: float) -> tuple[float, float]:
    """Return how hard water crossing the hull pushes: strip sums of |w|w dx and x|w|w dx.

    `v` sway through the water (m/s), `r` yaw rate (rad/s), `length` of the hull (m); w = v + x r.
    The sum of 21 strips, each a whole dx wide (the two at the ends as well), is part of the models
    that use it; it exceeds the integral by 5 % in v and 16 % in r. Strips are taken in pairs about
    amidships so that a hull that does not turn feels exactly no moment.
    """
    width = length / (2 * STATION_PAIRS)
    force, moment = abs(v) * v, 0.0
    for pair in range(1, STATION_PAIRS + 1):
        lever = pair * width
        fore, aft = v + lever * r, v - lever * r
        push_fore, push_aft = abs(fore) * fore, abs(aft) * aft
        force += push_fore + push_aft
        moment += lever * (push_fore - push_aft)
    return force * width, moment * width
