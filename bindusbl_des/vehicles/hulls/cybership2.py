"""CyberShip II, a 1:70 model of a supply ship in a towing tank, moving in the horizontal plane.

State x, y, psi, u, v, r (m, rad, m/s, rad/s; velocities over ground in body axes); command surge
force (N), sway force (N), yaw moment (N m). Course-unstable: a straight run amplifies round-off.
Source: Skjetne, Smogeli & Fossen 2004, Modeling, Identification and Control 25(1).
"""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled
from .frames import Current, along_level_body

STATE = ("x", "y", "psi", "u", "v", "r")
COMMAND = ("tau_u", "tau_v", "tau_r")


@dataclass(frozen=True)
class CyberShip2:
    """What CyberShip II weighs and how the water resists it.

    Units kg, kg m2, m; added masses positive. Drag coefficients are forces (N) or moments (N m)
    per power of m/s and rad/s, positive where they resist; `sway_drag_by_yaw_rate` and the like
    are the cross terms Y_r, Y_|r|v, Y_|v|r, Y_|r|r and their moments N_*.
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


(M11, M22, M23, I22, I23, I33, XU, XUU, XUUU, YV, YVV, YRV, YR, YVR, YRR, NV, NVV, NRV, NR, NVR,
 NRR, SIZE) = range(22)  # fmt: skip


def pack(ship: CyberShip2) -> Floats:
    """Return the ship as the compiled equations read her: masses, inverse masses, drags."""
    m11 = ship.mass_kg + ship.surge_added_mass_kg
    m22 = ship.mass_kg + ship.sway_added_mass_kg
    m23 = ship.mass_kg * ship.cg_forward_m + ship.sway_yaw_added_kg_m
    m33 = ship.yaw_inertia_kg_m2 + ship.yaw_added_inertia_kg_m2
    determinant = m22 * m33 - m23 * m23
    return np.array([
        m11, m22, m23, m33 / determinant, -m23 / determinant, m22 / determinant,
        ship.surge_drag_linear, ship.surge_drag_quadratic, ship.surge_drag_cubic,
        ship.sway_drag_linear, ship.sway_drag_quadratic, ship.sway_drag_turning,
        ship.sway_drag_by_yaw_rate, ship.sway_drag_by_yaw_rate_drifting,
        ship.sway_drag_by_yaw_rate_quadratic,
        ship.yaw_drag_by_sway, ship.yaw_drag_by_sway_quadratic, ship.yaw_drag_by_sway_turning,
        ship.yaw_drag_linear, ship.yaw_drag_drifting, ship.yaw_drag_quadratic,
    ])  # fmt: skip


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Floats, out: Floats
) -> None:
    """Write the rates of the ship's velocities into `out[3:]`.

    M (nu_dot - nu_c_dot) = tau - C(nu_r) nu_r - D(nu_r) nu_r, with nu_r the velocity through the
    water and nu_c_dot the current's apparent change in turning axes (Fossen 2021, section 10.3).
    """
    u_c, v_c = along_level_body(current, angles)
    u, v, r = state[3] - u_c, state[4] - v_c, state[5]
    au, av, ar = abs(u), abs(v), abs(r)
    c13, c23 = -(p[M22] * v + p[M23] * r), p[M11] * u
    d11 = p[XU] + p[XUU] * au + p[XUUU] * u * u
    d22 = p[YV] + p[YVV] * av + p[YRV] * ar
    d23 = p[YR] + p[YVR] * av + p[YRR] * ar
    d32 = p[NV] + p[NVV] * av + p[NRV] * ar
    d33 = p[NR] + p[NVR] * av + p[NRR] * ar
    surge = command[0] - c13 * r - d11 * u
    sway = command[1] - c23 * r - d22 * v - d23 * r
    yaw = command[2] + c13 * u + c23 * v - d32 * v - d33 * r
    out[3] = surge / p[M11] + r * v_c
    out[4] = p[I22] * sway + p[I23] * yaw - r * u_c
    out[5] = p[I23] * sway + p[I33] * yaw
