"""BlueROV2 Heavy, a hovering vehicle with eight thrusters, moving in all six degrees of freedom.

State x, y, z, phi, theta, psi, u, v, w, p, q, r (m, rad, m/s, rad/s; velocities over ground in
body axes, origin at the centre of gravity); command the wrench X, Y, Z (N), K, M, N (N m), applied
as given. Course-unstable at every speed and pitch-unstable above 0.5 m/s: it needs its controllers.
Source: von Benzon et al. 2022, An open-source benchmark simulator: control of a BlueROV2 underwater
robot, J. Mar. Sci. Eng. 10(12), Table A1, as transcribed publicly.
"""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled
from .frames import C_PHI, C_THETA, S_PHI, S_THETA, Current, along_body

STATE = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")
COMMAND = ("X", "Y", "Z", "K", "M", "N")


@dataclass(frozen=True)
class BlueRov2:
    """What the BlueROV2 Heavy weighs and displaces, and how the water resists it.

    Units kg, m3, kg/m3, m/s2, m, kg m2, N; added masses positive; `*_drag_linear` N per m/s or
    N m per rad/s, `*_drag_quadratic` the same per square; `cb_above_cg_m` how far the centre of
    buoyancy lies above the centre of gravity. `thruster_limit_n` is the most that one thruster
    gives, for controllers to obey: the equations of motion do not read it.
    """

    # von Benzon et al. 2022, Table A1
    mass_kg: float = 13.5
    volume_m3: float = 0.0134
    cb_above_cg_m: float = 0.01
    roll_inertia_kg_m2: float = 0.26
    pitch_inertia_kg_m2: float = 0.23
    yaw_inertia_kg_m2: float = 0.37
    surge_added_mass_kg: float = 6.36
    sway_added_mass_kg: float = 7.12
    heave_added_mass_kg: float = 18.68
    roll_added_inertia_kg_m2: float = 0.189
    pitch_added_inertia_kg_m2: float = 0.135
    yaw_added_inertia_kg_m2: float = 0.222
    surge_drag_linear: float = 13.7
    sway_drag_linear: float = 0.0
    heave_drag_linear: float = 33.0
    roll_drag_linear: float = 0.0
    pitch_drag_linear: float = 0.8
    yaw_drag_linear: float = 0.0
    surge_drag_quadratic: float = 141.0
    sway_drag_quadratic: float = 217.0
    heave_drag_quadratic: float = 190.0
    roll_drag_quadratic: float = 1.19
    pitch_drag_quadratic: float = 0.47
    yaw_drag_quadratic: float = 1.5
    water_density_kg_per_m3: float = 1025.0  # sea water; transcriptions of the paper use 1000
    gravity_m_per_s2: float = (
        9.81  # standard gravity, rounded; transcriptions of the paper use 9.82
    )
    thruster_limit_n: float = 30.4  # the benchmark's thruster polynomial at full command


(M1, M2, M3, M4, M5, M6, L1, L2, L3, L4, L5, L6, Q1, Q2, Q3, Q4, Q5, Q6, SINKING, RIGHTING,
 SIZE) = range(21)  # fmt: skip


def pack(rov: BlueRov2) -> Floats:
    """Return the vehicle as the compiled equations read it: masses, drags, weights."""
    weight = rov.mass_kg * rov.gravity_m_per_s2
    buoyancy = rov.water_density_kg_per_m3 * rov.gravity_m_per_s2 * rov.volume_m3
    return np.array([
        rov.mass_kg + rov.surge_added_mass_kg,
        rov.mass_kg + rov.sway_added_mass_kg,
        rov.mass_kg + rov.heave_added_mass_kg,
        rov.roll_inertia_kg_m2 + rov.roll_added_inertia_kg_m2,
        rov.pitch_inertia_kg_m2 + rov.pitch_added_inertia_kg_m2,
        rov.yaw_inertia_kg_m2 + rov.yaw_added_inertia_kg_m2,
        rov.surge_drag_linear, rov.sway_drag_linear, rov.heave_drag_linear,
        rov.roll_drag_linear, rov.pitch_drag_linear, rov.yaw_drag_linear,
        rov.surge_drag_quadratic, rov.sway_drag_quadratic, rov.heave_drag_quadratic,
        rov.roll_drag_quadratic, rov.pitch_drag_quadratic, rov.yaw_drag_quadratic,
        weight - buoyancy, buoyancy * rov.cb_above_cg_m,
    ])  # fmt: skip


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Floats, out: Floats
) -> None:
    """Write the rates of the vehicle's velocities into `out[6:]`.

    M (nu_dot - nu_c_dot) = tau - C(nu_r) nu_r - D(nu_r) nu_r - g(eta), with nu_r the velocity
    through the water, M diagonal, C nu_r = [nu2 x h1; nu2 x h2 + nu1 x h1] for the momentum
    h = M nu_r, and nu_c_dot = [-nu2 x nu_c; 0]. Source: Fossen 2021, eq. 6.42 and section 10.3.
    """
    s_phi, c_phi = angles[S_PHI], angles[C_PHI]
    s_theta, c_theta = angles[S_THETA], angles[C_THETA]
    u_c, v_c, w_c = along_body(current, angles)
    u, v, w = state[6] - u_c, state[7] - v_c, state[8] - w_c
    roll, pitch, yaw = state[9], state[10], state[11]
    h1, h2, h3 = p[M1] * u, p[M2] * v, p[M3] * w
    h4, h5, h6 = p[M4] * roll, p[M5] * pitch, p[M6] * yaw
    surge = command[0] - p[SINKING] * s_theta - (pitch * h3 - yaw * h2)
    sway = command[1] + p[SINKING] * c_theta * s_phi - (yaw * h1 - roll * h3)
    heave = command[2] + p[SINKING] * c_theta * c_phi - (roll * h2 - pitch * h1)
    heel = command[3] - p[RIGHTING] * c_theta * s_phi - (pitch * h6 - yaw * h5 + v * h3 - w * h2)
    trim = command[4] - p[RIGHTING] * s_theta - (yaw * h4 - roll * h6 + w * h1 - u * h3)
    turn = command[5] - (roll * h5 - pitch * h4 + u * h2 - v * h1)
    surge -= (p[L1] + p[Q1] * abs(u)) * u
    sway -= (p[L2] + p[Q2] * abs(v)) * v
    heave -= (p[L3] + p[Q3] * abs(w)) * w
    out[6] = surge / p[M1] - (pitch * w_c - yaw * v_c)
    out[7] = sway / p[M2] - (yaw * u_c - roll * w_c)
    out[8] = heave / p[M3] - (roll * v_c - pitch * u_c)
    out[9] = (heel - (p[L4] + p[Q4] * abs(roll)) * roll) / p[M4]
    out[10] = (trim - (p[L5] + p[Q5] * abs(pitch)) * pitch) / p[M5]
    out[11] = (turn - (p[L6] + p[Q6] * abs(yaw)) * yaw) / p[M6]
