"""REMUS-100-class torpedo, 1.6 m long, steered by tail fins: the AUV that maps the sea floor.

State: RIGID, then delta_r, delta_s, n_rpm (m, rad, m/s, rad/s, rad, rpm; velocities over ground in
body axes, origin at the centre of buoyancy).  Command: delta_r, delta_s (rad), n_rpm.  A positive
rudder turns to starboard, a positive stern plane dives. Source, unless a line says otherwise:
PythonVehicleSimulator (Fossen, remus100.py @c717e073), which follows Fossen 2021, section 8.4.2,
and Allen, Vorus & Prestero, OCEANS 2000; with the current entering consistently; `accelerate_pvs`
keeps that program's treatment of currents.

The vehicle follows its path by line of sight.  Its speed is through the water: the propeller turns
evenly, and the current changes the speed over ground.  All loops are scheduled with that speed,
since the force of a fin is proportional to its square.
"""

from dataclasses import dataclass, replace
from math import asin, atan2, cos, exp, hypot, log, pi, radians, sin, sqrt

import numpy as np

from ....support.arrays import Floats
from ....support.compiled import compiled, inlined
from ...records.rows import Row
from ..guidance.sensing import Posture, Sensed, half_turn, within
from ..guidance.tracks import PathPoint
from . import forces
from .forces import Coefficients, Current, Model, Six, Three


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


def lamb_factors(slenderness: float) -> tuple[float, float, float]:
    """Return the added mass of a spheroid along, across and in rotation, over the displaced mass.

    `slenderness` is diameter over length (below 1). Source: Fossen 2021, section 8.4.2 (Lamb 1932).
    """
    e = sqrt(1.0 - slenderness**2)
    ratio = log((1.0 + e) / (1.0 - e))
    along = 2.0 * (1.0 - e**2) / e**3 * (0.5 * ratio - e)
    across = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * ratio
    turning = e**4 * (across - along)
    turning /= (2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (across - along))
    return along / (2.0 - along), across / (2.0 - across), turning


