"""What vehicles know, and steer by: where they believe to be, and what their logs tell.

An autopilot has its AHRS (attitude and turn rates), its depth and a velocity log, whose errors are
those of dead reckoning. Whatever else is true stays outside.
"""

from math import ceil
from typing import NamedTuple

import numpy as np

from ...core.compiled import inlined
from ..reckoning import ExpectedDrift, Wrong, skewed, steady


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


class Spot(NamedTuple):
    """Where a vehicle is and how it moves over ground: place (m) and velocity (m/s); and how fast
    ahead and to starboard a log without error measures (m/s).
    """

    x: float
    y: float
    north: float
    east: float
    sinking: float
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
def set_of(
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


@inlined
def read_log(
    spot: Spot, heading: tuple[float, float], missed: tuple[float, float], wrong: Wrong,
    vehicle: int, interval: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return what a velocity log measures (m/s), bias included, north, east, ahead, to starboard.

    `heading` are cosine and sine of the yaw by compass; `missed` is the current (m/s) that escapes
    the log. The random walk of dead reckoning is left to the position: it is faster than the loops,
    and as noise of this velocity changes path errors of a BlueROV2 by 0.02 m at most.
    """
    held, factor = min(interval, wrong.biases.shape[1] - 1), wrong.skews[vehicle].factor
    forward, starboard = wrong.biases[vehicle, held, 0], wrong.biases[vehicle, held, 1]
    c_turn, s_turn, c_hull, s_hull = 1.0, 0.0, heading[0], -heading[1]
    if wrong.in_body:
        c_turn, s_turn, c_hull, s_hull = heading[0], heading[1], 1.0, 0.0
    north, east = spot.north - missed[0], spot.east - missed[1]
    added_n, added_e = skewed(north, east, wrong, vehicle)
    north = added_n + north + c_turn * forward - s_turn * starboard
    east = added_e + east + s_turn * forward + c_turn * starboard
    ahead = factor * spot.ahead + c_hull * forward - s_hull * starboard
    aside = factor * spot.aside + s_hull * forward + c_hull * starboard
    return north, east, ahead, aside
