"""REMUS-100-class torpedo, 1.6 m long, steered by tail fins: the AUV that maps the sea floor.

State x, y, z, phi, theta, psi, u, v, w, p, q, r, delta_r, delta_s, n_rpm (m, rad, m/s, rad/s, rad,
rpm; velocities over ground in body axes, origin at the centre of buoyancy); command delta_r,
delta_s (rad), n_rpm. A positive rudder turns to starboard, a positive stern plane dives.
Source: force model of PythonVehicleSimulator (Fossen, remus100.py @c717e073), with the current
entering consistently; `derivative_pvs` keeps that program's own way with currents.
"""

from math import atan2, exp, sqrt

from ...core.arrays import Floats
from ...core.compiled import compiled, inlined
from . import remus100_parameters as at
from .frames import C_THETA, S_PHI, S_THETA, Current, along_body, along_level_body, cross_flow

STATE = (
    "x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r",
    "delta_r", "delta_s", "n_rpm",
)  # fmt: skip
COMMAND = ("delta_r", "delta_s", "n_rpm")

Wrench = tuple[float, float, float, float, float, float]
Velocity = tuple[float, float, float, float, float, float]  # through the water, body axes


@inlined
def _inertia(nu: Velocity, p: Floats) -> Wrench:
    """Return the Coriolis wrench C(nu_r) nu_r: all of the hull's, what PVS keeps of the water's.

    Hull: [nu2 x h1; nu2 x h2 + nu1 x h1] for its momentum h. Of the added mass only -Z_w w p in
    sway, Y_v v p in heave and nu2 x (K_p p, M_q q, N_r r) remain: PVS deletes the Munk moment.
    """
    u, v, w, roll, pitch, yaw = nu
    h1 = p[at.MASS] * u + p[at.MZ] * pitch
    h2 = p[at.MASS] * v - p[at.MZ] * roll
    h3 = p[at.MASS] * w
    h4 = p[at.M44] * roll - p[at.MZ] * v
    h5 = p[at.M55] * pitch + p[at.MZ] * u
    h6 = p[at.M66] * yaw
    return (
        pitch * h3 - yaw * h2,
        yaw * h1 - roll * h3 - p[at.A33] * w * roll,
        roll * h2 - pitch * h1 + p[at.A22] * v * roll,
        pitch * h6 - yaw * h5 + v * h3 - w * h2,
        yaw * h4 - roll * h6 + w * h1 - u * h3,
        roll * h5 - pitch * h4 + u * h2 - v * h1,
    )


@inlined
def _resistance(nu: Velocity, p: Floats) -> Wrench:
    """Return what resists: linear damping, lift and drag in the vertical plane, cross-flow.

    Surge and sway damping fade with speed, where lift and drag take over; heave damping does not.
    """
    u, v, w, roll, pitch, yaw = nu
    speed_squared = u * u + v * v + w * w
    fade = exp(-p[at.FADE] * sqrt(speed_squared))
    incidence = atan2(w, u)
    lift = p[at.LIFT] * incidence * speed_squared
    drag = (p[at.DRAG] + p[at.INDUCED] * incidence * incidence) * speed_squared
    ahead = sqrt(u * u + w * w)
    c_incidence = u / ahead if ahead > 0.0 else 1.0
    s_incidence = w / ahead if ahead > 0.0 else 0.0
    push, twist = cross_flow(v, yaw, p[at.LENGTH])
    return (
        p[at.LU] * fade * u + c_incidence * drag - s_incidence * lift,
        p[at.LV] * fade * v + p[at.CROSS] * push,
        p[at.LW] * w + s_incidence * drag + c_incidence * lift,
        p[at.LP] * roll,
        p[at.LQ] * pitch,
        p[at.LR] * yaw + p[at.CROSS] * twist,
    )