def _derived(remus: Remus100) -> dict[str, float]:
    """Return masses, M^-1, damping, and forces of hull, fins and propeller per unit.

    Raises:
        ValueError: when the hull is too thick or top-heavy.
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
    return {**_masses(remus), **_hull_drag(remus), **_actuators(remus)}


def _masses(remus: Remus100) -> dict[str, float]:
    """Return masses, inverse masses, linear damping and righting moment."""
    a, b, height = remus.length_m / 2.0, remus.diameter_m / 2.0, remus.cg_below_cb_m
    mass = 4.0 / 3.0 * pi * remus.water_density_kg_per_m3 * a * b**2
    roll, pitch = 0.4 * mass * b**2, 0.2 * mass * (a**2 + b**2)  # spheroid about its centre
    along, across, turning = lamb_factors(b / a)
    m11, m22 = mass * (1.0 + along), mass * (1.0 + across)
    m44 = roll * (1.0 + remus.roll_added_inertia_fraction) + mass * height**2
    m55 = pitch * (1.0 + turning) + mass * height**2
    m66 = pitch * (1.0 + turning)
    mz = mass * height
    surge_pitch, sway_roll = m11 * m55 - mz**2, m22 * m44 - mz**2  # determinants of coupled pairs
    righting = mass * remus.gravity_m_per_s2 * height
    return {
        **{"mass": mass, "mz": mz, "across": mass * across, "m44": m44, "m55": m55, "m66": m66},
        **{"i11": m55 / surge_pitch, "i15": -mz / surge_pitch, "i55": m11 / surge_pitch},
        **{"i22": m44 / sway_roll, "i24": mz / sway_roll, "i44": m22 / sway_roll},
        **{"i33": 1.0 / m22, "i66": 1.0 / m66, "righting": righting},
        "lu": m11 / remus.surge_time_constant_s,
        "lv": m22 / remus.sway_time_constant_s,
        "lw": m22 / remus.heave_time_constant_s,
        "lp": 2.0 * remus.roll_damping_ratio * sqrt(righting * m44),
        "lq": 2.0 * remus.pitch_damping_ratio * sqrt(righting * m55),
        "lr": m66 / remus.yaw_time_constant_s,
    }


def _hull_drag(remus: Remus100) -> dict[str, float]:
    """Return lift, drag and cross-flow of the hull."""
    density, diameter = remus.water_density_kg_per_m3, remus.diameter_m
    area = remus.reference_area_fraction * remus.length_m * diameter
    aspect = diameter**2 / area
    slope = pi * aspect / (1.0 + sqrt(1.0 + (aspect / 2.0) ** 2))  # lift per radian of incidence
    return {
        "lift": 0.5 * density * area * slope,
        "drag": 0.5 * density * remus.frontal_drag * pi * (diameter / 2.0) ** 2,
        "induced": 0.5 * density * area * slope**2 / (pi * remus.oswald_efficiency * aspect),
        "cross": 0.5 * density * diameter * remus.cross_flow_drag,
    }


def _actuators(remus: Remus100) -> dict[str, float]:
    """Return the forces of fins and propeller per unit of angle and revolution."""
    density, blade = remus.water_density_kg_per_m3, remus.propeller_diameter_m
    pressure_area = 0.5 * density * remus.fin_area_m2
    given = (1.0 - remus.thrust_deduction) * density * blade**4
    felt = remus.torque_felt_by_hull * density * blade**5
    advance = remus.advance_at_speed * blade
    return {
        "rudder": pressure_area * remus.rudder_lift,
        "plane": pressure_area * remus.stern_plane_lift,
        "stern": remus.length_m / 2.0,
        "wake": 1.0 - remus.wake_fraction,
        "thrust": given * remus.thrust_at_bollard,
        "thrust_slope": given * (remus.thrust_at_speed - remus.thrust_at_bollard) / advance,
        "torque": felt * remus.torque_at_bollard,
        "torque_slope": felt * (remus.torque_at_speed - remus.torque_at_bollard) / advance,
    }


@inlined
def _turned(nu: Six, p: Row) -> Six:
    """Return the Coriolis wrench C(nu_r) nu_r of the hull, with what PVS keeps of the water's.

    Of the added mass only -Z_w w p in sway, Y_v v p in heave and nu2 x (K_p p, M_q q, N_r r)
    remain: PVS deletes the Munk moment.
    """
    u, v, w, roll, pitch, yaw = nu
    momentum = (
        p.mass * u + p.mz * pitch,
        p.mass * v - p.mz * roll,
        p.mass * w,
        p.m44 * roll - p.mz * v,
        p.m55 * pitch + p.mz * u,
        p.m66 * yaw,
    )
    c1, c2, c3, c4, c5, c6 = forces.coriolis(nu, momentum)
    return c1, c2 - p.across * w * roll, c3 + p.across * v * roll, c4, c5, c6


@inlined
def _resistance(nu: Six, p: Row) -> Six:
    """Return the damping wrench: linear, lift and drag in the vertical plane, cross-flow.

    Surge and sway damping fade with speed, where lift and drag take over; heave damping does not.
    """
    u, v, w, roll, pitch, yaw = nu
    speed_squared = u * u + v * v + w * w
    fade = exp(-p.damping_fade_s_per_m * sqrt(speed_squared))
    incidence = atan2(w, u)
    lift = p.lift * incidence * speed_squared
    drag = (p.drag + p.induced * incidence * incidence) * speed_squared
    ahead = sqrt(u * u + w * w)
    c_incidence = u / ahead if ahead > 0.0 else 1.0
    s_incidence = w / ahead if ahead > 0.0 else 0.0
    push, twist = forces.cross_flow(v, yaw, p.length_m)
    return (
        p.lu * fade * u + c_incidence * drag - s_incidence * lift,
        p.lv * fade * v + p.cross * push,
        p.lw * w + s_incidence * drag + c_incidence * lift,
        p.lp * roll,
        p.lq * pitch,
        p.lr * yaw + p.cross * twist,
    )


@inlined
def _propulsion(nu: Six, inflow: float, fins: Three, p: Row) -> Six:
    """Return the wrench of fins and propeller; `inflow` is the propeller's speed of water (m/s)."""
    rudder, plane, revolutions = fins[0], fins[1], fins[2] / 60.0  # rpm -> 1/s
    u, v, w = nu[0], nu[1], nu[2]
    side = p.rudder * (u * u + v * v) * rudder
    lift = p.plane * (u * u + w * w) * plane
    thrust = p.thrust * revolutions * abs(revolutions)
    torque = p.torque * revolutions * abs(revolutions)
    # astern, PVS uses the bollard values at all speeds
    advance = p.wake * inflow * revolutions
    if revolutions > 0.0:
        thrust += p.thrust_slope * advance
        torque += p.torque_slope * advance
    surge = thrust - side * rudder - lift * plane
    return surge, -side, -lift, torque, -p.stern * lift, p.stern * side


