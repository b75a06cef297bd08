"""REMUS-100-class torpedo, 1.6 m long, steered by tail fins: the AUV that maps the sea floor.

State x, y, z, phi, theta, psi, u, v, w, p, q, r, delta_r, delta_s, n_rpm (m, rad, m/s, rad/s, rad,
rpm; velocities over ground in body axes, origin at the centre of buoyancy); command delta_r,
delta_s (rad), n_rpm. A positive rudder turns to starboard, a positive stern plane dives.
Source, unless a line says otherwise: PythonVehicleSimulator (Fossen, remus100.py @c717e073), which
follows Fossen 2021, section 8.4.2, and Allen, Vorus & Prestero, OCEANS 2000; with the current
entering consistently; `accelerate_pvs` keeps that program's own way with currents.
"""

from dataclasses import dataclass
from math import atan2, exp, log, pi, radians, sqrt

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled, inlined
from .frames import C_THETA, S_PHI, S_THETA, Current, along_body, along_level_body, cross_flow

STATE = (
    "x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r",
    "delta_r", "delta_s", "n_rpm",
)  # fmt: skip
COMMAND = ("delta_r", "delta_s", "n_rpm")

Wrench = tuple[float, float, float, float, float, float]
Velocity = tuple[float, float, float, float, float, float]  # through the water, body axes


@dataclass(frozen=True)
class Remus100:
    """A neutrally buoyant spheroid with a rudder, stern planes and one propeller.

    Units m, kg/m3, m/s2, s, m2, rad, rpm; coefficients without a unit in their name are
    dimensionless. Mass, inertia and added mass follow from length, diameter and water density.
    """

    length_m: float = 1.6
    diameter_m: float = 0.19
    cg_below_cb_m: float = 0.02
    water_density_kg_per_m3: float = 1026.0
    gravity_m_per_s2: float = 9.81
    roll_added_inertia_fraction: float = 0.3
    # linear damping: times in which a free motion dies, and damping ratios of the pendulum
    surge_time_constant_s: float = 20.0
    sway_time_constant_s: float = 20.0
    heave_time_constant_s: float = 20.0
    yaw_time_constant_s: float = 1.0  # the turning radius hangs on it: 1 s gives 30 m at 0.6 m/s
    roll_damping_ratio: float = 0.3
    pitch_damping_ratio: float = 0.8
    damping_fade_s_per_m: float = 3.0  # surge and sway damping fade as exp(-3 s/m times speed)
    # lift and drag: reference area 70 % of length times diameter, Oswald efficiency of the hull
    reference_area_fraction: float = 0.7
    frontal_drag: float = 0.42  # Allen et al. 2000
    oswald_efficiency: float = 0.7
    cross_flow_drag: float = 1.1977288  # Hoerner's curve at half beam over draught 0.5
    # fins at the stern
    fin_area_m2: float = 0.0133  # two of 0.00665
    rudder_lift: float = 0.5
    stern_plane_lift: float = 0.7
    fin_limit_rad: float = radians(15.0)
    fin_time_constant_s: float = 0.1
    # propeller: Wageningen B series, 3 blades, area ratio 0.718, lines through advance 0 and 0.6632
    propeller_diameter_m: float = 0.14
    thrust_at_bollard: float = 0.4566
    thrust_at_speed: float = 0.1798
    torque_at_bollard: float = 0.0700
    torque_at_speed: float = 0.0312
    advance_at_speed: float = 0.6632
    wake_fraction: float = 0.056  # Allen et al. 2000: water reaches the propeller at 0.944 U
    thrust_deduction: float = 0.1
    torque_felt_by_hull: float = 0.1
    propeller_limit_rpm: float = 1525.0
    propeller_time_constant_s: float = 1.0


# Where each number lies in the vector that the compiled equations read.
(MASS, MZ, A22, A33, M44, M55, M66, I11, I15, I55, I22, I24, I44, I33, I66, LU, LV, LW, LP, LQ, LR,
 FADE, RIGHTING, LIFT, DRAG, INDUCED, CROSS, LENGTH, RUDDER, PLANE, STERN, FIN_LIMIT, FIN_LAG, WAKE,
 THRUST, THRUST_SLOPE, TORQUE, TORQUE_SLOPE, PROP_LIMIT, PROP_LAG, SIZE) = range(41)  # fmt: skip


def lamb_factors(slenderness: float) -> tuple[float, float, float]:
    """Return the added mass of a spheroid along, across and in turning, over that of its water.

    `slenderness` is diameter over length (below 1). Source: Fossen 2021, section 8.4.2 (Lamb 1932).
    """
    e = sqrt(1.0 - slenderness**2)
    ratio = log((1.0 + e) / (1.0 - e))
    along = 2.0 * (1.0 - e**2) / e**3 * (0.5 * ratio - e)
    across = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * ratio
    turning = e**4 * (across - along)
    turning /= (2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (across - along))
    return along / (2.0 - along), across / (2.0 - across), turning


