"""A fleet with dynamics under way: vehicles of one model, each with its controller, in one sea."""

from collections.abc import Mapping, Sequence
from math import ceil, cos, degrees, inf, isfinite, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ....support.arrays import Floats
from ....support.packed import Packed
from ...geometry.paths import Path, Segment
from ...records.rows import LEARNT, Rows
from .. import motion
from ..bottom import Keeping
from ..currents import SAMPLES, STILL, Field, beyond, sampled
from ..hulls import rk4
from ..hulls.fleet import find, numbers, parameters
from ..hulls.forces import Coefficients
from ..motion import Motion
from ..vehicle import Vehicle
from . import flight, sensing, tracks
from .departure import (
    FOLLOWING,
    WHOLE,
    DeparturePlan,
    GuidanceError,
    SteeringIntervals,
    refuse_impossible,
    smallest_turn,
)
from .sensing import Craft, SteeringDrift

LOST_CIRCLES = 10.0  # radii of its watch circle: a vessel farther off is no longer keeping station
PATIENCE_S = 120.0  # s off station or without headway: ten times the memory of the slowest loop


def begun(time: float, control: float) -> int:
    """Return how many control intervals, k * control (s), begin before an instant (s).

    >>> begun(0.0, 0.1), begun(0.05, 0.1), begun(3 * 0.1, 0.1), begun(0.31, 0.1)
    (0, 1, 3, 4)
    """
    if not isfinite(time):
        raise ValueError(f"an instant must be a finite number of seconds, not {time!r}")
    count = max(ceil(time / control), 0)
    while count > 0 and (count - 1) * control >= time:
        count -= 1
    while count * control < time:
        count += 1
    return count


def whole_steps(model: str, control: float, step: float) -> int:
    """Return the number of steps (s) in a control interval (s); ValueError unless it is whole."""
    if not (isfinite(control) and isfinite(step) and control > 0.0 and step > 0.0):
        raise ValueError(f"{model}: control_s {control!r} and step_s {step!r} must be above zero")
    steps = round(control / step)
    if steps < 1 or abs(control / step - steps) > WHOLE:
        raise ValueError(
            f"{model}: control_s {control} is not a whole multiple of step_s {step}; "
            f"{max(steps, 1) * step:g} would be"
        )
    return steps


def _for_each(model: str, what: str, value: ArrayLike, count: int) -> Floats:
    """Return one number for each of `count` vehicles, given one for all or one for each."""
    shape = () if np.ndim(value) == 0 else (count,)
    return np.array(np.broadcast_to(numbers(model, what, value, shape), (count,)))


def circled(path: Path, radius: float) -> Path:
    """Return the path with an endless circle to starboard (radius in m) at its end."""
    if path.repeats_from is not None:
        return path
    circle = Segment(1.0 / radius, 2.0 * pi * radius)
    return Path(path.start, (*path.segments, circle), repeats_from=path.length)


class GuidedVehicle(Vehicle):
    """A vehicle that moves as its controller, its hull and the sea make it move.

    It answers for the past and the present; asked for a later instant, its whole fleet moves on.
    """

    def __init__(self, fleet: "GuidedFleet", number: int) -> None:
        super().__init__(fleet.motion, number)
        self._fleet = fleet

    def _advance(self, time: float) -> None:
        self._fleet.advance(time)

    def along(self, time: float) -> float | None:
        """Return how far (m) along its path the vehicle is at an instant (s), its position on an
        arc not counted; None if it keeps station.
        """
        fleet, place = self._fleet, self.at(time)
        if len(fleet.stations):
            return None
        _, end, again = fleet.tracks.bounds[self._number].item()
        flown = fleet.active[self._number, : max(begun(time, fleet.control_s), 1)]
        row = fleet.tracks.rows[flown[-1]]
        x, y, yaw, curvature, begin, length, *_ = row.item()
        into = (place.x - x) * cos(yaw) + (place.y - y) * sin(yaw)
        into = min(max(into, 0.0), length) if curvature == 0.0 else 0.0
        laps = int(np.count_nonzero(flown[1:] < flown[:-1]))
        last = fleet.tracks.rows[end - 1]
        lap = last["begin"] + last["length"] - fleet.tracks.rows[again]["begin"]
        return float(begin + into + laps * lap)

    def saturated(self, time: float) -> float:
        """Return the share of its control instants before an instant (s) at an actuator's limit."""
        self._fleet.advance(time)
        instants = max(begun(time, self._fleet.control_s), 1)
        return float(self._fleet.at_limit[self._number, :instants].mean())

    def path_error(self, times: Floats) -> Floats:
        """Return the distance (m) of the true position from path or station at instants (s)."""
        fleet = self._fleet
        if len(fleet.stations):
            off = self._lines(times)[:, :2] - fleet.stations[self._number]
            return np.asarray(np.hypot(off[:, 0], off[:, 1]))
        instants = self._until(times)
        errors = np.empty(len(instants))
        flight.beside(fleet.flight.address, self._number, instants, errors)
        return errors


