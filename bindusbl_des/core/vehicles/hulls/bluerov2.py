"""BlueROV2 Heavy, a hovering vehicle with eight thrusters, controlled by velocity.

State: RIGID (m, rad, m/s, rad/s; velocities over ground in body axes, origin at the centre of
gravity).  Command: the wrench X, Y, Z (N), K, M, N (N m), applied as given.  The hull is
course-unstable at every speed and pitch-unstable above 0.5 m/s: it needs its controllers. Source:
von Benzon et al. 2022, An open-source benchmark simulator: control of a BlueROV2 underwater robot,
J. Mar. Sci. Eng. 10(12), Table A1, as transcribed publicly (thruster positions, too).

The vehicle heads along its path, not its course: sway carries it against the current.  Thrust is
shared among the axes before it is commanded; the integrator of an axis that gets less than it wants
stops.  Gains: own design, checked at 5 to 50 Hz in currents up to 0.2 m/s.
"""

from dataclasses import dataclass
from math import cos, hypot, sin, sqrt

import numpy as np

from ....support.arrays import Floats
from ....support.compiled import compiled
from ...records.rows import Row
from ..guidance.sensing import Sensed, half_turn, within
from ..guidance.tracks import PathPoint
from . import forces
from .forces import Coefficients, Current, Model


