"""How a mission of guided vehicles begins: what is asked of them is checked, and they are put where
they start.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import ceil, floor, isfinite, pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.arrays import Floats
from ...geometry.paths import Path, Segment
from ...records.rows import Rows
from ..currents import CONTROL_S
from ..hulls import MODELS, parameters, steady_speed
from ..hulls.models import Model
from . import flight
from .autopilots import AUTOPILOTS, InitialState, PathFollower, VehicleParameters, follower, keeper

LOST_CIRCLES = 10.0  # watch circles off its station, a vessel is no longer keeping it
PATIENCE_S = 120.0  # off or without headway for longer: ten times the memory of the slowest loop
WHOLE = 1e-9  # rounding, in steps, within which a control interval is a whole number of them


class GuidanceError(RuntimeError):
    """A vehicle cannot go where it is told to: `vehicle` (its name), `time_s` and `reason`."""

    def __init__(self, vehicle: str, time_s: float, reason: str) -> None:
        super().__init__(vehicle, time_s, reason)  # all of it: SimPy and pickle make it anew
        self.vehicle, self.time_s, self.reason = vehicle, time_s, reason

    def __str__(self) -> str:
        return f"{self.vehicle} at {self.time_s:.6g} s: {self.reason}"


@dataclass(frozen=True)
class DeparturePlan:
    """Where the vehicles of a fleet are to go, and what they are called.

    AUVs follow `paths` at a speed and a depth, either one number or one for each; ASVs keep
    `stations` (n, 2).
    """

    paths: Sequence[Path] | None = None
    stations: ArrayLike | None = None
    speed_m_per_s: ArrayLike = 0.0
    depth_m: ArrayLike = 0.0
    names: Sequence[str] | None = None


@dataclass(frozen=True)
class SteeringIntervals:
    """How often a fleet is steered, a whole number of steps, and how long each step is.

    Unless given, a step is 0.05 s, of an Otter 0.02 s, of a REMUS 0.1 s.
    """

    control_s: float = CONTROL_S
    step_s: float | None = None


@dataclass(frozen=True)
class FlightState:
    """The vehicles of a fleet as the compiled flight moves them; arrays change in place.

    `hull` is what the equations of motion read; by vehicle: `states` (n, state), and `own`
    (n,), flight.VESSEL, what each is told and remembers.
    """

    hull: Floats
    states: Floats
    own: Rows


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
    """Return the steps (s) in a control interval (s); ValueError unless a whole number of them."""
    if not (isfinite(control) and isfinite(step) and control > 0.0 and step > 0.0):
        raise ValueError(f"{model}: control_s {control!r} and step_s {step!r} must be above zero")
    steps = round(control / step)
    if steps < 1 or abs(control / step - steps) > WHOLE:
        raise ValueError(
            f"{model}: control_s {control} is not a whole multiple of step_s {step}; "
            f"{max(steps, 1) * step:g} would be"
        )
    return steps


def rows(model: str, what: str, values: ArrayLike, shape: tuple[int | None, ...]) -> Floats:
    """Return a fresh array of finite numbers; None in `shape` leaves a length (above 0) open."""
    array = np.array(values, dtype=np.float64, order="C")
    wanted = tuple("any" if length is None else length for length in shape)
    fits = len(array.shape) == len(shape) and all(
        has == length or (length is None and has > 0)
        for has, length in zip(array.shape, shape, strict=True)
    )
    if not fits:
        raise ValueError(f"{model}: {what} has shape {array.shape}, not {wanted}")
    if not np.isfinite(array).all():
        raise ValueError(f"{model}: {what} holds a number that is not finite")
    return array


def for_each(model: str, what: str, value: ArrayLike, count: int) -> Floats:
    """Return one number for each of `count` vehicles, given one for all or one for each."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in ((), (count,)):
        raise ValueError(f"{model}: {what} has shape {array.shape}, neither () nor ({count},)")
    if not np.isfinite(array).all():
        raise ValueError(f"{model}: {what} holds a number that is not finite")
    return np.array(np.broadcast_to(array, (count,)))


def circled(path: Path, radius: float) -> Path:
    """Return the path with a circle to starboard at its end, round and round (radius in m)."""
    if path.repeats_from is not None:
        return path
    circle = Segment(1.0 / radius, 2.0 * pi * radius)
    return Path(path.start, (*path.segments, circle), repeats_from=path.length)


def _vessels(kind: Model, body: Any, count: int) -> FlightState:
    own = np.zeros(count, dtype=flight.VESSEL)
    own["watch"]["patience"] = PATIENCE_S
    return FlightState(kind.pack(body), np.zeros((count, len(kind.states))), own)


def on_paths(
    kind: Model, body: Any, paths: Sequence[Path], speed: Floats, depth: Floats, current: Floats,
    missed: float,
) -> FlightState:  # fmt: skip
    """Return AUVs at the beginnings of their paths; speeds (m/s) and depths (m) (n,).

    A BlueROV2 is at rest, in trim: over ground, or in the water if its log sees only that (`missed`
    is 1, the share of the current that escapes it, else 0); a REMUS at its speed through the water,
    carried by the current.
    """
    vessels = _vessels(kind, body, len(paths))
    own_body, begin = (
        VehicleParameters(kind.name, body, {}, vessels.hull),
        follower(kind.name).begin,
    )
    vessels.own["order"]["speed"], vessels.own["order"]["depth"] = speed, depth
    vessels.own["watch"]["reach"] = np.inf
    vessels.states[:, 2] = depth
    for number, path in enumerate(paths):
        state, own = vessels.states[number], vessels.own[number]
        state[0], state[1], state[kind.heading] = path.start
        begin(own_body, InitialState(float(speed[number]), current, missed), own, state)
    return vessels