@compiled
def _resist(nu: Six, inflow: float, angles: Floats, state: Floats, p: Row, out: Floats) -> None:
    """Write M^-1 of all forces into `out[6:12]`: accelerations but for the current's change."""
    s_phi, s_theta, c_theta = angles[forces.S_PHI], angles[forces.S_THETA], angles[forces.C_THETA]
    fins = (state[12], state[13], state[14])
    pushed, turned, held = _propulsion(nu, inflow, fins, p), _turned(nu, p), _resistance(nu, p)
    surge, sway, heave, roll, pitch, yaw = forces.unbalanced(pushed, turned, held)
    roll -= p.righting * c_theta * s_phi
    pitch -= p.righting * s_theta
    out[6] = p.i11 * surge + p.i15 * pitch
    out[7] = p.i22 * sway + p.i24 * roll
    out[8] = p.i33 * heave
    out[9] = p.i24 * sway + p.i44 * roll
    out[10] = p.i15 * surge + p.i55 * pitch
    out[11] = p.i66 * yaw


@compiled
def _follow(state: Floats, command: Floats, p: Row, out: Floats) -> None:
    """Write the rates of fins and propeller, which lag their clipped commands, to `out[12:15]`."""
    for fin in range(2):
        wanted = min(max(command[fin], -p.fin_limit_rad), p.fin_limit_rad)
        out[12 + fin] = (wanted - state[12 + fin]) / p.fin_time_constant_s
    wanted = min(max(command[2], -p.propeller_limit_rpm), p.propeller_limit_rpm)
    out[14] = (wanted - state[14]) / p.propeller_time_constant_s


@compiled
def accelerate(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Row, out: Floats
) -> None:
    """Write the rates of velocities and actuators into `out[6:]`.

    M (nu_dot - nu_c_dot) = tau - C(nu_r) nu_r - D(nu_r) nu_r - g(eta).  Source: Fossen 2021, eq.
    6.42 and section 10.3.
    """
    water = forces.along_body(current, angles)
    u, v, w = state[6] - water[0], state[7] - water[1], state[8] - water[2]
    nu = (u, v, w, state[9], state[10], state[11])
    _resist(nu, sqrt(u * u + v * v + w * w), angles, state, p, out)
    forces.carry_along(state, water, out)
    _follow(state, command, p, out)


@compiled
def accelerate_pvs(
    state: Floats, angles: Floats, command: Floats, current: Current, p: Row, out: Floats
) -> None:
    """Write the rates as PythonVehicleSimulator computes them: the current ignores roll and pitch.

    The inflow of its propeller is the speed over ground.  Equal to :func:`accelerate` in still
    water only.
    """
    u, v, w, yaw = state[6], state[7], state[8], state[11]
    u_c, v_c = forces.along_level_body(current, angles)
    nu = (u - u_c, v - v_c, w, state[9], state[10], yaw)
    _resist(nu, sqrt(u * u + v * v + w * w), angles, state, p, out)
    out[6] += yaw * v_c
    out[7] -= yaw * u_c
    _follow(state, command, p, out)


