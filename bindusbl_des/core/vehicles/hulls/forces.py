"""Equations of motion that all hulls share: M nu_dot + C(nu) nu + D(nu) nu + g(eta) = tau (Fossen).

eta is position and attitude (North-East-Down; yaw clockwise from North), nu the velocity in body
axes (x forward, y starboard, z down; m/s, rad/s).  A state holds nu over ground; forces depend on
nu_r, the velocity through the water, whose current is uniform, horizontal and constant.  Each hull
adds its coefficients, damping D and thrust tau.  AUVs have six degrees of freedom, ASVs three
(surge, sway, yaw).  Source: Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control,
chapters 2 (kinematics), 3, 6 and 10 (currents).
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from math import cos, sin
from types import SimpleNamespace
from typing import Any, NamedTuple

from ....support.arrays import Floats
from ....support.compiled import inlined
from ...records.rows import Row

REMUS100, REMUS100_PVS, BLUEROV2, OTTER, CYBERSHIP2 = range(5)  # equations by number

RIGID = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")
IN_PLANE = ("x", "y", "psi", "u", "v", "r")
PITCHING_STATE = len(RIGID)  # states this long or longer hold a pitch angle, in place 4

# 21 stations along the hull, one amidships (PythonVehicleSimulator crossFlowDrag)
STATION_PAIRS = 10

# Columns of an attitude's `angles`: sines and cosines of roll, pitch and yaw.
S_PHI, C_PHI, S_THETA, C_THETA, S_PSI, C_PSI, ANGLES = range(7)

Three = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]

# Coefficients of one hull by name, for Python; compiled equations read a row of them.
Coefficients = SimpleNamespace


class Current(NamedTuple):
    """A uniform, horizontal current (m/s)."""

    north: float
    east: float


class MovedVehicle(NamedTuple):
    """Work arrays of a vehicle during integration.

    `state` and `command`; `angles` and `rates` of the state; the `total` of a step's rates; the
    `probe` state at which a stage evaluates them.
    """

    state: Floats
    command: Floats
    angles: Floats
    rates: Floats
    total: Floats
    probe: Floats


@dataclass(frozen=True)
class Model:
    """A vehicle model: its equations by number, the columns of its states and commands, its
    steering.

    `body` is the frozen parameter set; `derive` returns further coefficients.  `full_ahead` is the
    command for full speed straight ahead.  `step_s` (s) is the integration step of missions,
    `settling_step_s` that of settling to a steady state.

    A model that follows paths has `begin`, which writes its memory and state at a speed (m/s) in a
    current (m/s), of which its log misses a share.  It has either `smallest_turn`, the radius (m)
    at a speed (m/s), or `hard_over`, the command of its tightest circle: the latter cannot stop,
    keeps its speed through the water, and circles at the end of its path.  A model that keeps a
    station stays in a watch circle (m).
    """

    name: str
    equations: int
    states: tuple[str, ...]
    commands: tuple[str, ...]
    body: type[Any]
    derive: Callable[[Any], Mapping[str, float]]
    full_ahead: Callable[[Coefficients], list[float]]
    step_s: float
    settling_step_s: float
    begin: Callable[[Coefficients, float, Floats, float, Row, Floats], None] | None = None
    smallest_turn: Callable[[Coefficients, float], float] | None = None
    hard_over: Callable[[Coefficients, float], list[float]] | None = None
    watch_circle_m: float = 0.0

    @property
    def heading(self) -> int:
        """The index of yaw in a state."""
        return self.states.index("psi")

    @property
    def velocity(self) -> slice:
        """The indices of body velocities over ground in a state."""
        return slice(
            self.states.index("u"), self.states.index("w" if "w" in self.states else "v") + 1
        )

    @property
    def autopilot(self) -> str:
        """The field of the autopilot's memory: the name of the hull, for any of its equations."""
        return self.name.removesuffix("_pvs")

    @property
    def follows(self) -> bool:
        """Whether the model follows paths; otherwise it keeps a station."""
        return self.begin is not None

    @property
    def cannot_stop(self) -> bool:
        """Whether the vehicle steers only while it moves through the water."""
        return self.hard_over is not None

    def coefficients(self, body: Any) -> Coefficients:
        """Return all coefficients that the equations read, from a parameter set."""
        return SimpleNamespace(**asdict(body), **self.derive(body))


def masses_in_plane(body: Any) -> dict[str, float]:
    """Return masses (kg, kg m, kg m2) of a surface craft, added ones included, and M^-1."""
    m11 = body.mass_kg + body.surge_added_mass_kg
    m22 = body.mass_kg + body.sway_added_mass_kg
    m23 = body.mass_kg * body.cg_forward_m + getattr(body, "sway_yaw_added_kg_m", 0.0)
    m33 = body.yaw_inertia_kg_m2 + body.yaw_added_inertia_kg_m2
    determinant = m22 * m33 - m23 * m23
    inverse = {"i22": m33 / determinant, "i23": -m23 / determinant, "i33": m22 / determinant}
    return {"m11": m11, "m22": m22, "m23": m23, **inverse}