def pack(remus: Remus100) -> Floats:
    """Return the vehicle as the compiled equations read it; ValueError if too thick or
    top-heavy.
    """
    if remus.diameter_m >= remus.length_m:
        raise ValueError(
            f"remus100: diameter_m {remus.diameter_m} must be below length_m {remus.length_m}: "
            "the hull is a slender spheroid"
        )
    if remus.cg_below_cb_m < 0.0:
        raise ValueError(
            f"remus100: cg_below_cb_m {remus.cg_below_cb_m} must not be negative: the hull would "
            "turn over"
        )
    p = np.zeros(SIZE)
    _pack_inertia(remus, p)
    _pack_hull(remus, p)
    _pack_actuators(remus, p)
    return p


def _pack_inertia(remus: Remus100, p: Floats) -> None:
    """Write masses, inverse masses, linear damping and righting moment."""
    a, b, height = remus.length_m / 2.0, remus.diameter_m / 2.0, remus.cg_below_cb_m
    mass = 4.0 / 3.0 * pi * remus.water_density_kg_per_m3 * a * b**2
    roll, pitch = 0.4 * mass * b**2, 0.2 * mass * (a**2 + b**2)  # spheroid about its centre
    along, across, turning = lamb_factors(b / a)
    m11, m22 = mass * (1.0 + along), mass * (1.0 + across)
    m44 = roll * (1.0 + remus.roll_added_inertia_fraction) + mass * height**2
    m55 = pitch * (1.0 + turning) + mass * height**2
    m66 = pitch * (1.0 + turning)
    p[MASS], p[MZ], p[A22], p[A33] = mass, mass * height, mass * across, mass * across
    p[M44], p[M55], p[M66] = m44, m55, m66
    surge_pitch = m11 * m55 - p[MZ] ** 2  # determinants of the two coupled pairs
    sway_roll = m22 * m44 - p[MZ] ** 2
    p[I11], p[I15], p[I55] = m55 / surge_pitch, -p[MZ] / surge_pitch, m11 / surge_pitch
    p[I22], p[I24], p[I44] = m44 / sway_roll, p[MZ] / sway_roll, m22 / sway_roll
    p[I33], p[I66] = 1.0 / m22, 1.0 / m66
    p[RIGHTING] = mass * remus.gravity_m_per_s2 * height
    p[LU] = m11 / remus.surge_time_constant_s
    p[LV] = m22 / remus.sway_time_constant_s
    p[LW] = m22 / remus.heave_time_constant_s
    p[LP] = 2.0 * remus.roll_damping_ratio * sqrt(p[RIGHTING] * m44)
    p[LQ] = 2.0 * remus.pitch_damping_ratio * sqrt(p[RIGHTING] * m55)
    p[LR] = m66 / remus.yaw_time_constant_s
    p[FADE] = remus.damping_fade_s_per_m


def _pack_hull(remus: Remus100, p: Floats) -> None:
    """Write lift, drag and cross-flow of the hull."""
    density, diameter = remus.water_density_kg_per_m3, remus.diameter_m
    area = remus.reference_area_fraction * remus.length_m * diameter
    aspect = diameter**2 / area
    slope = pi * aspect / (1.0 + sqrt(1.0 + (aspect / 2.0) ** 2))  # lift per radian of incidence
    p[LIFT] = 0.5 * density * area * slope
    p[DRAG] = 0.5 * density * remus.frontal_drag * pi * (diameter / 2.0) ** 2
    p[INDUCED] = 0.5 * density * area * slope**2 / (pi * remus.oswald_efficiency * aspect)
    p[CROSS] = 0.5 * density * diameter * remus.cross_flow_drag
    p[LENGTH] = remus.length_m


def _pack_actuators(remus: Remus100, p: Floats) -> None:
    """Write what fins and propeller give per unit of angle and revolution."""
    density, blade = remus.water_density_kg_per_m3, remus.propeller_diameter_m
    pressure_area = 0.5 * density * remus.fin_area_m2
    p[RUDDER], p[PLANE] = pressure_area * remus.rudder_lift, pressure_area * remus.stern_plane_lift
    p[STERN] = remus.length_m / 2.0
    p[FIN_LIMIT], p[FIN_LAG] = remus.fin_limit_rad, remus.fin_time_constant_s
    p[WAKE] = 1.0 - remus.wake_fraction
    given = (1.0 - remus.thrust_deduction) * density * blade**4
    felt = remus.torque_felt_by_hull * density * blade**5
    advance = remus.advance_at_speed * blade
    p[THRUST] = given * remus.thrust_at_bollard
    p[THRUST_SLOPE] = given * (remus.thrust_at_speed - remus.thrust_at_bollard) / advance
    p[TORQUE] = felt * remus.torque_at_bollard
    p[TORQUE_SLOPE] = felt * (remus.torque_at_speed - remus.torque_at_bollard) / advance
    p[PROP_LIMIT], p[PROP_LAG] = remus.propeller_limit_rpm, remus.propeller_time_constant_s


