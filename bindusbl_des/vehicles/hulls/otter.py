"""Otter, a two-metre catamaran on two propellers: the surface vehicle that listens to the AUVs.

State x, y, psi, u, v, r, n1, n2 (m, rad, m/s, rad/s; velocities over ground in body axes; n1 port
and n2 starboard propeller, rad/s); command n1, n2 (rad/s). Moves in the horizontal plane; has no
way to push sideways. Source: reduction to three degrees of freedom of the Otter of
PythonVehicleSimulator (Fossen, otter.py @c717e073), Munk moment kept.
"""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled
from .frames import Current, along_level_body, cross_flow

STATE = ("x", "y", "psi", "u", "v", "r", "n1", "n2")
COMMAND = ("n1", "n2")


@dataclass(frozen=True)
class Otter:
    """What the Otter weighs, how the water resists her and what her propellers give.

    Units kg, m, kg m2, N, rad/s; added masses positive; `*_drag_linear` N per m/s or N m per
    rad/s; `yaw_drag_quadratic` N m s2/rad2; `thrust_*` N s2/rad2.
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


(M11, M22, M23, I22, I23, I33, XU, YV, NR, NRR, LENGTH, STRIP, LEVER, AHEAD, ASTERN, FASTEST,
 SLOWEST, LAG, SIZE) = range(19)  # fmt: skip


def pack(otter: Otter) -> Floats:
    """Return the Otter as the compiled equations read her: masses, inverse masses, drags."""
    m11 = otter.mass_kg + otter.surge_added_mass_kg
    m22 = otter.mass_kg + otter.sway_added_mass_kg
    m23 = otter.mass_kg * otter.cg_forward_m
    m33 = otter.yaw_inertia_kg_m2 + otter.yaw_added_inertia_kg_m2
    determinant = m22 * m33 - m23 * m23
    strip = 0.5 * otter.water_density_kg_per_m3 * otter.draught_m * otter.cross_flow_drag
    return np.array([
        m11, m22, m23, m33 / determinant, -m23 / determinant, m22 / determinant,
        otter.surge_drag_linear, otter.sway_drag_linear,
        otter.yaw_drag_linear, otter.yaw_drag_quadratic,
        otter.length_m, strip, otter.propeller_lever_m, otter.thrust_ahead, otter.thrust_astern,
        otter.propeller_limit_ahead_rad_per_s, -otter.propeller_limit_astern_rad_per_s,
        otter.propeller_time_constant_s,
    ])  # fmt: skip


@compiled
def _thrust(n: float, p: Floats) -> float:
    """Return the bollard pull (N) of one propeller at n (rad/s)."""
    given: float = (p[AHEAD] if n > 0.0 else p[ASTERN]) * n * abs(n)
    return given


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Floats, out: Floats
) -> None:
    """Write the rates of the Otter's velocities and propellers into `out[3:]`.

    M (nu_dot - nu_c_dot) = tau - C(nu_r) nu_r - D(nu_r) nu_r - cross-flow drag, with nu_r the
    velocity through the water; propellers follow their clipped command with a first-order lag.
    """
    u_c, v_c = along_level_body(current, angles)
    u, v, r = state[3] - u_c, state[4] - v_c, state[5]
    port, starboard = _thrust(state[6], p), _thrust(state[7], p)
    push, twist = cross_flow(v, r, p[LENGTH])
    c13, c23 = -(p[M22] * v + p[M23] * r), p[M11] * u
    surge = port + starboard - c13 * r - p[XU] * u
    sway = -c23 * r - p[YV] * v - p[STRIP] * push
    yaw = p[LEVER] * (port - starboard) + c13 * u + c23 * v
    yaw -= (p[NR] + p[NRR] * abs(r)) * r + p[STRIP] * twist
    out[3] = surge / p[M11] + r * v_c
    out[4] = p[I22] * sway + p[I23] * yaw - r * u_c
    out[5] = p[I23] * sway + p[I33] * yaw
    for side in range(2):
        wanted = min(max(command[side], p[SLOWEST]), p[FASTEST])
        out[6 + side] = (wanted - state[6 + side]) / p[LAG]
