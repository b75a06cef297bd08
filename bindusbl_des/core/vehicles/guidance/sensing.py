"""What vehicles know of themselves at the beginning of a control interval, and learn by fixes of a
current that no log sees.

An autopilot has its AHRS (attitude and turn rates), its depth and a velocity log, whose errors are
those of dead reckoning. Whatever else is true stays outside.

Dead reckoning falls behind by the current, and fixes bring it forward again; so the sum of all
corrections grows as fast as the water carries the vehicle (less what the log's bias makes of it).
A straight line through that sum, with a memory that fades, has that rate as its slope. It is not a
filter of the position: the vehicle goes on steering by the fused estimate as it is.
"""

from math import ceil, cos, exp, floor, pi, sin
from typing import NamedTuple

import numpy as np

from ....support.arrays import Floats
from ....support.compiled import compiled, inlined
from ...records.rows import Row, Rows
from ..hulls import forces
from ..hulls.forces import Current, MovedVehicle
from ..motion import COS, RATES, SIN, X, Y, Z
from ..reckoning import (
    DeadReckoned,
    ExpectedDrift,
    Wrong,
    by_compass,
    error,
    expected_error,
    follow,
    learnt_drift,
    skewed,
    steady,
    way_since,
)

# s: a fix weighs 1/e when this old. With 5 to 30 s a BlueROV2 keeps its path equally well; a REMUS
# with fixes three seconds apart wants 20 s or more.
MEMORY = 20.0
# The memory is a third of the time since the start as long as that is shorter, a second at least:
# the line turns quickly while it is short, and noise of the first fix is no current.
YOUNG, YOUNGEST = 3.0, 3.0

# s over which who keeps a station averages its fixes
FIX_MEMORY = 5.0

AT_ONCE = 1e-9  # s, between two looks, at least

# What is remembered: the sum of corrections last seen (m), the line's end there (m) and its slope
# (m/s), north and east; when that was (s)
TREND = np.dtype(
    [("seen", "f8", (2,)), ("end", "f8", (2,)), ("rate", "f8", (2,)), ("seen_at", "f8")]
)


class Posture(NamedTuple):
    """How a vehicle lies in the water, as its sensors tell: depth (m), roll, pitch, and yaw by
    compass (rad), its turning about its own axes (rad/s), and what sines and cosines there are.
    """

    depth: float
    roll: float
    pitch: float
    yaw: float
    rolling: float
    pitching: float
    turning: float
    s_roll: float
    c_roll: float
    s_pitch: float
    c_pitch: float
    s_yaw: float
    c_yaw: float


class Sensed(NamedTuple):
    """What a vehicle knows at an instant, and steers by; all that an autopilot may look at.

    Its `posture`; how fast it sinks (m/s); the offset from its station (m) by estimate or GNSS, and
    the velocity that its log measures (m/s), north and east; that ahead and to starboard of the
    hull (a REMUS asks for the one through the water); and how fast the water carries it beyond what
    the log measures, as far as fixes show (m/s).
    """

    posture: Posture
    sinking: float
    off_n: float
    off_e: float
    log_n: float
    log_e: float
    log_ahead: float
    log_aside: float
    set_n: float
    set_e: float


class SteeringDrift(NamedTuple):
    """How wrong the dead reckoning is by which vehicles steer.

    `through_water` if the log has no bottom lock and misses the current, which is then in the
    `walks` of `wrong`.  Biases that change are held for a control interval each.
    """

    wrong: Wrong
    through_water: bool = False


class Craft(NamedTuple):
    """How vehicles of a model move: their equations by number, how many numbers a state has, the
    control interval (s), the step (s) of the integration, and how many of them an interval has.
    """

    model: int
    size: int
    control: float
    step: float
    steps: int


class NavigationState(NamedTuple):
    """What vehicles know of their places, each in its row: how wrong that is (m), what fixes have
    put right (m), what a filter has learnt, if it `has_learnt`; and the logs, whose first lines say
    where they began.
    """

    drift: SteeringDrift
    noise: Floats
    corrections: Floats
    learnt: Rows
    has_learnt: bool
    logs: Floats


@inlined
def within(value: float, limit: float) -> float:
    """Return a command, or the limit (of either sign) that it exceeds."""
    return min(max(value, -limit), limit)