@inlined
def _inertia(nu: Velocity, p: Floats) -> Wrench:
    """Return the Coriolis wrench C(nu_r) nu_r: all of the hull's, what PVS keeps of the water's.

    Hull: [nu2 x h1; nu2 x h2 + nu1 x h1] for its momentum h. Of the added mass only -Z_w w p in
    sway, Y_v v p in heave and nu2 x (K_p p, M_q q, N_r r) remain: PVS deletes the Munk moment.
    """
    u, v, w, roll, pitch, yaw = nu
    h1 = p[MASS] * u + p[MZ] * pitch
    h2 = p[MASS] * v - p[MZ] * roll
    h3 = p[MASS] * w
    h4 = p[M44] * roll - p[MZ] * v
    h5 = p[M55] * pitch + p[MZ] * u
    h6 = p[M66] * yaw
    return (
        pitch * h3 - yaw * h2,
        yaw * h1 - roll * h3 - p[A33] * w * roll,
        roll * h2 - pitch * h1 + p[A22] * v * roll,
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
    fade = exp(-p[FADE] * sqrt(speed_squared))
    incidence = atan2(w, u)
    lift = p[LIFT] * incidence * speed_squared
    drag = (p[DRAG] + p[INDUCED] * incidence * incidence) * speed_squared
    ahead = sqrt(u * u + w * w)
    c_incidence = u / ahead if ahead > 0.0 else 1.0
    s_incidence = w / ahead if ahead > 0.0 else 0.0
    push, twist = cross_flow(v, yaw, p[LENGTH])
    return (
        p[LU] * fade * u + c_incidence * drag - s_incidence * lift,
        p[LV] * fade * v + p[CROSS] * push,
        p[LW] * w + s_incidence * drag + c_incidence * lift,
        p[LP] * roll,
        p[LQ] * pitch,
        p[LR] * yaw + p[CROSS] * twist,
    )


@inlined
def _propulsion(nu: Velocity, inflow: float, fins: tuple[float, float, float], p: Floats) -> Wrench:
    """Return what fins and propeller give; `inflow` is the speed (m/s) that feeds the propeller."""
    rudder, plane, revolutions = fins[0], fins[1], fins[2] / 60.0  # rpm -> 1/s
    u, v, w = nu[0], nu[1], nu[2]
    side = p[RUDDER] * (u * u + v * v) * rudder
    lift = p[PLANE] * (u * u + w * w) * plane
    thrust = p[THRUST] * revolutions * abs(revolutions)
    torque = p[TORQUE] * revolutions * abs(revolutions)
    # astern, PVS lets the bollard values hold at all speeds
    advance = p[WAKE] * inflow * revolutions
    if revolutions > 0.0:
        thrust += p[THRUST_SLOPE] * advance
        torque += p[TORQUE_SLOPE] * advance
    surge = thrust - side * rudder - lift * plane
    return surge, -side, -lift, torque, -p[STERN] * lift, p[STERN] * side


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
    roll = pushed[3] - turned[3] - held[3] - p[RIGHTING] * c_theta * s_phi
    pitch = pushed[4] - turned[4] - held[4] - p[RIGHTING] * s_theta
    yaw = pushed[5] - turned[5] - held[5]
    out[6] = p[I11] * surge + p[I15] * pitch
    out[7] = p[I22] * sway + p[I24] * roll
    out[8] = p[I33] * heave
    out[9] = p[I24] * sway + p[I44] * roll
    out[10] = p[I15] * surge + p[I55] * pitch
    out[11] = p[I66] * yaw


@compiled
def _follow(state: Floats, command: Floats, p: Floats, out: Floats) -> None:
    """Write how fins and propeller follow their clipped commands into `out[12:15]`."""
    for fin in range(2):
        wanted = min(max(command[fin], -p[FIN_LIMIT]), p[FIN_LIMIT])
        out[12 + fin] = (wanted - state[12 + fin]) / p[FIN_LAG]
    wanted = min(max(command[2], -p[PROP_LIMIT]), p[PROP_LIMIT])
    out[14] = (wanted - state[14]) / p[PROP_LAG]


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
