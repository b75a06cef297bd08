"""What vehicles know, and steer by: where they believe to be, and what their logs tell.

An autopilot has its AHRS (attitude and turn rates), its depth and a velocity log, whose errors are
those of dead reckoning. Whatever else is true stays outside.
"""

from math import ceil, cos, sin
from typing import NamedTuple

import numpy as np

from ...core.compiled import inlined
from ..expected_drift import Drift
from ..hulls.frames import Floats
from ..reckoning import Wrong, skewed, steady


class Sensed(NamedTuple):
    """What a vehicle knows at an instant, and steers by; all that an autopilot may look at.

    Of its `state`, attitude by compass, turn rates and depth; how fast it sinks (m/s); the offset
    from its station (m) by estimate or GNSS, and the velocity that its log measures (m/s), north
    and east; that ahead and to starboard of the hull (a REMUS asks for the one through the water);
    and how fast the water carries it beyond what the log measures, as far as fixes show (m/s).
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

    `through_water` if the log has no bottom lock and misses the current, which is then in the
    `walks` of `wrong`.  Biases that change are held for a control interval each.
    """

    wrong: Wrong
    through_water: bool = False


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
def set_of(turn: float, log: tuple[float, float], told: Drift) -> tuple[float, float]:
    """Return how fast water and bias carry the vehicle beyond what its log measures (m/s).

    As a filter has learnt it; `turn` (rad) is that of the frame in which the bias is constant,
    `log` what is measured along x and y.
    """
    c_turn, s_turn = cos(turn), sin(turn)
    ahead, aside = told.bias_ahead + told.roaming_ahead, told.bias_aside + told.roaming_aside
    bias_n, bias_e = c_turn * ahead - s_turn * aside, s_turn * ahead + c_turn * aside
    own_n, own_e = log[0] - bias_n, log[1] - bias_e
    north = told.current_x - bias_n - (told.stretch * own_n - told.turn * own_e)
    east = told.current_y - bias_e - (told.turn * own_n + told.stretch * own_e)
    return north, east


@inlined
def read_log(
    spot: Spot, own: tuple[float, float], current: Floats, drift: SteeringDrift, vehicle: int,
    bias: Floats,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return what a velocity log measures (m/s), bias included, north, east, ahead, to starboard.

    `own` is the velocity ahead and to starboard without error; `current` (2,) m/s escapes a log
    without bottom lock; `bias` (2,) is that of now. The random walk of dead reckoning is left to
    the position: it is faster than the loops, and as noise of this velocity changes path errors of
    a BlueROV2 by 0.02 m at most.
    """
    missed, wrong = 1.0 if drift.through_water else 0.0, drift.wrong
    yaw, factor = spot.yaw + wrong.skews[vehicle].turned, wrong.skews[vehicle].factor
    turn = yaw if wrong.in_body else 0.0
    c_turn, s_turn = cos(turn), sin(turn)
    north, east = spot.north - missed * current[0], spot.east - missed * current[1]
    added_n, added_e = skewed(north, east, wrong, vehicle)
    north = added_n + north + c_turn * bias[0] - s_turn * bias[1]
    east = added_e + east + s_turn * bias[0] + c_turn * bias[1]
    c_hull, s_hull = cos(turn - yaw), sin(turn - yaw)
    ahead = factor * own[0] + c_hull * bias[0] - s_hull * bias[1]
    aside = factor * own[1] + s_hull * bias[0] + c_hull * bias[1]
    return north, east, ahead, aside
