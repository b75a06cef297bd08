"""What vehicles know of themselves at the beginning of a control interval."""

from typing import NamedTuple

import numpy as np

from ...core.compiled import inlined
from ...core.lanes.numbers import LANES
from ...core.lanes.sines import sincos
from ...records.rows import Row, Rows
from ..expected_drift import Told, expected_error, learnt_drift, way_since
from ..hulls import rk4
from ..hulls.frames import C_PHI, C_PSI, C_THETA, S_PHI, S_PSI, S_THETA, Current, Floats
from ..logs import COS, RATES, SIN, X, Y, Z
from ..reckoning import by_compass, error, follow
from . import belief, drift, logbook
from .belief import Posture, Sensed, Spot, SteeringDrift

# Rows of what moves four vehicles: the current ahead and to starboard (m/s).
FLOW, ROWS = logbook.LINE + logbook.NOTES, logbook.LINE + logbook.NOTES + 2


def room() -> Floats:
    """Return an array for four vehicles at the origin that sense and keep logs."""
    return np.zeros((ROWS, LANES))


class Craft(NamedTuple):
    """How vehicles of a model move: their equations (see `rk4`), how many numbers a state has, the
    control interval (s), the step (s) of the integration, and how many of them an interval has.
    """

    model: int
    size: int
    control: float
    step: float
    steps: int


class Knowledge(NamedTuple):
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
def posture(size: int, rows: Floats, lane: int, turned: float) -> Posture:
    """Return how the vehicle in a lane lies, whose compass is off by an angle (rad)."""
    state, angle = rk4.STATE, rk4.ANGLE
    dives = size >= rk4.PITCHING_STATE
    yaw = rows[state + (5 if dives else 2), lane] + turned
    s_yaw, c_yaw = rows[angle + S_PSI, lane], rows[angle + C_PSI, lane]
    if turned != 0.0:
        s_yaw, c_yaw = sincos(yaw)
    depth = roll = pitch = rolling = pitching = 0.0
    turning = rows[state + 5, lane]
    if dives:
        depth, roll, pitch = rows[state + 2, lane], rows[state + 3, lane], rows[state + 4, lane]
        rolling, pitching = rows[state + 9, lane], rows[state + 10, lane]
        turning = rows[state + 11, lane]
    return Posture(
        depth, roll, pitch, yaw, rolling, pitching, turning,
        rows[angle + S_PHI, lane], rows[angle + C_PHI, lane],
        rows[angle + S_THETA, lane], rows[angle + C_THETA, lane], s_yaw, c_yaw,
    )  # fmt: skip


@inlined
def spot(size: int, missed: tuple[float, float], rows: Floats, lane: int) -> Spot:
    """Return where the vehicle in a lane is.

    Of what its log measures ahead and to starboard a current (m/s) is left out; surface craft do
    not ask for that.
    """
    line, ahead, aside = logbook.LINE, 0.0, 0.0
    if size >= rk4.PITCHING_STATE:
        ahead = rows[rk4.STATE + 6, lane] - missed[0]
        aside = rows[rk4.STATE + 7, lane] - missed[1]
    return Spot(
        rows[line + X, lane], rows[line + Y, lane],
        rows[line + RATES + X, lane], rows[line + RATES + Y, lane], rows[line + RATES + Z, lane],
        ahead, aside,
    )  # fmt: skip


@inlined
def sense(
    craft: Craft, vehicle: int, lane: int, interval: int, current: Current, rows: Floats,
    known: Knowledge, vessel: Row,
) -> Sensed:  # fmt: skip
    """Return what the vehicle in a lane knows at the beginning of a control interval.

    It is true but for the heading, which is by compass.  Ahead and to starboard the log of a REMUS
    measures the velocity through the water in any case.
    """
    time, order, wrong = interval * craft.control, vessel.order, known.drift.wrong
    lies = posture(craft.size, rows, lane, wrong.skews[vehicle].turned)
    share = 1.0 if known.drift.through_water or craft.model != rk4.BLUEROV2 else 0.0
    missed = share * rows[FLOW, lane], share * rows[FLOW + 1, lane]
    at = spot(craft.size, missed, rows, lane)
    sums = rows[logbook.LINE + COS, lane], rows[logbook.LINE + SIN, lane]
    cosine, sine = by_compass(sums[0], sums[1], wrong, vehicle)
    if wrong.biases.shape[1] > 1 and interval > 0:
        follow(wrong, vehicle, interval, cosine, sine)
    way = at.x - known.logs[vehicle, 0, X], at.y - known.logs[vehicle, 0, Y]
    wrong_n, wrong_e = error(time, (cosine, sine), way, wrong, vehicle)
    fix = min(interval, known.noise.shape[1] - 1)
    right_n, right_e = known.corrections[vehicle, 0], known.corrections[vehicle, 1]
    off_n = at.x + wrong_n + known.noise[vehicle, fix, 0] + right_n - order.north
    off_e = at.y + wrong_e + known.noise[vehicle, fix, 1] + right_e - order.east
    share = 1.0 if known.drift.through_water else 0.0
    escapes = share * current.north, share * current.east
    log = belief.read_log(at, (lies.c_yaw, lies.s_yaw), escapes, wrong, vehicle, interval)
    set_n = set_e = 0.0
    if known.has_learnt:
        learnt = learnt_drift(known.learnt[vehicle])
        told = Told(time, at.x + wrong_n, at.y + wrong_e, cosine, sine)
        carried_n, carried_e = expected_error(learnt, way_since(learnt, told, wrong.in_body))
        off_n, off_e = off_n - carried_n, off_e - carried_e
        frame = (lies.c_yaw, lies.s_yaw) if wrong.in_body else (1.0, 0.0)
        set_n, set_e = belief.set_of(frame, (log[0], log[1]), learnt)
    elif known.drift.through_water:
        drift.learn(time, right_n, right_e, vessel.trend)
        set_n, set_e = vessel.trend.rate[0], vessel.trend.rate[1]
    return Sensed(lies, at.sinking, off_n, off_e, log[0], log[1], log[2], log[3], set_n, set_e)
