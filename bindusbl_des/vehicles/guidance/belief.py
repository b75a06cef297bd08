"""What vehicles know, and steer by: where they believe to be, and what their logs tell.

An autopilot has its AHRS (attitude and turn rates), its depth and a velocity log, whose bias is
that of dead reckoning. Whatever else is true stays outside.
"""

from math import ceil, cos, floor, sin
from typing import NamedTuple

import numpy as np

from ...core.compiled import inlined
from ...records.rows import Row
from .. import logs
from ..hulls.frames import Floats


class Sensed(NamedTuple):
    """What a vehicle knows at an instant, and steers by; all that an autopilot may look at.

    Of its true `state`, attitude, turn rates and depth; how fast it sinks (m/s); the offset from
    its station (m) by estimate or GNSS, and the velocity that its log measures (m/s), north and
    east; that ahead and to starboard of the hull (a REMUS asks for the one through the water); and
    how fast the water carries it beyond what the log measures, as far as fixes show (m/s).
    """

    state: Floats
    sinking: float
    off_n: float
    off_e: float
    log_n: float
    log_e: float
    log_ahead: float
    log_aside: float
    set_n: float
    set_e: float


class Spot(NamedTuple):
    """Where a vehicle is and how it moves: place (m), yaw (rad), their rates (m/s, rad/s), and the
    current ahead and to starboard (m/s).
    """

    x: float
    y: float
    z: float
    yaw: float
    north: float
    east: float
    sinking: float
    turning: float
    ahead: float
    aside: float


class SteeringDrift(NamedTuple):
    """How wrong the dead reckoning is by which vehicles steer.

    `bias` (2,) or (n, 2) m/s of velocity, ahead and to starboard if `in_body`, else along x and y;
    `walk` (n, samples, 2) m along x and y at the instants k / `rate` (Hz), straight in between.
    `through_water` if the log has no bottom lock and misses the current, which is then in `walk`.
    """

    bias: Floats
    in_body: bool
    walk: Floats
    rate: float
    through_water: bool = False


def for_fleet(
    model: str, drift: SteeringDrift | None, count: int, duration: float
) -> SteeringDrift:
    """Return the drift with a row for each of `count` vehicles; none at all for None.

    Raises ValueError for a walk that is not given for each vehicle up to the end (`duration`, s).
    """
    if drift is None:
        return SteeringDrift(np.zeros((count, 2)), False, np.zeros((count, 2, 2)), 1.0)
    walk = np.array(drift.walk, dtype=np.float64, order="C")
    samples = max(2, 1 + ceil(duration * drift.rate * (1.0 - 1e-12)))
    if walk.ndim != 3 or walk.shape[0] != count or walk.shape[1] < samples or walk.shape[2] != 2:
        raise ValueError(
            f"{model}: drift.walk has shape {walk.shape}, not ({count}, {samples} or more, 2): "
            f"{count} vehicles for {duration:g} s at {drift.rate:g} Hz"
        )
    bias = np.array(np.broadcast_to(drift.bias, (count, 2)), dtype=np.float64, order="C")
    if not (np.isfinite(walk).all() and np.isfinite(bias).all()):
        raise ValueError(f"{model}: drift.bias and drift.walk must be finite numbers")
    return SteeringDrift(
        bias, bool(drift.in_body), walk, float(drift.rate), bool(drift.through_water)
    )


@inlined
def carried_on(time: float, line: Floats, told: Row, in_body: bool) -> tuple[float, float]:
    """Return how far (m) along x and y the bias and current that a filter has learnt have carried
    dead reckoning off since its last correction; `line` of the voyage's log is that of now.
    """
    past = time - told.at_s
    ahead = line[logs.COS] - told.cosine_s if in_body else past
    aside = line[logs.SIN] - told.sine_s if in_body else 0.0
    north = ahead * told.bias[0] - aside * told.bias[1] - past * told.current[0]
    east = aside * told.bias[0] + ahead * told.bias[1] - past * told.current[1]
    return north, east


@inlined
def set_of(turn: float, told: Row) -> tuple[float, float]:
    """Return how fast water and bias carry the vehicle beyond what its log measures (m/s).

    As a filter has learnt it; `turn` (rad) is that of the frame in which the bias is constant.
    """
    c_turn, s_turn = cos(turn), sin(turn)
    north = told.current[0] - (c_turn * told.bias[0] - s_turn * told.bias[1])
    east = told.current[1] - (s_turn * told.bias[0] + c_turn * told.bias[1])
    return north, east


@inlined
def error(time: float, line: Floats, drift: SteeringDrift, vehicle: int) -> tuple[float, float]:
    """Return how far (m) along x and y a vehicle believes to be from where it is.

    `line` of its log holds the integrals of its heading.
    """
    bias, walk, rate = drift.bias[vehicle], drift.walk[vehicle], drift.rate
    if drift.in_body:
        ahead, aside = line[logs.COS], line[logs.SIN]
        north, east = ahead * bias[0] - aside * bias[1], aside * bias[0] + ahead * bias[1]
    else:
        north, east = time * bias[0], time * bias[1]
    whole = min(floor(time * rate), walk.shape[0] - 2)
    share = time * rate - whole
    here, there = walk[whole], walk[whole + 1]
    north += here[0] + share * (there[0] - here[0])
    east += here[1] + share * (there[1] - here[1])
    return north, east


@inlined
def read_log(
    spot: Spot, own: tuple[float, float], current: Floats, drift: SteeringDrift, vehicle: int
) -> tuple[float, float, float, float]:
    """Return what a velocity log measures (m/s), bias included, north, east, ahead, to starboard.

    `own` is the velocity ahead and to starboard without bias; `current` (2,) m/s escapes a log
    without bottom lock. The random walk of dead reckoning is left to the position: it is faster
    than the loops, and as noise of this velocity changes path errors of a BlueROV2 by 0.02 m at
    most.
    """
    bias, missed = drift.bias[vehicle], 1.0 if drift.through_water else 0.0
    turn = spot.yaw if drift.in_body else 0.0
    c_turn, s_turn = cos(turn), sin(turn)
    north = spot.north - missed * current[0] + c_turn * bias[0] - s_turn * bias[1]
    east = spot.east - missed * current[1] + s_turn * bias[0] + c_turn * bias[1]
    c_hull, s_hull = cos(turn - spot.yaw), sin(turn - spot.yaw)
    ahead = own[0] + c_hull * bias[0] - s_hull * bias[1]
    aside = own[1] + s_hull * bias[0] + c_hull * bias[1]
    return north, east, ahead, aside