@dataclass(frozen=True)
class BlueRov2:
    """Mass, buoyancy, inertia and damping of the BlueROV2 Heavy.

    Units kg, m3, kg/m3, m/s2, m, kg m2, N; added masses positive; `*_drag_linear` N per m/s or N m
    per rad/s, `*_drag_quadratic` the same per square; `cb_above_cg_m` is the height of the centre
    of buoyancy above the centre of gravity.  `thruster_limit_n` is the largest thrust of one
    thruster, for controllers: the equations of motion do not read it.
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


AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def _derived(rov: BlueRov2) -> dict[str, float]:
    """Return masses m1 to m6, weight less buoyancy (N), and righting moment (N m)."""
    weight = rov.mass_kg * rov.gravity_m_per_s2
    buoyancy = rov.water_density_kg_per_m3 * rov.gravity_m_per_s2 * rov.volume_m3
    linear = {
        f"m{axis}": rov.mass_kg + getattr(rov, f"{name}_added_mass_kg")
        for axis, name in enumerate(AXES[:3], 1)
    }
    turning = {
        f"m{axis}": getattr(rov, f"{name}_inertia_kg_m2")
        + getattr(rov, f"{name}_added_inertia_kg_m2")
        for axis, name in enumerate(AXES[3:], 4)
    }
    righting = buoyancy * rov.cb_above_cg_m
    return {**linear, **turning, "sinking": weight - buoyancy, "righting": righting}


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Row, out: Floats
) -> None:
    """Write the rates of the vehicle's velocities into `out[6:]`.

    M (nu_dot - nu_c_dot) = tau - C(nu_r) nu_r - D(nu_r) nu_r - g(eta), with M diagonal.
    Source: Fossen 2021, eq. 6.42 and section 10.3.
    """
    s_phi, c_phi = angles[forces.S_PHI], angles[forces.C_PHI]
    s_theta, c_theta = angles[forces.S_THETA], angles[forces.C_THETA]
    water = forces.along_body(current, angles)
    u, v, w = state[6] - water[0], state[7] - water[1], state[8] - water[2]
    roll, pitch, yaw = state[9], state[10], state[11]
    nu = u, v, w, roll, pitch, yaw
    momentum = p.m1 * u, p.m2 * v, p.m3 * w, p.m4 * roll, p.m5 * pitch, p.m6 * yaw
    tau = (
        command[0] - p.sinking * s_theta,
        command[1] + p.sinking * c_theta * s_phi,
        command[2] + p.sinking * c_theta * c_phi,
        command[3] - p.righting * c_theta * s_phi,
        command[4] - p.righting * s_theta,
        command[5],
    )
    damped = (
        (p.surge_drag_linear + p.surge_drag_quadratic * abs(u)) * u,
        (p.sway_drag_linear + p.sway_drag_quadratic * abs(v)) * v,
        (p.heave_drag_linear + p.heave_drag_quadratic * abs(w)) * w,
        (p.roll_drag_linear + p.roll_drag_quadratic * abs(roll)) * roll,
        (p.pitch_drag_linear + p.pitch_drag_quadratic * abs(pitch)) * pitch,
        (p.yaw_drag_linear + p.yaw_drag_quadratic * abs(yaw)) * yaw,
    )
    turned = forces.coriolis(nu, momentum)
    surge, sway, heave, heel, trim, turn = forces.unbalanced(tau, turned, damped)
    out[6], out[7], out[8] = surge / p.m1, sway / p.m2, heave / p.m3
    out[9], out[10], out[11] = heel / p.m4, trim / p.m5, turn / p.m6
    forces.carry_along(state, water, out)


# Newtons of one thruster that a newton or newton metre of each axis costs: 1 / (4 c), c = cos 45
# deg, across; 1 / (4 arm) in the turns (arms 0.1888, 0.218, 0.12 m); a quarter in heave
PER_PUSH, PER_YAW, PER_HEAVE, PER_ROLL, PER_PITCH = 0.35355, 1.32416, 0.25, 1.14679, 2.08333
THRUSTER_DEPTH = 0.085  # m below the centre of gravity
# Shares of a thruster that yaw and sway, pitch and roll may take; surge and heave get the rest
YAW_SHARE, SWAY_SHARE, PITCH_SHARE, ROLL_SHARE = 0.5, 0.5, 0.75, 0.15

ACCELERATION = 0.15  # m/s2, how the demanded speed grows from rest
LOOKAHEAD = 1.0  # m, the distance in which a cross-track error is steered out
# Share of the ordered speed: if fixes show less speed over ground along the path, the vehicle
# pushes harder against the current
LEAST_HEADWAY = 0.5
STOPPING = 0.5  # 1/s: at the path's end, speed is this times the distance left
BACKING = 0.2  # m/s, fastest return to an end overshot
SURGE_GAIN, SWAY_GAIN = 40.0, 80.0  # N per m/s
SURGE_INTEGRAL, SWAY_INTEGRAL = 15.0, 40.0  # N/s per m/s
YAW_GAIN, YAW_RATE_GAIN, YAW_INTEGRAL, YAW_INTEGRAL_LIMIT = 2.4, 1.8, 0.3, 2.0  # N m, rad, s
DEPTH_GAIN, DEPTH_RATE_GAIN, DEPTH_INTEGRAL, DEPTH_INTEGRAL_LIMIT = 40.0, 30.0, 6.0, 20.0  # N, m, s
ROLL_GAIN, ROLL_RATE_GAIN = 8.0, 3.0  # N m, rad, s
PITCH_GAIN, PITCH_RATE_GAIN = 12.0, 3.0  # N m, rad, s; the hull alone is unstable above 0.5 m/s

# Memory of the controller: integrators (N north, N east, N m, N) and the demanded speed (m/s)
MEMORY = np.dtype([(name, "f8") for name in ("north", "east", "turn", "sink", "speed")])


def _begin(
    hull: Coefficients, speed: float, current: Floats, missed: float, memory: Row, state: Floats
) -> None:
    """Start at rest over ground, or in the water if the log sees only that, in vertical trim."""
    c_yaw, s_yaw = cos(state[5]), sin(state[5])
    north, east = missed * current
    state[6], state[7] = c_yaw * north + s_yaw * east, c_yaw * east - s_yaw * north
    memory["sink"] = -hull.sinking


@compiled
def share_thrust(wanted: Floats, most: float, given: Floats) -> tuple[bool, bool, bool, bool, bool]:
    """Write to `given` (6,) what the thrusters can give of the wrench `wanted` X..N (N, N m).

    No thruster exceeds `most` (N): the sums below are the thrust of the hardest working thruster of
    each plane.  Returns whether surge, sway, heave, yaw, and roll or pitch got less than wanted.
    """
    given[5] = within(wanted[5], YAW_SHARE * most / PER_YAW)
    left = most - PER_YAW * abs(given[5])
    given[1] = within(wanted[1], min(SWAY_SHARE * most, left) / PER_PUSH)
    left -= PER_PUSH * abs(given[1])
    given[0] = within(wanted[0], max(left, 0.0) / PER_PUSH)
    # horizontal thrusters sit low: their push pitches and rolls, and the vertical ones answer
    pitching = THRUSTER_DEPTH * given[0]
    rolling = THRUSTER_DEPTH * given[1]
    pitch = within(wanted[4] - pitching, PITCH_SHARE * most / PER_PITCH)
    roll = within(wanted[3] + rolling, ROLL_SHARE * most / PER_ROLL)
    left = most - PER_PITCH * abs(pitch) - PER_ROLL * abs(roll)
    given[2] = within(wanted[2], max(left, 0.0) / PER_HEAVE)
    given[4], given[3] = pitch + pitching, roll - rolling
    short = pitch != wanted[4] - pitching or roll != wanted[3] + rolling
    return (
        given[0] != wanted[0],
        given[1] != wanted[1],
        given[2] != wanted[2],
        given[5] != wanted[5],
        short,
    )


@compiled
def steer(
    sensed: Sensed, aim: PathPoint, order: Row, interval: float, p: Row, memory: Row,
    work: Floats, command: Floats,
) -> bool:  # fmt: skip
    """Write the wrench that moves the vehicle along its path at the ordered speed (m/s) by log.

    Wanted velocity: U (cos d t - sin d n) - w_n n, d = atan(y_e / lookahead), along the path's
    tangent t and normal n (line of sight, Fossen 2021, section 12.4); w is the current that the log
    misses, as fixes reveal it.  Velocity errors are fed back in the heading frame and integrated in
    North-East, so that integrators keep their value in a turn.  `work` is (6,).  Returns whether an
    axis was saturated.
    """
    posture, cross, left = sensed.posture, aim.cross, aim.left
    c_path, s_path = aim.cosine, aim.sine
    along = sensed.set_n * c_path + sensed.set_e * s_path
    across = sensed.set_e * c_path - sensed.set_n * s_path
    memory.speed = min(memory.speed + ACCELERATION * interval, order.speed)
    ahead = min(memory.speed, max(STOPPING * left, -BACKING))
    offset = hypot(LOOKAHEAD, cross)
    made = max(ahead + along, LEAST_HEADWAY * ahead)  # over ground along the path, when on it
    forward, aside = (made - along) * LOOKAHEAD / offset, -ahead * cross / offset - across
    if STOPPING * left < memory.speed:  # about to hover: towards the end, whatever the bearing
        forward, aside = ahead - along, -within(STOPPING * cross, order.speed) - across
    c_yaw, s_yaw = posture.c_yaw, posture.s_yaw
    turn = aim.yaw - posture.yaw
    s_turn, c_turn = sin(turn), cos(turn)
    wanted_u = forward * c_turn - aside * s_turn
    wanted_v = forward * s_turn + aside * c_turn
    error_u = wanted_u - (sensed.log_n * c_yaw + sensed.log_e * s_yaw)
    error_v = wanted_v - (sensed.log_e * c_yaw - sensed.log_n * s_yaw)
    u, v, yaw_error = sensed.log_ahead, sensed.log_aside, half_turn(turn)
    turning = aim.bend * made
    push = SURGE_GAIN * error_u + memory.north * c_yaw + memory.east * s_yaw
    push += (p.surge_drag_linear + p.surge_drag_quadratic * abs(wanted_u)) * wanted_u
    side = SWAY_GAIN * error_v + memory.east * c_yaw - memory.north * s_yaw
    side += (
        p.sway_drag_linear + p.sway_drag_quadratic * abs(wanted_v)
    ) * wanted_v + p.m1 * u * turning
    twist = YAW_GAIN * yaw_error + YAW_RATE_GAIN * (turning - posture.turning) + memory.turn
    twist += p.yaw_drag_quadratic * abs(turning) * turning + (p.m2 - p.m1) * u * v
    deeper = order.depth - posture.depth
    sink = DEPTH_GAIN * deeper - DEPTH_RATE_GAIN * sensed.sinking + memory.sink
    s_roll, c_roll = posture.s_roll, posture.c_roll
    s_pitch, c_pitch = posture.s_pitch, posture.c_pitch
    lean = s_pitch * push + c_pitch * sink
    work[0] = c_pitch * push - s_pitch * sink
    work[1] = c_roll * side + s_roll * lean
    work[2] = c_roll * lean - s_roll * side
    work[3] = -ROLL_GAIN * posture.roll - ROLL_RATE_GAIN * posture.rolling
    work[4] = -PITCH_GAIN * posture.pitch - PITCH_RATE_GAIN * posture.pitching
    work[5] = twist
    surge, sway, heave, yaw, tilt = share_thrust(work, p.thruster_limit_n, command)
    # the integrator of a saturated axis stops
    grow_u = 0.0 if surge else SURGE_INTEGRAL * error_u * interval
    grow_v = 0.0 if sway else SWAY_INTEGRAL * error_v * interval
    memory.north += c_yaw * grow_u - s_yaw * grow_v
    memory.east += s_yaw * grow_u + c_yaw * grow_v
    if not yaw:
        memory.turn = within(memory.turn + YAW_INTEGRAL * yaw_error * interval,
                               YAW_INTEGRAL_LIMIT)  # fmt: skip
    if not heave:
        memory.sink = within(memory.sink + DEPTH_INTEGRAL * deeper * interval,
                               DEPTH_INTEGRAL_LIMIT)  # fmt: skip
    return surge or sway or heave or yaw or tilt


# At the beginning of the tightest turn, the heading lags by at most this (rad)
HEADING_LAG = 0.13  # 7.5 deg, at which a push along the path leaves it by an eighth of itself


def smallest_turn(p: Coefficients, speed: float) -> float:
    """Return the radius (m) of the tightest circle that the vehicle follows at a speed (m/s).

    The largest of three: where the centripetal force needs the whole share of sway, where drag in
    yaw needs the share of yaw, and where the sudden beginning of a circle leaves the heading behind
    by HEADING_LAG.  A yaw loop with natural frequency w and damping z lags behind a step in yaw
    rate by at most rate / w exp(-z / sqrt(1 - z^2) acos z).
    """
    sideways = p.m1 * speed**2 * PER_PUSH / (SWAY_SHARE * p.thruster_limit_n)
    yaw_rate = (
        sqrt(YAW_SHARE * p.thruster_limit_n / PER_YAW / p.yaw_drag_quadratic)
        if p.yaw_drag_quadratic > 0.0
        else np.inf
    )
    frequency = sqrt(YAW_GAIN / p.m6)
    damping = min(YAW_RATE_GAIN / (2.0 * sqrt(YAW_GAIN * p.m6)), 0.999)
    lag = np.exp(-damping / sqrt(1.0 - damping**2) * np.arccos(damping)) / frequency
    return float(max(sideways, speed / yaw_rate, lag * speed / HEADING_LAG))


MODEL = Model(
    "bluerov2", forces.BLUEROV2, forces.RIGID, ("X", "Y", "Z", "K", "M", "N"), BlueRov2, _derived,
    full_ahead=lambda hull: [
        *(hull.thruster_limit_n / PER_PUSH, 0.0, -hull.sinking), *(0.0, 0.0, 0.0)
    ],
    step_s=0.05,
    settling_step_s=0.05,
    begin=_begin,
    smallest_turn=smallest_turn,
)  # fmt: skip
