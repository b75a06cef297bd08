"""How a BlueROV2 Heavy is flown along a path: eight thrusters, one velocity at a time.

It points along the path, not along its course: sway carries it against the current. Its thrusters
are shared out before anything is commanded, and what an axis cannot get its integrator is not told.
Thruster positions: von Benzon et al. 2022, Table A1, as transcribed publicly; gains: own design,
checked at 5 to 50 Hz in currents up to 0.2 m/s.
"""

from math import cos, hypot, sin, sqrt

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled
from ...records.rows import Row
from ..hulls import bluerov2 as hull
from .sensing import Sensed, half_turn, within
from .tracks import PathPoint

# Newtons of one thruster that a newton or newton metre of each axis costs: 1 / (4 c), c = cos 45
# deg, across; 1 / (4 arm) in the turns (arms 0.1888, 0.218, 0.12 m); a quarter in heave
PER_PUSH, PER_YAW, PER_HEAVE, PER_ROLL, PER_PITCH = 0.35355, 1.32416, 0.25, 1.14679, 2.08333
THRUSTER_DEPTH = 0.085  # m below the centre of gravity
# Shares of a thruster that yaw and sway, pitch and roll may take; surge and heave get the rest
YAW_SHARE, SWAY_SHARE, PITCH_SHARE, ROLL_SHARE = 0.5, 0.5, 0.75, 0.15

ACCELERATION = 0.15  # m/s2, how the demanded speed grows from rest
LOOKAHEAD = 1.0  # m, the distance in which a cross-track error is steered out
# Of the speed asked for: where fixes show that less of it is made along the path over ground, it
# pushes harder against the current
LEAST_HEADWAY = 0.5
STOPPING = 0.5  # 1/s: at the path's end, speed is this times what is left
BACKING = 0.2  # m/s, fastest return to an end overshot
SURGE_GAIN, SWAY_GAIN = 40.0, 80.0  # N per m/s
SURGE_INTEGRAL, SWAY_INTEGRAL = 15.0, 40.0  # N/s per m/s
YAW_GAIN, YAW_RATE_GAIN, YAW_INTEGRAL, YAW_INTEGRAL_LIMIT = 2.4, 1.8, 0.3, 2.0  # N m, rad, s
DEPTH_GAIN, DEPTH_RATE_GAIN, DEPTH_INTEGRAL, DEPTH_INTEGRAL_LIMIT = 40.0, 30.0, 6.0, 20.0  # N, m, s
ROLL_GAIN, ROLL_RATE_GAIN = 8.0, 3.0  # N m, rad, s
PITCH_GAIN, PITCH_RATE_GAIN = 12.0, 3.0  # N m, rad, s; the hull alone is unstable above 0.5 m/s

# What the controller is told at first, the most that a thruster gives (N), and what it remembers:
# integrators (N north, N east, N m, N) and the demanded speed (m/s)
MEMORY = np.dtype([(name, "f8") for name in ("most", "north", "east", "turn", "sink", "speed")])


def begin(current: Floats, p: Floats, memory: Row, state: Floats) -> None:
    """Start carried along by a current (m/s), with the thrust that holds the depth.

    Writes `state` and a fresh MEMORY.
    """
    c_yaw, s_yaw = cos(state[5]), sin(state[5])
    state[6] = c_yaw * current[0] + s_yaw * current[1]
    state[7] = c_yaw * current[1] - s_yaw * current[0]
    memory["sink"] = -p[hull.SINKING]


@compiled
def share_thrust(wanted: Floats, most: float, given: Floats) -> tuple[bool, bool, bool, bool, bool]:
    """Give each axis what the thrusters have left for it: `given` (6,) of `wanted` X..N (N, N m).

    No thruster exceeds `most` (N): the sums below are what the hardest working one of each plane
    gives. Returned is whether surge, sway, heave, yaw, and roll or pitch got less than wanted.
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
    sensed: Sensed, aim: PathPoint, order: Row, interval: float, p: Floats, memory: Row,
    work: Floats, command: Floats,
) -> bool:  # fmt: skip
    """Write the wrench that carries the vehicle along its path at the speed (m/s) ordered, by its
    log; `work` (6,). Returns whether any axis was saturated.

    Wanted velocity U (cos d t - sin d n) - w_n n, d = atan(y_e / lookahead), along the path's
    tangent t and normal n (line of sight, Fossen 2021, section 12.4), w the current that the log
    misses, as far as fixes have shown; velocity errors are fed back in the heading frame and
    integrated in North-East, so that nothing unwinds in a turn.
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
    push += (p[hull.L1] + p[hull.Q1] * abs(wanted_u)) * wanted_u
    side = SWAY_GAIN * error_v + memory.east * c_yaw - memory.north * s_yaw
    side += (p[hull.L2] + p[hull.Q2] * abs(wanted_v)) * wanted_v + p[hull.M1] * u * turning
    twist = YAW_GAIN * yaw_error + YAW_RATE_GAIN * (turning - posture.turning) + memory.turn
    twist += p[hull.Q6] * abs(turning) * turning + (p[hull.M2] - p[hull.M1]) * u * v
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
    surge, sway, heave, yaw, tilt = share_thrust(work, memory.most, command)
    # an axis that is saturated learns nothing
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


# The turn that a path may ask for: at its beginning the heading lags by at most this (rad)
HEADING_LAG = 0.13  # 7.5 deg, at which a push along the path leaves it by an eighth of itself


def smallest_turn(speed: float, p: Floats, most: float) -> float:
    """Return the tightest circle (m) that the vehicle follows at a speed (m/s).

    The largest of three: where the centripetal force takes the whole share of sway, where drag in
    yaw takes the share of yaw, and where a circle's sudden beginning leaves the heading behind by
    HEADING_LAG. A yaw loop with natural frequency w and damping z lags behind a step in yaw rate
    by rate / w exp(-z / sqrt(1 - z^2) acos z) at most.
    """
    sideways = p[hull.M1] * speed**2 * PER_PUSH / (SWAY_SHARE * most)
    yaw_rate = sqrt(YAW_SHARE * most / PER_YAW / p[hull.Q6]) if p[hull.Q6] > 0.0 else np.inf
    frequency = sqrt(YAW_GAIN / p[hull.M6])
    damping = min(YAW_RATE_GAIN / (2.0 * sqrt(YAW_GAIN * p[hull.M6])), 0.999)
    lag = np.exp(-damping / sqrt(1.0 - damping**2) * np.arccos(damping)) / frequency
    return float(max(sideways, speed / yaw_rate, lag * speed / HEADING_LAG))
