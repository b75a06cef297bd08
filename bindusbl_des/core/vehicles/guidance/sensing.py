"""What an autopilot knows at the beginning of a control interval; and the current learnt from
fixes.

An autopilot reads an AHRS (attitude and turn rates), a depth sensor and a velocity log, whose
errors are those of dead reckoning.  It gets nothing else of the true state.

Dead reckoning falls behind by the current and fixes bring it forward again, so the sum of all
corrections grows as fast as the current carries the vehicle (less the effect of the log's bias).  A
straight line fitted to that sum, with fading memory, has this rate as its slope.  It does not
filter the position: the vehicle steers by the fused estimate.
"""

from math import ceil, cos, exp, floor, inf, pi, sin
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

# s: a fix of this age weighs 1/e.  A BlueROV2 keeps its path equally well with 5 to 30 s; a REMUS
# with a fix each 3 s needs 20 s or more.
MEMORY = 20.0
# At first the memory is a third of the time since the start, at least 1 s: the line adapts quickly
# while it is short, and noise of the first fix does not count as current.
YOUNG, YOUNGEST = 3.0, 3.0

# s over which a vessel on station averages its fixes
FIX_MEMORY = 5.0

AT_ONCE = 1e-9  # s, the least time between two fixes

# The fitted line: the last sum of corrections (m), the line's end (m) and slope (m/s), north and
# east; the instant of that (s)
TREND = np.dtype(
    [("seen", "f8", (2,)), ("end", "f8", (2,)), ("rate", "f8", (2,)), ("seen_at", "f8")]
)


class Posture(NamedTuple):
    """The attitude and depth that the sensors measure.

    Depth (m); roll, pitch, and yaw by compass (rad); body rates (rad/s); sines and cosines of the
    angles.
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
    """Everything that an autopilot may read at an instant.

    `posture`; descent rate `sinking` (m/s); offset from the station (m) by estimate or GNSS;
    velocity by log (m/s), north and east, then ahead and to starboard of the hull (for a REMUS
    through the water); and the drift (m/s) `set_n`, `set_e` beyond what the log measures, as fixes
    reveal it.
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
    """The errors of the dead reckoning by which vehicles steer.

    With `through_water` the log has no bottom lock and misses the current, which is then part of
    the `walks` of `wrong`; else it misses the current higher above the bottom than `sees_m` (m).
    Biases that change are constant within a control interval.
    """

    wrong: Wrong
    through_water: bool = False
    sees_m: float = inf


class Craft(NamedTuple):
    """How vehicles of a model are integrated: equations by number, size of a state, control
    interval (s), integration step (s), steps per interval.
    """

    model: int
    size: int
    control: float
    step: float
    steps: int


class NavigationState(NamedTuple):
    """The position knowledge of all vehicles, a row each.

    Errors of dead reckoning and of GNSS `noise` (m), `corrections` by fixes (m), the drift `learnt`
    by a filter if it `has_learnt`, and the `logs`, whose first lines hold the starts.
    """

    drift: SteeringDrift
    noise: Floats
    corrections: Floats
    learnt: Rows
    has_learnt: bool
    logs: Floats


@inlined
def within(value: float, limit: float) -> float:
    """Return a value clipped to +-limit."""
    return min(max(value, -limit), limit)


@inlined
def half_turn(angle: float) -> float:
    """Return the equal angle (rad) within +-half a turn."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)


@compiled
def average_fixes(sensed: Sensed, interval: float, memory: Row) -> None:
    """Average noisy fixes (m, off the station) in a memory that moves with the velocity by log."""
    share = interval / FIX_MEMORY
    memory.off_n += share * (sensed.off_n - memory.off_n) + interval * sensed.log_n
    memory.off_e += share * (sensed.off_e - memory.off_e) + interval * sensed.log_e


def for_fleet(
    model: str, drift: SteeringDrift | None, count: int, duration: float, control: float
) -> SteeringDrift:
    """Return the drift of each of `count` vehicles; without errors for None.

    Raises ValueError for walks that do not cover each vehicle up to `duration` (s), or biases that
    change at other instants than control intervals (`control`, s).
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
    return drift._replace(wrong=wrong._replace(walks=walks))


@inlined
def posture(vehicle: MovedVehicle, turned: float) -> Posture:
    """Return the posture of a vehicle whose compass is off by an angle `turned` (rad)."""
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
    """Take in an AUV's sum of corrections (m) at an instant (s); between fixes nothing changes.

    `line`, a TREND, is zero until the first fix, which may correct a wrong initial position.  With
    k = exp(-T / memory) after T without a fix, its end moves by 1 - k^2 of the residual, its slope
    by (1 - k)^2 / T of it: at equal intervals this is least squares with fading weights (critically
    damped g-h filter, Brookner 1998, Tracking and Kalman Filtering Made Easy).
    """
    if north == line.seen[0] and east == line.seen[1]:
        return
    if line.seen_at == 0.0:
        line.end[0], line.end[1] = north, east
        line.rate[0] = line.rate[1] = 0.0
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
    interval: int, current: Current, known: NavigationState, vessel: Row, misses: bool,
) -> Sensed:  # fmt: skip
    """Return what the vehicle `number` knows at the beginning of a control interval.

    Attitude and rates are true but for the heading, which is by compass.  The log of a REMUS always
    measures the velocity ahead and to starboard through the water; `flow` (m/s) is the current
    there, which a log that `misses` it does not see.
    """
    time, order, wrong = interval * craft.control, vessel.order, known.drift.wrong
    lies = posture(vehicle, wrong.skews[number].turned)
    x, y, north, east = line[X], line[Y], line[RATES + X], line[RATES + Y]
    ahead = aside = 0.0
    if vehicle.state.size >= forces.PITCHING_STATE:  # surface craft do not ask for it
        share = 1.0 if misses or craft.model != forces.BLUEROV2 else 0.0
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
    share = 1.0 if misses else 0.0
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
    elif misses:
        learn_drift(time, right_n, right_e, vessel.trend)
        set_n, set_e = vessel.trend.rate[0], vessel.trend.rate[1]
    else:
        vessel.trend.seen_at = 0.0  # what it has learnt is over
    return Sensed(lies, line[RATES + Z], off_n, off_e, log[0], log[1], log[2], log[3], set_n, set_e)


@inlined
def _read_log(
    moved: tuple[float, float], through: tuple[float, float], heading: tuple[float, float],
    wrong: Wrong, vehicle: int, interval: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the velocity (m/s) that a log measures, with bias: north, east, ahead, to starboard.

    An errorless log would measure `moved` north and east, and `through` ahead and to starboard;
    `heading` holds cosine and sine of yaw by compass.  The random walk of dead reckoning enters the
    position only: it is faster than the control loops, and as noise of this velocity changes path
    errors of a BlueROV2 by at most 0.02 m.
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
    """Return the drift (m/s), north and east, beyond the velocity `log`, as a filter has learnt it.

    `frame` holds cosine and sine of the rotation of the frame in which the bias is constant.
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