@inlined
def move_rigid_body(state: Floats, angles: Floats, out: Floats) -> None:
    """Write the six rates of position and attitude of a submerged body to `out[:6]`, and `angles`.

    `state` begins with RIGID.  Singular at theta = +-90 deg.  Source: Fossen 2021 eq. 2.31 and
    2.41.
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
def along_body(current: Current, angles: Floats) -> Three:
    """Return a current in body axes (m/s). Source: Fossen 2021 eq. 2.31."""
    s_phi, c_phi = angles[S_PHI], angles[C_PHI]
    s_theta, c_theta = angles[S_THETA], angles[C_THETA]
    s_psi, c_psi = angles[S_PSI], angles[C_PSI]
    r12, r22 = c_psi * s_theta * s_phi - s_psi * c_phi, s_psi * s_theta * s_phi + c_psi * c_phi
    r13, r23 = c_psi * s_theta * c_phi + s_psi * s_phi, s_psi * s_theta * c_phi - c_psi * s_phi
    ahead = c_psi * c_theta * current.north + s_psi * c_theta * current.east
    return ahead, r12 * current.north + r22 * current.east, r13 * current.north + r23 * current.east


@inlined
def coriolis(nu: Six, momentum: Six) -> Six:
    """Return C(nu) nu = [nu2 x h1; nu2 x h2 + nu1 x h1] for the momentum h = M nu."""
    u, v, w, roll, pitch, yaw = nu
    h1, h2, h3, h4, h5, h6 = momentum
    return (
        pitch * h3 - yaw * h2,
        yaw * h1 - roll * h3,
        roll * h2 - pitch * h1,
        pitch * h6 - yaw * h5 + v * h3 - w * h2,
        yaw * h4 - roll * h6 + w * h1 - u * h3,
        roll * h5 - pitch * h4 + u * h2 - v * h1,
    )


@inlined
def unbalanced(tau: Six, turned: Six, damped: Six) -> Six:
    """Return tau - C nu - D nu."""
    return (
        tau[0] - turned[0] - damped[0],
        tau[1] - turned[1] - damped[1],
        tau[2] - turned[2] - damped[2],
        tau[3] - turned[3] - damped[3],
        tau[4] - turned[4] - damped[4],
        tau[5] - turned[5] - damped[5],
    )


@inlined
def carry_along(state: Floats, current: Three, out: Floats) -> None:
    """Add nu_c_dot = [-nu2 x nu_c; 0] to the rates of velocities.

    The current nu_c (m/s, body axes) changes as the axes rotate.  Source: Fossen 2021, section
    10.3.
    """
    u_c, v_c, w_c = current
    roll, pitch, yaw = state[9], state[10], state[11]
    out[6] -= pitch * w_c - yaw * v_c
    out[7] -= yaw * u_c - roll * w_c
    out[8] -= roll * v_c - pitch * u_c


@inlined
def move_surface_craft(state: Floats, angles: Floats, out: Floats) -> None:
    """Write the rates of North, East and yaw of a surface craft into `out[:3]`, and its `angles`.

    `state` begins with IN_PLANE.
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
def accelerate_in_plane(
    state: Floats, current: tuple[float, float], tau: Three, damped: Three, further: Three,
    p: Row, out: Floats,
) -> None:  # fmt: skip
    """Write the rates of a surface craft's velocities into `out[3:6]`.

    M (nu_dot - nu_c_dot) = tau - C(nu_r) nu_r - D(nu_r) nu_r, the damping in two parts; `current`
    is in body axes (m/s), nu_c_dot as in :func:`carry_along`.
    """
    u_c, v_c = current
    u, v, r = state[3] - u_c, state[4] - v_c, state[5]
    c13, c23 = -(p.m22 * v + p.m23 * r), p.m11 * u
    surge = tau[0] - c13 * r - damped[0] - further[0]
    sway = tau[1] - c23 * r - damped[1] - further[1]
    yaw = tau[2] + c13 * u + c23 * v - damped[2] - further[2]
    out[3] = surge / p.m11 + r * v_c
    out[4] = p.i22 * sway + p.i23 * yaw - r * u_c
    out[5] = p.i23 * sway + p.i33 * yaw


@inlined
def cross_flow(v: float, r: float, length: float) -> tuple[float, float]:
    """Return the strip sums of |w| w dx and x |w| w dx of water that crosses the hull.

    w = v + x r, with sway `v` through the water (m/s), yaw rate `r` (rad/s) and `length` (m).  The
    sum of 21 strips, each a whole dx wide (also the two at the ends), is part of the models that
    use it; it exceeds the integral by 5 % in v and 16 % in r.  Strips are added in pairs about
    amidships, so that a hull that does not turn has exactly no moment.
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