@inlined
def _propulsion(nu: Velocity, inflow: float, fins: tuple[float, float, float], p: Floats) -> Wrench:
    """Return what fins and propeller give; `inflow` is the speed (m/s) that feeds the propeller."""
    rudder, plane, revolutions = fins[0], fins[1], fins[2] / 60.0  # rpm -> 1/s
    u, v, w = nu[0], nu[1], nu[2]
    side = p[at.RUDDER] * (u * u + v * v) * rudder
    lift = p[at.PLANE] * (u * u + w * w) * plane
    thrust = p[at.THRUST] * revolutions * abs(revolutions)
    torque = p[at.TORQUE] * revolutions * abs(revolutions)
    # astern, PVS lets the bollard values hold at all speeds
    advance = p[at.WAKE] * inflow * revolutions
    if revolutions > 0.0:
        thrust += p[at.THRUST_SLOPE] * advance
        torque += p[at.TORQUE_SLOPE] * advance
    surge = thrust - side * rudder - lift * plane
    return surge, -side, -lift, torque, -p[at.STERN] * lift, p[at.STERN] * side


@compiled
def _resist(
    nu: Velocity, inflow: float, angles: Floats, state: Floats, p: Floats, out: Floats
) -> None:
    """Write M^-1 of all forces into `out[6:12]`: accelerations as if the water stood still."""
    s_phi, s_theta, c_theta = angles[S_PHI], angles[S_THETA], angles[C_THETA]
    fins = (state[12], state[13], state[14])
    pushed, turned, held = _propulsion(nu, inflow, fins, p), _inertia(nu, p), _resistance(nu, p)
    surge = pushed[0] - turned[0] - held[0]
    sway = pushed[1] - turned[1] - held[1]
    heave = pushed[2] - turned[2] - held[2]
    roll = pushed[3] - turned[3] - held[3] - p[at.RIGHTING] * c_theta * s_phi
    pitch = pushed[4] - turned[4] - held[4] - p[at.RIGHTING] * s_theta
    yaw = pushed[5] - turned[5] - held[5]
    out[6] = p[at.I11] * surge + p[at.I15] * pitch
    out[7] = p[at.I22] * sway + p[at.I24] * roll
    out[8] = p[at.I33] * heave
    out[9] = p[at.I24] * sway + p[at.I44] * roll
    out[10] = p[at.I15] * surge + p[at.I55] * pitch
    out[11] = p[at.I66] * yaw


@compiled
def _follow(state: Floats, command: Floats, p: Floats, out: Floats) -> None:
    """Write how fins and propeller follow their clipped commands into `out[12:15]`."""
    for fin in range(2):
        wanted = min(max(command[fin], -p[at.FIN_LIMIT]), p[at.FIN_LIMIT])
        out[12 + fin] = (wanted - state[12 + fin]) / p[at.FIN_LAG]
    wanted = min(max(command[2], -p[at.PROP_LIMIT]), p[at.PROP_LIMIT])
    out[14] = (wanted - state[14]) / p[at.PROP_LAG]


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Floats, out: Floats
) -> None:
    """Write the rates of velocities and actuators into `out[6:]`; all forces are of the water.

    M (nu_dot - nu_c_dot) = tau - C(nu_r) nu_r - D(nu_r) nu_r - g(eta), nu_c_dot = [-nu2 x nu_c; 0].
    Source: Fossen 2021, eq. 6.42 and section 10.3.
    """
    u_c, v_c, w_c = along_body(current, angles)
    roll, pitch, yaw = state[9], state[10], state[11]
    nu = (state[6] - u_c, state[7] - v_c, state[8] - w_c, roll, pitch, yaw)
    inflow = sqrt(nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2])
    _resist(nu, inflow, angles, state, p, out)
    out[6] -= pitch * w_c - yaw * v_c
    out[7] -= yaw * u_c - roll * w_c
    out[8] -= roll * v_c - pitch * u_c
    _follow(state, command, p, out)


@compiled
def accelerate_pvs(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Floats, out: Floats
) -> None:
    """Write the rates as PythonVehicleSimulator has them: the current ignores roll and pitch.

    Its propeller is fed by the speed over ground. Equal to `derivative` in still water only.
    """
    u, v, w, yaw = state[6], state[7], state[8], state[11]
    u_c, v_c = along_level_body(current, angles)
    nu = (u - u_c, v - v_c, w, state[9], state[10], yaw)
    _resist(nu, sqrt(u * u + v * v + w * w), angles, state, p, out)
    out[6] += yaw * v_c
    out[7] -= yaw * u_c
    _follow(state, command, p, out)