LOOKAHEAD = 10.0  # m, six lengths of the vehicle (Fossen 2021, section 12.4: three or more)
LEARNING = 0.1  # of the largest adaptation that does not overshoot, (U / 2 lookahead)^2
CRAB_MEMORY = 1.0  # s over which the measured crab angle is averaged
LARGEST_CRAB = 1.0  # rad
LEAD = 0.4  # s, lag of fin and yaw: the vehicle begins a turn this much before the path does
# rad/s: well above line of sight (U / lookahead), for the hull's sideslip follows slowly
YAW_FREQUENCY, YAW_DAMPING = 2.0, 1.0
PITCH_FREQUENCY, PITCH_DAMPING = 1.2, 0.9  # rad/s: the hull's own is 0.9 rad/s
DEPTH_FREQUENCY = 0.2  # rad/s, a sixth of the pitch loop's
STEEPEST = np.radians(20.0)  # demanded pitch
SPEED_GAIN, SPEED_INTEGRAL = 10.0, 1.0  # 1/s per m/s, 1/s2 per m/s: 600 rpm per m/s
SLOWEST = 0.3  # m/s, the least speed of the fins' schedule, which is singular at rest
FIN_SHARE = 0.9  # of the planes for holding the demanded pitch; the rest damps

# Memory of the controller: the propeller's revolutions in trim (1/s), set at the start; averaged
# crab angle (rad), drift learnt by line of sight (m/s north and east), depth integral (rad),
# propeller integral (1/s), last demanded rudder (rad)
_NUMBERS = ("trim", "crab", "north", "east", "pitch", "turns", "rudder")
MEMORY = np.dtype([(name, "f8") for name in _NUMBERS])


def _revolutions(hull: Coefficients, speed: float) -> float:
    """Return the revolutions (1/s) that keep a speed through the water (m/s) straight ahead.

    Root of thrust = drag: T n^2 + T' (1 - w) U n = (D e^(-a U) + Q U) U.
    """
    drag = (hull.lu * exp(-hull.damping_fade_s_per_m * speed) + hull.drag * speed) * speed
    slope = hull.thrust_slope * hull.wake * speed
    return float((sqrt(slope**2 + 4.0 * hull.thrust * drag) - slope) / (2.0 * hull.thrust))


def _begin(
    hull: Coefficients, speed: float, current: Floats, missed: float, memory: Row, state: Floats
) -> None:
    """Start at cruise speed, drifting with the current, with the propeller in trim.

    The bow begins on the path, not yet against the current.
    """
    c_yaw, s_yaw = cos(state[5]), sin(state[5])
    state[6] = speed + c_yaw * current[0] + s_yaw * current[1]
    state[7] = c_yaw * current[1] - s_yaw * current[0]
    memory["trim"] = _revolutions(hull, speed)
    state[14] = 60.0 * memory["trim"]


@compiled
def _heading(
    sensed: Sensed, aim: PathPoint, speed: float, interval: float, learns: bool, memory: Row
) -> float:
    """Return the heading (rad) that leads back onto the path.

    psi_d = psi_p - beta - atan(y_e / lookahead) - asin(w_n / U): beta is the averaged crab angle,
    course less heading; w is the drift that is left, learnt from the cross-track error as a
    velocity in North-East, so that it is valid on the lane back as well: w_dot = gamma lookahead
    y_e / sqrt(lookahead^2 + y_e^2) n.  Source: adaptive line of sight, Fossen 2023, IEEE Trans.
    Control Systems Technology 31(6); its integral form is due to Borhaug et al. 2008.
    """
    cross, path_yaw = aim.cross, aim.yaw
    course = atan2(sensed.log_e + sensed.set_e, sensed.log_n + sensed.set_n)
    crab = half_turn(course - sensed.posture.yaw)
    memory.crab += interval / CRAB_MEMORY * (within(crab, LARGEST_CRAB) - memory.crab)
    c_path, s_path = aim.cosine, aim.sine
    range_ = hypot(LOOKAHEAD, cross)
    if learns:
        rate = LEARNING * (speed / (2.0 * LOOKAHEAD)) ** 2 * LOOKAHEAD * cross / range_
        memory.north -= interval * rate * s_path
        memory.east += interval * rate * c_path
        size = hypot(memory.north, memory.east)
        if size > 0.5 * speed:
            memory.north *= 0.5 * speed / size
            memory.east *= 0.5 * speed / size
    aside = memory.east * c_path - memory.north * s_path
    learnt = asin(within(aside / speed, 0.5))
    heading: float = path_yaw - memory.crab - atan2(cross, LOOKAHEAD) - learnt
    return heading


