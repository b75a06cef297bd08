"""A fleet under its controllers: look, steer, hold the command for an interval, look again.

Within a control interval nothing is decided; so how many intervals are flown at a time changes no
bit of where anybody goes.
"""

from math import cos, hypot, isfinite, nan, sin
from typing import NamedTuple

import numpy as np

from ...core.compiled import compiled, entry, inlined
from ...records.rows import Row, Rows
from .. import logs
from ..expected_drift import Told, expected_error, learnt_drift, way_since
from ..hulls import rk4
from ..hulls.frames import Floats, move_rigid_body, move_surface_craft
from ..reckoning import Wrong, by_compass, error, follow
from . import belief, bluerov2, cybership2, drift, logbook, otter, remus100, tracks
from .belief import Sensed, Spot, SteeringDrift
from .tracks import Aim, Flags, Ints, Tracks

HEALTHY, BROKEN, ADRIFT, STUCK = range(4)  # how a vehicle fares
HEADWAY = 0.02  # of the speed demanded: less of it along its path is no headway
ARRIVED = 1.0  # m before its path's end, a vehicle that slows down there counts as arrived
PATIENT_FOR = 3  # times in a row: a correction may take a vehicle back once

# Where a vehicle was told to be (m), how fast (m/s), how deep (m)
ORDER = np.dtype([(name, "f8") for name in ("north", "east", "speed", "depth")])

# The look-out: how far a vehicle may be off (m), for how long (s), since when (s) and from where
# (m) it counts, how often in a row no headway was made
WATCH = np.dtype(
    [("reach", "f8"), ("patience", "f8"), ("since", "f8"), ("reached", "f8"), ("failed", "i8")]
)

# All that is told to a vehicle and remembered by it; of the autopilots it has one.
VESSEL = np.dtype(
    [
        ("order", ORDER),
        ("watch", WATCH),
        ("progress", tracks.PROGRESS),
        ("trend", drift.TREND),
        ("bluerov2", bluerov2.MEMORY),
        ("remus100", remus100.MEMORY),
        ("otter", otter.MEMORY),
        ("cybership2", cybership2.MEMORY),
    ]
)


class Craft(NamedTuple):
    """How vehicles of a model move: their equations (see `rk4`) and what these read, the control
    interval (s), the step (s) of the integration, and how many of them an interval has.
    """

    model: int
    p: Floats
    control: float
    step: float
    steps: int


class Knowledge(NamedTuple):
    """What vehicles know of their places, each in its row: how wrong that is (m), what fixes have
    put right (m), what a filter has learnt, if it `has_learnt`; and the logs, in which headings are
    summed up.
    """

    drift: SteeringDrift
    noise: Floats
    corrections: Floats
    learnt: Rows
    has_learnt: bool
    logs: Floats


@compiled
def _observe(state: Floats, current: Floats, depth: float, rates: Floats) -> Spot:
    """Return where a vehicle is and how it moves; `rates` are written over."""
    if state.size >= rk4.PITCHING_STATE:
        flow = move_rigid_body(state, current[0], current[1], rates)
        ahead, aside = flow[0], flow[1]
        z, yaw, sinking, turning = state[2], state[5], rates[2], rates[5]
    else:
        ahead, aside = move_surface_craft(state, current[0], current[1], rates)
        z, yaw, sinking, turning = depth, state[2], 0.0, rates[2]
    return Spot(
        state[0], state[1], z, yaw, rates[0], rates[1], sinking, turning, ahead, aside
    )  # fmt: skip


