"""How a REMUS-100 is flown along a path: line of sight, rudder, stern planes and propeller.

Its speed is through the water: the propeller turns evenly and the current makes it faster or slower
over ground. All loops are scheduled with that speed, since a fin's force goes with its square.
"""

from math import asin, atan2, cos, exp, hypot, sin, sqrt

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled
from ...records.rows import Row
from ..hulls import remus100 as hull
from ..hulls.frames import cross_flow
from .sensing import Posture, Sensed, half_turn, within
from .tracks import PathPoint

LOOKAHEAD = 10.0  # m, six lengths of the vehicle (Fossen 2021, section 12.4: three or more)
LEARNING = 0.1  # of the largest adaptation that does not overshoot, (U / 2 lookahead)^2
CRAB_MEMORY = 1.0  # s over which the measured crab angle is averaged
LARGEST_CRAB = 1.0  # rad
LEAD = 0.4  # s, fin and yaw: the turn is begun this much before the path's
# rad/s: well above line of sight (U / lookahead), for the hull's sideslip follows slowly
YAW_FREQUENCY, YAW_DAMPING = 2.0, 1.0
PITCH_FREQUENCY, PITCH_DAMPING = 1.2, 0.9  # rad/s: the hull's own is 0.9 rad/s
DEPTH_FREQUENCY = 0.2  # rad/s, a sixth of the pitch loop's
STEEPEST = np.radians(20.0)  # demanded pitch
SPEED_GAIN, SPEED_INTEGRAL = 10.0, 1.0  # 1/s per m/s, 1/s2 per m/s: 600 rpm per m/s
SLOWEST = 0.3  # m/s at which fins are still scheduled; below, they would be asked for infinity
FIN_SHARE = 0.9  # of the planes for holding the demanded pitch; the rest damps

# What the controller is told at first, the propeller's revolutions in trim (1/s), and what it
# remembers: averaged crab angle (rad), what line of sight has learnt (m/s north and east), depth
# integral (rad), propeller integral (1/s), rudder asked for last (rad)
_NUMBERS = ("trim", "crab", "north", "east", "pitch", "turns", "rudder")
MEMORY = np.dtype([(name, "f8") for name in _NUMBERS])


def revolutions(speed: float, p: Floats) -> float:
    """Return the revolutions (1/s) that keep a speed through the water (m/s) straight ahead.

    Root of thrust = drag: T n^2 + T' (1 - w) U n = (D e^(-a U) + Q U) U.
    """
    drag = (p[hull.LU] * exp(-p[hull.FADE] * speed) + p[hull.DRAG] * speed) * speed
    slope = p[hull.THRUST_SLOPE] * p[hull.WAKE] * speed
    turns = (sqrt(slope**2 + 4.0 * p[hull.THRUST] * drag) - slope) / (2.0 * p[hull.THRUST])
    return float(turns)


def begin(speed: float, current: Floats, p: Floats, state: Floats) -> None:
    """Start at cruise speed, drifting with the current, the propeller in trim; writes `state`.

    A vehicle that crosses the current begins with its bow on its path, not yet against the current.
    """
    c_yaw, s_yaw = cos(state[5]), sin(state[5])
    state[6] = speed + c_yaw * current[0] + s_yaw * current[1]
    state[7] = c_yaw * current[1] - s_yaw * current[0]
    state[14] = 60.0 * revolutions(speed, p)


@compiled
def _heading(
    sensed: Sensed, aim: PathPoint, speed: float, interval: float, learns: bool, memory: Row
) -> float:
    """Return the heading (rad) that leads back onto the path.

    psi_d = psi_p - beta - atan(y_e / lookahead) - asin(w_n / U): beta the crab angle, course less
    heading, averaged; w what is still carrying the vehicle off, learnt from the cross-track error
    as a velocity in North-East, so that it holds on the lane back as well: w_dot = gamma lookahead
    y_e / sqrt(lookahead^2 + y_e^2) n. Source: adaptive line of sight, Fossen 2023, IEEE Trans.
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
    p: Floats, memory: Row,
) -> float:  # fmt: skip
    """Return the stern plane angle (rad) that leads to the depth (m); pitch aims at it.

    theta_d = w_z (z - z_d) / U + integral; planes cancel the hull's righting and damping in pitch
    and put a well damped motion in their place. The integral waits while the pitch is limited.
    """
    pitch_limit = min(STEEPEST, FIN_SHARE * authority * most / p[hull.RIGHTING])
    deep = posture.depth - depth
    wanted = DEPTH_FREQUENCY * deep / speed + memory.pitch
    pitch = within(wanted, pitch_limit)
    if wanted == pitch:
        memory.pitch += interval * DEPTH_FREQUENCY**2 / (4.0 * speed) * deep
    stiff = p[hull.M55] * PITCH_FREQUENCY**2
    damping = 2.0 * PITCH_DAMPING * PITCH_FREQUENCY * p[hull.M55] - p[hull.LQ]
    moment = stiff * (posture.pitch - pitch) + damping * posture.pitching
    moment -= p[hull.RIGHTING] * posture.s_pitch
    planes: float = moment / authority
    return planes


@compiled
def steer(
    sensed: Sensed, aim: PathPoint, turning: float, order: Row, interval: float, p: Floats,
    memory: Row, command: Floats,
) -> bool:  # fmt: skip
    """Write rudder, stern planes (rad) and rpm that carry the vehicle along its path.

    The course that it believes to make good is what its log measures and the current that the log
    misses, as far as fixes have shown; `turning` is the path's yaw rate (rad/s) LEAD ahead; the
    speed (m/s) ordered is that through the water. Returns whether rudder, planes or propeller was
    saturated.
    """
    posture, ahead, aside = sensed.posture, sensed.log_ahead, sensed.log_aside
    scheduled = max(ahead, SLOWEST)
    most = p[hull.FIN_LIMIT]
    rudder_authority = p[hull.STERN] * p[hull.RUDDER] * (scheduled * scheduled + aside * aside)
    # line of sight learns nothing from an error that the rudder could not mend
    heading = _heading(sensed, aim, order.speed, interval, abs(memory.rudder) <= most, memory)
    _, twist = cross_flow(aside, turning, p[hull.LENGTH])
    acceleration = YAW_FREQUENCY**2 * half_turn(heading - posture.yaw)
    acceleration += 2.0 * YAW_DAMPING * YAW_FREQUENCY * (turning - posture.turning)
    moment = p[hull.M66] * acceleration + p[hull.LR] * turning + p[hull.CROSS] * twist
    rudder = moment / rudder_authority
    memory.rudder = rudder
    plane_authority = p[hull.STERN] * p[hull.PLANE] * scheduled * scheduled
    planes = _planes(posture, order.depth, scheduled, plane_authority, most, interval, p, memory)
    slow = order.speed - ahead
    turns = 60.0 * (memory.trim + SPEED_GAIN * slow + memory.turns)
    fastest = p[hull.PROP_LIMIT]
    if 0.0 <= turns <= fastest:
        memory.turns += SPEED_INTEGRAL * interval * slow
    command[0], command[1] = within(rudder, most), within(planes, most)
    command[2] = min(max(turns, 0.0), fastest)  # never astern: its drag is not a fish's any more
    full: bool = abs(rudder) > most or abs(planes) > most or turns > fastest
    return full