@compiled
def _planes(
    posture: Posture, depth: float, speed: float, authority: float, most: float, interval: float,
    p: Row, memory: Row,
) -> float:  # fmt: skip
    """Return the stern plane angle (rad) that leads to the depth (m) by a demanded pitch.

    theta_d = w_z (z - z_d) / U + integral.  The planes cancel the hull's righting and damping
    moments in pitch and replace them by those of a well damped motion.  The integral stops while
    the pitch is limited.
    """
    pitch_limit = min(STEEPEST, FIN_SHARE * authority * most / p.righting)
    deep = posture.depth - depth
    wanted = DEPTH_FREQUENCY * deep / speed + memory.pitch
    pitch = within(wanted, pitch_limit)
    if wanted == pitch:
        memory.pitch += interval * DEPTH_FREQUENCY**2 / (4.0 * speed) * deep
    stiff = p.m55 * PITCH_FREQUENCY**2
    damping = 2.0 * PITCH_DAMPING * PITCH_FREQUENCY * p.m55 - p.lq
    moment = stiff * (posture.pitch - pitch) + damping * posture.pitching
    moment -= p.righting * posture.s_pitch
    planes: float = moment / authority
    return planes


@compiled
def steer(
    sensed: Sensed, aim: PathPoint, turning: float, order: Row, interval: float, p: Row,
    memory: Row, command: Floats,
) -> bool:  # fmt: skip
    """Write rudder, stern planes (rad) and rpm that move the vehicle along its path.

    Its course follows from the log and the current that the log misses, as fixes reveal it;
    `turning` is the path's yaw rate (rad/s) LEAD ahead; the ordered speed (m/s) is through the
    water.  Returns whether rudder, planes or propeller was saturated.
    """
    posture, ahead, aside = sensed.posture, sensed.log_ahead, sensed.log_aside
    scheduled = max(ahead, SLOWEST)
    most = p.fin_limit_rad
    rudder_authority = p.stern * p.rudder * (scheduled * scheduled + aside * aside)
    # line of sight does not learn from an error while the rudder is saturated
    heading = _heading(sensed, aim, order.speed, interval, abs(memory.rudder) <= most, memory)
    _, twist = forces.cross_flow(aside, turning, p.length_m)
    acceleration = YAW_FREQUENCY**2 * half_turn(heading - posture.yaw)
    acceleration += 2.0 * YAW_DAMPING * YAW_FREQUENCY * (turning - posture.turning)
    moment = p.m66 * acceleration + p.lr * turning + p.cross * twist
    rudder = moment / rudder_authority
    memory.rudder = rudder
    plane_authority = p.stern * p.plane * scheduled * scheduled
    planes = _planes(posture, order.depth, scheduled, plane_authority, most, interval, p, memory)
    slow = order.speed - ahead
    turns = 60.0 * (memory.trim + SPEED_GAIN * slow + memory.turns)
    fastest = p.propeller_limit_rpm
    if 0.0 <= turns <= fastest:
        memory.turns += SPEED_INTEGRAL * interval * slow
    command[0], command[1] = within(rudder, most), within(planes, most)
    command[2] = min(max(turns, 0.0), fastest)  # never astern, where the model is not valid
    full: bool = abs(rudder) > most or abs(planes) > most or turns > fastest
    return full


COMMANDS = ("delta_r", "delta_s", "n_rpm")
MODEL = Model(
    "remus100", forces.REMUS100, (*forces.RIGID, *COMMANDS), COMMANDS, Remus100, _derived,
    full_ahead=lambda hull: [0.0, 0.0, hull.propeller_limit_rpm],
    step_s=0.1,  # it takes its time
    settling_step_s=0.05,
    begin=_begin,
    hard_over=lambda hull, speed: [hull.fin_limit_rad, 0.0, 60.0 * _revolutions(hull, speed)],
)  # fmt: skip
PVS = replace(MODEL, name="remus100_pvs", equations=forces.REMUS100_PVS)