@inlined
def half_turn(angle: float) -> float:
    """Return the turn of at most half a circle (rad) that leads through an angle."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)


@compiled
def average_fixes(sensed: Sensed, interval: float, memory: Row) -> None:
    """Average noisy fixes (m, off the station) in a memory, carried along by the velocity."""
    share = interval / FIX_MEMORY
    memory.off_n += share * (sensed.off_n - memory.off_n) + interval * sensed.log_n
    memory.off_e += share * (sensed.off_e - memory.off_e) + interval * sensed.log_e


def for_fleet(
    model: str, drift: SteeringDrift | None, count: int, duration: float, control: float
) -> SteeringDrift:
    """Return the drift of each of `count` vehicles; none at all for None.

    Raises ValueError for a walk that is not given for each vehicle up to the end (`duration`, s),
    or biases that are held for anything but an interval of `control` (s).
    """
    if drift is None:
        return SteeringDrift(steady(np.zeros((count, 2, 2)), 1.0, (0.0, 0.0), False))
    wrong, walks = drift.wrong, np.array(drift.wrong.walks, dtype=np.float64, order="C")
    samples = max(2, 1 + ceil(duration * wrong.rate * (1.0 - 1e-12)))
    if walks.ndim != 3 or len(walks) != count or walks.shape[1] < samples or walks.shape[2] != 2:
        raise ValueError(
            f"{model}: drift.walks has shape {walks.shape}, not ({count}, {samples} or more, 2): "
            f"{count} vehicles for {duration:g} s at {wrong.rate:g} Hz"
        )
    if not (np.isfinite(walks).all() and np.isfinite(wrong.biases).all()):
        raise ValueError(f"{model}: drift.biases and drift.walks must be finite numbers")
    if wrong.biases.shape[1] > 1 and wrong.held_s != control:
        raise ValueError(
            f"{model}: drift.held_s is {wrong.held_s:g}; biases that change are held for a control "
            f"interval of {control:g} s"
        )
    return SteeringDrift(wrong._replace(walks=walks), bool(drift.through_water))


@inlined
def posture(vehicle: MovedVehicle, turned: float) -> Posture:
    """Return how a vehicle lies, whose compass is off by an angle (rad)."""
    state, angles = vehicle.state, vehicle.angles
    dives = state.size >= forces.PITCHING_STATE
    yaw = state[5 if dives else 2] + turned
    s_yaw, c_yaw = angles[forces.S_PSI], angles[forces.C_PSI]
    if turned != 0.0:
        s_yaw, c_yaw = sin(yaw), cos(yaw)
    depth = roll = pitch = rolling = pitching = 0.0
    turning = state[5]
    if dives:
        depth, roll, pitch = state[2], state[3], state[4]
        rolling, pitching, turning = state[9], state[10], state[11]
    return Posture(
        depth, roll, pitch, yaw, rolling, pitching, turning,
        angles[forces.S_PHI], angles[forces.C_PHI],
        angles[forces.S_THETA], angles[forces.C_THETA], s_yaw, c_yaw,
    )  # fmt: skip


@compiled
def learn_drift(time: float, north: float, east: float, line: Row) -> None:
    """Take in an AUV's sum of corrections (m) at an instant (s); nothing happens between fixes.

    `line`, a TREND, is zero at first, and begins with the first fix, which may put right a wrong
    initial position. With k = exp(-T / memory) after T without a fix, its end takes 1 - k^2 of what
    it is off, its slope (1 - k)^2 / T: at equal intervals that is least squares with fading weights
    (critically damped g-h filter, Brookner 1998, Tracking and Kalman Filtering Made Easy).
    """
    if north == line.seen[0] and east == line.seen[1]:
        return
    if line.seen_at == 0.0:
        line.end[0], line.end[1] = north, east
    past = max(time - line.seen_at, AT_ONCE)
    kept = exp(-past / min(MEMORY, (time + YOUNGEST) / YOUNG))
    for axis in range(2):
        carried = line.end[axis] + past * line.rate[axis]
        off = (north if axis == 0 else east) - carried
        line.end[axis] = carried + (1.0 - kept**2) * off
        line.rate[axis] += (1.0 - kept) ** 2 / past * off
    line.seen[0], line.seen[1], line.seen_at = north, east, time


@inlined
def sense(
    craft: Craft, number: int, vehicle: MovedVehicle, line: Floats, flow: tuple[float, float],
    interval: int, current: Current, known: NavigationState, vessel: Row,
) -> Sensed:  # fmt: skip
    """Return what the vehicle of a number knows at the beginning of a control interval.

    It is true but for the heading, which is by compass.  Ahead and to starboard the log of a REMUS
    measures the velocity through the water in any case: `flow` is the current so (m/s).
    """
    time, order, wrong = interval * craft.control, vessel.order, known.drift.wrong
    lies = posture(vehicle, wrong.skews[number].turned)
    x, y, north, east = line[X], line[Y], line[RATES + X], line[RATES + Y]
    ahead = aside = 0.0
    if vehicle.state.size >= forces.PITCHING_STATE:  # surface craft do not ask for it
        share = 1.0 if known.drift.through_water or craft.model != forces.BLUEROV2 else 0.0
        ahead, aside = vehicle.state[6] - share * flow[0], vehicle.state[7] - share * flow[1]
    cosine, sine = by_compass(line[COS], line[SIN], wrong, number)
    if wrong.biases.shape[1] > 1 and interval > 0:
        follow(wrong, number, interval, cosine, sine)
    way = x - known.logs[number, 0, X], y - known.logs[number, 0, Y]
    wrong_n, wrong_e = error(time, (cosine, sine), way, wrong, number)
    fix = min(interval, known.noise.shape[1] - 1)
    right_n, right_e = known.corrections[number, 0], known.corrections[number, 1]
    off_n = x + wrong_n + known.noise[number, fix, 0] + right_n - order.north
    off_e = y + wrong_e + known.noise[number, fix, 1] + right_e - order.east
    share = 1.0 if known.drift.through_water else 0.0
    water = north - share * current.north, east - share * current.east
    heading = lies.c_yaw, lies.s_yaw
    log = _read_log(water, (ahead, aside), heading, wrong, number, interval)
    set_n = set_e = 0.0
    if known.has_learnt:
        learnt = learnt_drift(known.learnt[number])
        dr = DeadReckoned(time, x + wrong_n, y + wrong_e, cosine, sine)
        carried_n, carried_e = expected_error(learnt, way_since(learnt, dr, wrong.in_body))
        off_n, off_e = off_n - carried_n, off_e - carried_e
        frame = heading if wrong.in_body else (1.0, 0.0)
        set_n, set_e = _set_of(frame, (log[0], log[1]), learnt)
    elif known.drift.through_water:
        learn_drift(time, right_n, right_e, vessel.trend)
        set_n, set_e = vessel.trend.rate[0], vessel.trend.rate[1]
    return Sensed(lies, line[RATES + Z], off_n, off_e, log[0], log[1], log[2], log[3], set_n, set_e)


@inlined
def _read_log(
    moved: tuple[float, float], through: tuple[float, float], heading: tuple[float, float],
    wrong: Wrong, vehicle: int, interval: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return what a velocity log measures (m/s), bias included, north, east, ahead, to starboard.

    A log without error would measure `moved` north and east, and `through` ahead and to starboard;
    `heading` are cosine and sine of the yaw by compass. The random walk of dead reckoning is left
    to the position: it is faster than the loops, and as noise of this velocity changes path errors
    of a BlueROV2 by 0.02 m at most.
    """
    held, factor = min(interval, wrong.biases.shape[1] - 1), wrong.skews[vehicle].factor
    forward, starboard = wrong.biases[vehicle, held, 0], wrong.biases[vehicle, held, 1]
    c_turn, s_turn, c_hull, s_hull = 1.0, 0.0, heading[0], -heading[1]
    if wrong.in_body:
        c_turn, s_turn, c_hull, s_hull = heading[0], heading[1], 1.0, 0.0
    north, east = moved
    added_n, added_e = skewed(north, east, wrong, vehicle)
    north = added_n + north + c_turn * forward - s_turn * starboard
    east = added_e + east + s_turn * forward + c_turn * starboard
    ahead = factor * through[0] + c_hull * forward - s_hull * starboard
    aside = factor * through[1] + s_hull * forward + c_hull * starboard
    return north, east, ahead, aside


@inlined
def _set_of(
    frame: tuple[float, float], log: tuple[float, float], assumed: ExpectedDrift
) -> tuple[float, float]:
    """Return how fast water and bias carry the vehicle beyond what its log measures (m/s).

    As a filter has learnt it; `frame` are cosine and sine of that in which the bias is constant,
    `log` what is measured along x and y.
    """
    c_turn, s_turn = frame
    ahead, aside = (
        assumed.bias_ahead + assumed.roaming_ahead,
        assumed.bias_aside + assumed.roaming_aside,
    )
    bias_n, bias_e = c_turn * ahead - s_turn * aside, s_turn * ahead + c_turn * aside
    own_n, own_e = log[0] - bias_n, log[1] - bias_e
    north = assumed.current_x - bias_n - (assumed.stretch * own_n - assumed.turn * own_e)
    east = assumed.current_y - bias_e - (assumed.turn * own_n + assumed.stretch * own_e)
    return north, east