USUAL = SteeringIntervals()


class Shared(NamedTuple):
    """Arrays that fleets of several models may share, each with its own rows: the lines of all
    logs, vehicle after vehicle; sums of the corrections by fixes (n, 2), m; what filters have
    learnt (n,).
    """

    table: Floats
    corrections: Floats
    learnt: Rows

    @classmethod
    def alone(cls, count: int, lines: int) -> "Shared":
        """Return arrays for `count` vehicles of one model, each with `lines` lines in its log."""
        return cls(
            np.zeros((count * lines, motion.COLUMNS)),
            np.zeros((count, 2)),
            np.zeros(count, dtype=LEARNT),
        )


def lines_of(model: str, duration_s: float) -> int:
    """Return how many lines the log of a vehicle has that is integrated for a duration (s)."""
    steps = whole_steps(model, USUAL.control_s, find(model).step_s)
    return max(1, begun(duration_s, USUAL.control_s)) * steps + 1


class GuidedFleet:
    """Vehicles of one model under way, moved only as far as their positions are asked for.

    A BlueROV2 starts from rest; its speed is over ground, or through the water if its log misses
    the current. A REMUS starts at its speed, which is through the water. At the end of its path a
    REMUS circles to starboard, a BlueROV2 hovers. ASVs start at rest with the bow against the first
    current. `currents` (k, 2), m/s along x and y, and `position_noise` (n, intervals, 2), m, hold
    for one control interval each, the last current from then on; the `field` of the current adds to
    it where a vehicle is. Axes: x North, y East, z down.

    A vehicle's estimate is truth + drift + noise + its row of `corrections` (n, 2), the sum of the
    corrections by its fixes, which the navigator writes. A log through the water does not measure
    the current; a vehicle learns it from its corrections, or from a filter that writes the bias and
    current that it has learnt to a row of `learnt` (n,) and sets `has_learnt`. Without drift the
    instants and the number of advances do not matter. Its arrays may be part of those `shared` with
    other models.

    Raises ValueError for arguments that do not fit, GuidanceError for what cannot be flown.
    """

    def __init__(
        self,
        model: str,
        plan: DeparturePlan,
        overrides: Mapping[str, float] | None = None,
        *,
        duration_s: float,
        intervals: SteeringIntervals = USUAL,
        currents: ArrayLike = ((0.0, 0.0),),
        field: Field = STILL,
        position_noise: Floats | None = None,
        drift: SteeringDrift | None = None,
        shared: Shared | None = None,
    ) -> None:
        self.model = kind = find(model)
        _refuse_wrong_plan(model, plan)
        paths, self.stations = plan.paths, np.zeros((0, 2))
        if plan.stations is not None:
            self.stations = numbers(model, "stations", plan.stations, (None, 2))
        count = len(self.stations) if paths is None else len(paths)
        self.names = _names(model, plan.names, count)
        self.control_s, self.duration_s = float(intervals.control_s), float(duration_s)
        self.step_s = float(kind.step_s if intervals.step_s is None else intervals.step_s)
        steps = whole_steps(model, self.control_s, self.step_s)
        self._intervals = max(1, begun(self.duration_s, self.control_s))
        lines = self._intervals * steps + 1
        self._currents = numbers(model, "currents", currents, (None, 2))
        self._field = field
        noise = np.zeros((count, 1, 2)) if position_noise is None else position_noise
        length = 1 if position_noise is None else self._intervals
        noise = numbers(model, "position_noise", noise, (count, length, 2))
        #: Whether its vehicles steer by their estimates.
        self.by_estimate = drift is not None
        self._or_by_fixes = ", or thrown about by its fixes" * self.by_estimate
        drift = sensing.for_fleet(model, drift, count, self.duration_s, self.control_s)
        if shared is None:
            shared = Shared.alone(count, lines)
        self.corrections, self.learnt = shared.corrections, shared.learnt
        self.has_learnt = False
        # orders, and memory of the controllers
        self._own = np.zeros(count, dtype=flight.VESSEL)
        self._own["order"]["speed"] = _for_each(model, "speed_m_per_s", plan.speed_m_per_s, count)
        self._own["order"]["depth"] = _for_each(model, "depth_m", plan.depth_m, count)
        self._own["watch"]["patience"] = PATIENCE_S
        self._states = np.zeros((count, len(kind.states)))
        hull = kind.coefficients(parameters(model, overrides))
        speeds = self._own["order"]["speed"]
        self._mean_currents = self._met_on(paths)
        refuse_impossible(model, overrides, self.names, speeds, self._mean_currents)
        if paths is None:
            self.tracks = tracks.nowhere(count)
            self._lie_at_stations()
        else:
            self._begin_paths(plan, paths, hull, drift)
            if kind.cannot_stop:
                paths = [
                    circled(path, smallest_turn(model, speed, overrides))
                    for path, speed in zip(paths, speeds.tolist(), strict=True)
                ]
            self.tracks = tracks.pack(paths)
        # Lines beyond the instant that the fleet was last advanced to are not written yet.
        self.logs = shared.table.reshape(count, lines, -1)
        ends = np.arange(count + 1) * lines
        self.motion = Motion(shared.table, ends, np.full(count, self.step_s))
        self.active = np.zeros((count, self._intervals), dtype=np.int64)
        self._own["progress"]["row"] = self.tracks.bounds["first"]
        # whether an actuator was at its limit, for each vehicle and control instant
        self.at_limit = np.zeros((count, self._intervals), dtype=np.bool_)
        self._flown, self._lost = 0, np.zeros(2)
        craft = Craft(kind.equations, len(kind.states), self.control_s, self.step_s, steps)
        #: All arrays that compiled code reads and writes.
        self.flight = Packed(
            flight.Flight(
                craft, rk4.packed(hull), self._states, self._own, self.tracks,
                plan.bottom, plan.keeping or Keeping(0.0, 0.0, 0.0), self._currents, field, drift,
                noise, self.corrections, self.learnt, self.logs, self.active,
                self.at_limit, self._lost,
            )
        )  # fmt: skip
        self._move_on(0)  # write the lines of the start

    def _begin_paths(
        self,
        plan: DeparturePlan,
        paths: Sequence[Path],
        hull: Coefficients,
        drift: SteeringDrift,
    ) -> None:
        """Put AUVs where their paths begin; some logs miss the current there."""
        kind, orders = self.model, self._own["order"]
        self._own["watch"]["reach"] = np.inf
        if plan.keeping is not None:
            starts = [path.start for path in paths]
            orders["depth"] = plan.keeping.depths(plan.bottom, starts)
        self._states[:, 2] = orders["depth"]
        for number, path in enumerate(paths):
            state, memory = self._states[number], self._own[number][kind.autopilot]
            state[0], state[1], state[kind.heading] = path.start
            assert kind.begin is not None
            speed = float(orders["speed"][number])
            current = self._first_current(*state[:3].tolist())
            high = float(plan.bottom.below([state[:2]])[0]) - state[2]
            misses = drift.through_water or (drift.sees_m < inf and not high <= drift.sees_m)
            kind.begin(hull, speed, current, float(misses), memory, state)

    def _first_current(self, x: float, y: float, z: float) -> Floats:
        """Return the current (m/s) at a position (m) as the mission begins, (2,)."""
        return np.asarray(self._currents[0] + beyond(self._field, 0.0, x, y, z))

    def _met_on(self, paths: Sequence[Path] | None) -> Floats:
        """Return the mean current (m/s) at each vehicle's station or along its path, (n,)."""
        times = np.linspace(0.0, self.duration_s, SAMPLES)
        means = np.tile(self._currents.mean(axis=0), (len(self.names), 1))
        orders = self._own["order"]
        for number, (speed, depth) in enumerate(zip(orders["speed"], orders["depth"], strict=True)):
            places = np.full((SAMPLES, 3), depth)
            if paths is None:
                places[:, :2] = self.stations[number]
            else:
                places[:, :2] = paths[number].sample(speed * times)[:, :2]
            means[number] += sampled(self._field, times, places).mean(axis=0)
        return np.asarray(np.hypot(*means.T))

    def _lie_at_stations(self) -> None:
        """Put ASVs at rest at their stations, bow against the current, else North."""
        orders = self._own["order"]
        self._states[:, :2] = self.stations
        for state, (x, y) in zip(self._states, self.stations.tolist(), strict=True):
            current = self._first_current(x, y, 0.0)
            if current.any():
                state[self.model.heading] = np.arctan2(-current[1], -current[0])
        orders["north"], orders["east"] = self.stations.T
        self._own["watch"]["reach"] = LOST_CIRCLES * self.model.watch_circle_m

    def advance(self, time_s: float) -> None:
        """Move the fleet through every control interval that begins before `time_s`.

        Raises ValueError beyond the trajectory's duration, GuidanceError for a vehicle lost on the
        way.
        """
        wanted = begun(time_s, self.control_s)
        if wanted <= self._flown:
            return
        if wanted > self._intervals:
            raise ValueError(
                f"{self.model.name}: {time_s} s lies beyond the trajectory of {self.duration_s} s; "
                "give it a longer duration_s"
            )
        self._move_on(wanted)

    def _move_on(self, wanted: int) -> None:
        """Fly up to the beginning of interval `wanted`, and write its state to the log."""
        lost = flight.fly(self.flight.address, self.has_learnt, self._flown, wanted)
        if lost >= 0:
            raise GuidanceError(self.names[lost], float(self._lost[1]), self._reason(lost))
        self._flown = wanted

    def _reason(self, vehicle: int) -> str:
        status, state = int(self._lost[0]), self._states[vehicle]
        if status == flight.ADRIFT:
            circle = LOST_CIRCLES * self.model.watch_circle_m
            return (
                f"more than {circle:g} m off its station for {PATIENCE_S:g} s; the current is "
                "stronger than its thrust, or the station was never reached"
            )
        if status == flight.STUCK:
            spent, current = flight.PATIENT_FOR * PATIENCE_S, self._mean_currents[vehicle]
            return (
                f"no headway along its path for {spent:g} s: asked for "
                f"{self._own['order']['speed'][vehicle]:g} m/s in a current of "
                f"{current:.3g} m/s, it is held up by that{self._or_by_fixes}; ask for "
                "more speed"
            )
        if not np.isfinite(state).all():
            return "its state became infinite or NaN; take a shorter step_s or other overrides"
        return (
            f"pitch {degrees(state[4]):.1f} deg is beyond +-{degrees(rk4.STEEPEST):.0f} deg; "
            "it has tumbled: ask for less speed"
        )

    def vehicle(self, number: int) -> GuidedVehicle:
        """Return one vehicle of the fleet by its number, counted from 0."""
        if not 0 <= number < len(self.names):
            raise ValueError(
                f"{self.model.name}: no vehicle {number} among {len(self.names)}; count from 0"
            )
        return GuidedVehicle(self, number)


def _refuse_wrong_plan(model: str, plan: DeparturePlan) -> None:
    """Raise ValueError unless AUVs have paths and ASVs stations."""
    keeping = [name for name in rk4.MODELS if name not in FOLLOWING]
    paths, stations, follows = plan.paths, plan.stations, model in FOLLOWING
    if (paths is not None) != follows or (stations is not None) == follows or paths == ():
        raise ValueError(
            f"{model}: give paths, and no stations, to {', '.join(FOLLOWING)}; "
            f"stations, and no paths, to {', '.join(keeping)}"
        )


def _names(model: str, names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"{model} {number}" for number in range(count))
    if len(names) != count:
        raise ValueError(f"{model}: {len(names)} names for {count} vehicles")
    return tuple(names)