def at_stations(
    kind: Model, body: Any, stations: Floats, depth: Floats, current: Floats
) -> FlightState:
    """Return ASVs at rest at their stations (n, 2) m, bow against the current, else North."""
    vessels = _vessels(kind, body, len(stations))
    vessels.states[:, :2] = stations
    if current.any():
        vessels.states[:, kind.heading] = np.arctan2(-current[1], -current[0])
    order, autopilot = vessels.own["order"], keeper(kind.name)
    order["north"], order["east"] = stations.T
    order["depth"] = depth
    vessels.own["watch"]["reach"] = LOST_CIRCLES * autopilot.watch_circle_m
    autopilot.begin(VehicleParameters(kind.name, body, {}, vessels.hull), vessels.own)
    return vessels


def refuse_impossible(
    model: str,
    overrides: Mapping[str, float] | None,
    names: Sequence[str],
    speed: Floats,
    currents: Floats,
) -> None:
    """Raise GuidanceError for a speed above a vehicle's own, or a current that carries it away.

    `speed` (n,) m/s, not read for vehicles that keep stations; of `currents` (k, 2) m/s the mean
    counts, since a vehicle makes up for what a gust has cost it.
    """
    fastest, follows = top_speed(model, overrides), isinstance(AUTOPILOTS[model], PathFollower)
    for vehicle, asked in zip(names, speed.tolist(), strict=True):
        if follows and not 0.0 < asked <= fastest:
            raise GuidanceError(
                vehicle,
                0.0,
                f"asked for {asked:g} m/s, but a {model} reaches {_reached(fastest)} m/s; ask for "
                "a speed above zero and not above that",
            )
    mean = float(np.hypot(*currents.mean(axis=0)))
    if (found := too_strong(model, overrides, speed.tolist(), mean)) is not None:
        raise GuidanceError(names[found[0]], 0.0, found[1])


def too_strong(
    model: str, overrides: Mapping[str, float] | None, speeds: Sequence[float], current: float
) -> tuple[int, str] | None:
    """Return the first of some vehicles that a current (m/s) would carry away, and why; None if
    they make headway.

    `speeds` (m/s) is what each is asked for, read of hulls that cannot stop; the others make up for
    a current by what they can do beyond that.
    """
    fastest, autopilot = top_speed(model, overrides), AUTOPILOTS[model]
    cannot_stop = isinstance(autopilot, PathFollower) and autopilot.cannot_stop
    for number, asked in enumerate(speeds):
        own = asked if cannot_stop else fastest
        if current >= own:
            return number, (
                f"the current of {current:.3f} m/s is stronger than the {own:.3f} m/s that it "
                "makes through the water, and would carry it away"
            )
    return None


def top_speed(model: str, overrides: Mapping[str, float] | None = None) -> float:
    """Return the speed through still water (m/s) that full command gives, straight ahead.

    Raises ValueError for a model or a parameter that there is not.

    >>> round(top_speed("bluerov2"), 2), round(top_speed("cybership2"), 2)
    (0.73, 0.58)
    """
    return _top_speed(model, _frozen(overrides))


@cache
def _top_speed(model: str, overrides: tuple[tuple[str, float], ...]) -> float:
    command = AUTOPILOTS[model].full_ahead(_body(model, overrides))
    step = AUTOPILOTS[model].settling_step_s
    return steady_speed(model, command, overrides=dict(overrides), step_s=step)


def smallest_turn(model: str, speed: float, overrides: Mapping[str, float] | None = None) -> float:
    """Return the radius (m) with which a vehicle's path may turn at a speed (m/s).

    REMUS: 1.3 times the circle in which it settles with full rudder. BlueROV2: what the shares of
    its thrusters and its yaw loop allow. Raises ValueError for a model that follows no path and a
    speed that it does not reach.

    >>> round(smallest_turn("bluerov2", 0.6), 2), round(smallest_turn("remus100", 1.5), 1)
    (1.01, 27.2)
    """
    follower(model)
    fastest = top_speed(model, overrides)
    if not 0.0 < speed <= fastest:
        raise ValueError(
            f"{model}: a speed of {speed} m/s is not between 0 and the {_reached(fastest)} m/s "
            "that it reaches"
        )
    return _smallest_turn(model, float(speed), _frozen(overrides))


def _reached(speed: float) -> str:
    """Return a top speed (m/s) as one may ask for it: rounded down.

    >>> _reached(0.73379), _reached(2.554)
    ('0.733', '2.554')
    """
    return f"{floor(1e3 * speed + WHOLE) / 1e3:.3f}"


@cache
def _smallest_turn(model: str, speed: float, overrides: tuple[tuple[str, float], ...]) -> float:
    return follower(model).smallest_turn(_body(model, overrides), speed)


def _frozen(overrides: Mapping[str, float] | None) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((overrides or {}).items()))


def _body(model: str, overrides: tuple[tuple[str, float], ...]) -> VehicleParameters:
    own = parameters(model, dict(overrides))
    return VehicleParameters(model, own, dict(overrides), MODELS[model].pack(own))