@compiled
def _log(
    model: int, vehicle: int, state: Floats, spot: Spot, current: Floats, drift: SteeringDrift,
    bias: Floats,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return what a vehicle's log measures, as `belief.read_log` does.

    Ahead and to starboard a REMUS measures its velocity through the water in any case; surface
    craft do not ask for it.
    """
    own = 0.0, 0.0
    if state.size >= rk4.PITCHING_STATE:
        share = 1.0 if drift.through_water or model != rk4.BLUEROV2 else 0.0
        own = state[6] - share * spot.ahead, state[7] - share * spot.aside
    return belief.read_log(spot, own, current, drift, vehicle, bias)


@compiled
def _feel(state: Floats, wrong: Wrong, vehicle: int, felt: Floats) -> None:
    """Write the state of a vehicle with the heading that its compass tells to `felt`."""
    for k in range(state.size):
        felt[k] = state[k]
    felt[heading_place(state)] += wrong.skews[vehicle].turned


@inlined
def heading_place(state: Floats) -> int:
    """Return where in a state the yaw stands."""
    return 5 if state.size >= rk4.PITCHING_STATE else 2


@compiled
def _sense(
    craft: Craft, vehicle: int, interval: int, state: Floats, spot: Spot, current: Floats,
    known: Knowledge, vessel: Row,
) -> Sensed:  # fmt: skip
    """Return what a vehicle knows at the beginning of a control interval, to steer by.

    Its `state` is true but for the heading, which is by compass.
    """
    time, line = interval * craft.control, known.logs[vehicle, interval * craft.steps]
    order, wrong, begin = vessel.order, known.drift.wrong, known.logs[vehicle, 0]
    cosine, sine = by_compass(line[logs.COS], line[logs.SIN], wrong, vehicle)
    if wrong.biases.shape[1] > 1 and interval > 0:
        follow(wrong, vehicle, interval, cosine, sine)
    way = spot.x - begin[logs.X], spot.y - begin[logs.Y]
    wrong_n, wrong_e = error(time, (cosine, sine), way, wrong, vehicle)
    fix = known.noise[vehicle, min(interval, known.noise.shape[1] - 1)]
    right = known.corrections[vehicle]
    off_n = spot.x + wrong_n + fix[0] + right[0] - order.north
    off_e = spot.y + wrong_e + fix[1] + right[1] - order.east
    bias = wrong.biases[vehicle, min(interval, wrong.biases.shape[1] - 1)]
    log = _log(craft.model, vehicle, state, spot, current, known.drift, bias)
    set_n = set_e = 0.0
    if known.has_learnt:
        learnt = learnt_drift(known.learnt[vehicle])
        told = Told(time, spot.x + wrong_n, spot.y + wrong_e, cosine, sine)
        carried_n, carried_e = expected_error(learnt, way_since(learnt, told, wrong.in_body))
        off_n, off_e = off_n - carried_n, off_e - carried_e
        yaw = state[heading_place(state)] if wrong.in_body else 0.0
        set_n, set_e = belief.set_of(yaw, (log[0], log[1]), learnt)
    elif known.drift.through_water:
        drift.learn(time, right[0], right[1], vessel.trend)
        set_n, set_e = vessel.trend.rate[0], vessel.trend.rate[1]
    return Sensed(
        state, spot.sinking, off_n, off_e, log[0], log[1], log[2], log[3], set_n, set_e
    )  # fmt: skip


@compiled
def _look_out(time: float, off: float, reached: float, speed: float, watch: Row) -> int:
    """Return whether a vehicle has been off its station, or made no headway, for too long.

    `off` is its distance from station (m), `reached` how far along its path it has come (m; not a
    number for who keeps a station or has arrived), `speed` what it was told to make (m/s).
    """
    if not isfinite(reached):
        if off <= watch.reach:
            watch.since = time
        return ADRIFT if time - watch.since > watch.patience else HEALTHY
    spent = time - watch.since
    if spent < watch.patience:
        return HEALTHY
    idle = reached - watch.reached < HEADWAY * speed * spent
    watch.failed = watch.failed + 1 if idle else 0
    watch.since, watch.reached = time, reached
    return STUCK if watch.failed >= PATIENT_FOR else HEALTHY


@compiled
def _turning(sensed: Sensed, aim: Aim, paths: Tracks, bounds: Row, progress: Row) -> float:
    """Return the yaw rate (rad/s) that the path will soon ask for."""
    north, east = sensed.log_n + sensed.set_n, sensed.log_e + sensed.set_e
    ground = north * cos(aim.yaw) + east * sin(aim.yaw)
    ahead = max(ground, 0.0) * remus100.LEAD
    return ground * tracks.bend_ahead(paths.rows, bounds, progress, ahead)


@compiled
def _steer(
    craft: Craft, sensed: Sensed, aim: Aim, turning: float, vessel: Row, work: Floats,
    command: Floats,
) -> bool:  # fmt: skip
    """Write the command for the next interval; return whether it reached a limit."""
    p, control, order = craft.p, craft.control, vessel.order
    if craft.model == rk4.BLUEROV2:
        return bluerov2.steer(sensed, aim, order, control, p, vessel.bluerov2, work, command)
    if craft.model == rk4.OTTER:
        return otter.steer(sensed, control, p, vessel.otter, command)
    if craft.model == rk4.CYBERSHIP2:
        return cybership2.steer(sensed, control, p, vessel.cybership2, command)
    return remus100.steer(sensed, aim, turning, order, control, p, vessel.remus100, command)


@compiled
def _hold(
    craft: Craft, state: Floats, command: Floats, current: Floats, depth: float, log: Floats,
    line: int, work: Floats,
) -> bool:  # fmt: skip
    """Move one vehicle through an interval, logging what lies within; return whether it is sound.

    `line` of the log is the interval's beginning, already written; its end is not yet.
    """
    for k in range(1, craft.steps + 1):
        sound = rk4.move(
            craft.model, state, command, current[0], current[1], craft.p, craft.step, work
        )
        if not sound:
            return False
        if k < craft.steps:
            logbook.note(log, line + k, craft.step, _observe(state, current, depth, work[0]))
    return True


@entry
def fly(
    model: int, p: Floats, control: float, step: float, steps: int, states: Floats, vessels: Rows,
    rows: Rows, bounds: Rows, currents: Floats, walks: Floats, walk_rate: float, biases: Floats,
    offsets: Floats, held_s: float, in_body: bool, skews: Rows, through_water: bool, noise: Floats,
    corrections: Floats, learnt: Rows, has_learnt: bool, logs: Floats, active: Ints,
    saturated: Flags, first: int, last: int, lost: Floats,
) -> int:  # fmt: skip
    """Move a fleet, in place, through the control intervals `first` to `last` (not included).

    Vehicles are the first axis of `states`, `vessels`, `bounds`, `walks` (samples, 2), `biases` and
    `offsets` (intervals or 1, 2), `skews`, `noise` (intervals or 1, 2), `corrections`
    (2,), `learnt`, `logs` (boundaries, COLUMNS), `active` and `saturated` (intervals,). Of
    `currents` (any, 2) the last row holds. Returns -1, or the vehicle lost, with `lost` holding how
    it fares and when (s).
    """
    craft, paths = Craft(model, p, control, step, steps), Tracks(rows, bounds)
    wrong = Wrong(walks, walk_rate, biases, offsets, held_s, in_body, skews)
    drift = SteeringDrift(wrong, through_water)
    known = Knowledge(drift, noise, corrections, learnt, has_learnt, logs)
    work, command, scratch = np.empty((5, states.shape[1])), np.empty(6), np.empty(6)
    felt = np.empty(states.shape[1])
    aim, turning, reached = Aim(0.0, 0.0, 0.0, 0.0), 0.0, nan
    for i in range(states.shape[0]):
        state, vessel, log, bound = states[i], vessels[i], logs[i], bounds[i]
        order, way = vessel.order, vessel.progress
        for interval in range(first, last):
            time, line = interval * control, interval * steps
            current = currents[min(interval, currents.shape[0] - 1)]
            spot = _observe(state, current, order.depth, work[0])
            logbook.note(log, line, step, spot)
            _feel(state, wrong, i, felt)
            sensed = _sense(craft, i, interval, felt, spot, current, known, vessel)
            if rows.size > 0:  # there are paths, and stations are at the origin
                aim = tracks.locate(rows, bound, way, sensed.off_n, sensed.off_e)
                active[i, interval] = way.row
                reached = tracks.travelled(rows, way) if aim.left > ARRIVED else nan
                turning = _turning(sensed, aim, paths, bound, way)
            saturated[i, interval] = _steer(craft, sensed, aim, turning, vessel, scratch, command)
            off = hypot(spot.x - order.north, spot.y - order.east)
            status = _look_out(time, off, reached, order.speed, vessel.watch)
            if not _hold(craft, state, command, current, order.depth, log, line, work):
                status = BROKEN
            if status != HEALTHY:
                lost[0], lost[1] = status, time
                return i
        spot = _observe(state, currents[0], order.depth, work[0])
        logbook.note(log, last * steps, step, spot)
    return -1
