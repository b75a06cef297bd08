"""Hulls moved under given commands: `trajectory` follows one vehicle, `Fleet` moves several of one
model as far as they are asked for; `steady_turn` and `steady_speed` give the motion into which a
command settles.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import cos, degrees, inf, isfinite
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ....support.arrays import Floats
from ....support.wording import did_you_mean
from . import rk4
from .forces import Model
from .rk4 import MODELS

# Parameters with these endings are above zero: lags, masses, sizes, limits of actuators.
_ABOVE_ZERO = (
    "_s", "mass_kg", "inertia_kg_m2", "_m3", "length_m", "diameter_m", "_rad", "_rpm", "_n",
    "oswald_efficiency", "reference_area_fraction", "advance_at_speed",
    "gravity_m_per_s2",
)  # fmt: skip


class DivergenceError(FloatingPointError):
    """A vehicle's state became infinite, or its pitch left the range of Euler angles.

    `model`, `vehicle` (row in the fleet) and `time_s` (end of the step in which it happened) say
    which and when.
    """

    def __init__(self, model: str, vehicle: int, time_s: float, state: Floats) -> None:
        self.model, self.vehicle, self.time_s = model, vehicle, time_s
        who = f"{model}, vehicle {vehicle}, at {time_s:.6g} s"
        if np.isfinite(state).all():
            super().__init__(
                f"{who}: pitch {degrees(state[4]):.1f} deg is beyond +-{degrees(rk4.STEEPEST):.0f} "
                "deg, where Euler angles end; add a pitch loop or command less"
            )
        else:
            super().__init__(
                f"{who}: the state became infinite or NaN; take a shorter step_s "
                "(at most 0.1 s for these models) or smaller commands"
            )


def find(model: str) -> Model:
    """Return the model of a name; ValueError, with the known names, for an unknown one."""
    if model not in MODELS:
        known = ", ".join(MODELS)
        raise ValueError(
            f"unknown model {model!r}{did_you_mean(str(model), MODELS)}; known: {known}"
        )
    return MODELS[model]


def parameters(model: str, overrides: Mapping[str, float] | None = None) -> Any:
    """Return the parameters of a vehicle of a model: the published numbers, but for `overrides`.

    The result is the model's frozen dataclass (`Remus100`, `BlueRov2`, `Otter`, `CyberShip2`),
    units in its field names. Raises ValueError for a name the model does not have, a number that is
    not finite, and a size, mass or time constant that is not above zero.

    >>> parameters("remus100", {"yaw_time_constant_s": 5}).yaw_time_constant_s
    5.0
    """
    kind = find(model)
    allowed = [field.name for field in fields(kind.body)]
    values: dict[str, float] = {}
    for name, value in (overrides or {}).items():
        if name not in allowed:
            raise ValueError(
                f"{model}: unknown parameter {name!r}{did_you_mean(name, allowed)}; "
                f"allowed: {', '.join(allowed)}"
            )
        values[name] = _checked(model, name, value)
    return kind.body(**values)


def _checked(model: str, name: str, value: float) -> float:
    """Return a parameter as a float; ValueError if it is not finite, or a size that is not above
    zero.
    """
    if not isinstance(value, Real) or isinstance(value, bool) or not isfinite(value):
        raise ValueError(f"{model}: parameter {name} must be a finite number, not {value!r}")
    if value <= 0 and name.endswith(_ABOVE_ZERO) and "added" not in name:
        raise ValueError(f"{model}: parameter {name} must be above zero, not {value!r}")
    return float(value)


def numbers(
    model: str,
    what: str,
    values: ArrayLike,
    shape: tuple[int | None, ...],
    columns: Sequence[str] = (),
) -> Floats:
    """Return a fresh array of finite numbers; None in `shape` leaves a length (above 0) open.

    Raises ValueError, which names `what` if its shape is wrong, or the number that is not finite;
    `columns` are the names of the last axis.
    """
    array = np.array(values, dtype=np.float64, order="C")
    row = f": [{', '.join(columns)}]" if columns else ""
    if array.ndim != len(shape) or any(
        has != length if length is not None else has == 0
        for has, length in zip(array.shape, shape, strict=True)
    ):
        wanted = str(tuple("n" if length is None else length for length in shape)).replace("'", "")
        raise ValueError(f"{model}: {what} has shape {array.shape}, not {wanted}{row}")
    if not np.isfinite(array).all():
        place = np.argwhere(~np.isfinite(array))[0]
        names = [str(index) for index in place]
        names[-1] = columns[place[-1]] if columns else names[-1]
        raise ValueError(
            f"{model}: {what}[{', '.join(names)}] is {array[tuple(place)]}; every number must be "
            "finite"
        )
    return array


def step_length(model: str, step: float) -> float:
    """Return a step (s); ValueError unless it is finite and above zero."""
    if not (isfinite(step) and step > 0):
        raise ValueError(f"{model}: step_s must be a finite number above zero, not {step!r}")
    return float(step)


def _refuse_steep(model: Model, states: Floats) -> None:
    """Raise ValueError for a vehicle that starts at a pitch beyond +-89 deg."""
    if "theta" not in model.states:
        return
    for vehicle, pitch in enumerate(states[:, model.states.index("theta")]):
        if cos(pitch) < rk4.COS_STEEPEST:
            raise ValueError(
                f"{model.name}: vehicle {vehicle} starts at pitch {degrees(pitch):.1f} deg; Euler "
                f"angles need it within +-{degrees(rk4.STEEPEST):.0f} deg"
            )


class Fleet:
    """Vehicles of one model, each with its own command, on one grid of integration steps.

    `at(t)` returns their states, `command` gives one of them a new command. Steps begin at `start_s
    + k * step_s` and at the instants of commands, so a state does not depend, to the last bit, on
    which other instants were asked for.

    `states` (vehicles, state) at `start_s`; `commands` (vehicles, command), zero unless given;
    `current_m_per_s` North and East; `overrides` as in `parameters`. Raises ValueError for shapes
    and numbers that do not fit the model.
    """

    def __init__(
        self,
        model: str,
        states: ArrayLike,
        *,
        commands: ArrayLike | None = None,
        current_m_per_s: Sequence[float] | Floats = (0.0, 0.0),
        overrides: Mapping[str, float] | None = None,
        step_s: float = 0.05,
        start_s: float = 0.0,
    ) -> None:
        self.model = kind = find(model)
        self._hull = rk4.packed(kind.coefficients(parameters(model, overrides)))
        self._states = numbers(model, "states", states, (None, len(kind.states)), kind.states)
        _refuse_steep(kind, self._states)
        count, columns = len(self._states), len(kind.commands)
        rows = np.zeros((count, columns)) if commands is None else commands
        self._commands = numbers(model, "commands", rows, (count, columns), kind.commands)
        compass = "North", "East"
        current = numbers(model, "current_m_per_s", current_m_per_s, (2,), compass)
        self._current = float(current[0]), float(current[1])
        self._step, self._start = step_length(model, step_s), float(start_s)
        self._clocks = np.full(count, self._start)

    def at(self, time_s: float) -> Floats:
        """Return a copy of the states (vehicles, state) at `time_s`.

        Raises ValueError for a time before the last step boundary already passed, DivergenceError
        for a vehicle lost on the way.
        """
        time_s = self._advance(time_s)
        states, clocks = self._states.copy(), self._clocks.copy()
        self._move(states, self._commands, clocks, time_s, exactly=True)
        return states

    def command(self, time_s: float, vehicle: int, values: ArrayLike) -> None:
        """Command one vehicle from `time_s` on: `values` (command,); its step is split exactly
        there.

        Raises as `at` does, and ValueError for values that do not fit the model.
        """
        if not 0 <= vehicle < len(self._states):
            raise ValueError(
                f"{self.model.name}: no vehicle {vehicle} among {len(self._states)}; count from 0"
            )
        self._hold(time_s, slice(vehicle, vehicle + 1), np.atleast_2d(values))

    def command_all(self, time_s: float, values: ArrayLike) -> None:
        """Command each vehicle from `time_s` on by its row of `values` (vehicles, command).

        Raises as `command` does.
        """
        self._hold(time_s, slice(0, len(self._states)), values)

    def _hold(self, time_s: float, due: slice, values: ArrayLike) -> None:
        """Move the vehicles `due` to exactly `time_s`, and give them new commands."""
        shape, columns = self._commands[due].shape, self.model.commands
        rows = numbers(self.model.name, "values", values, shape, columns)
        time_s = self._advance(time_s)
        self._move(
            self._states[due], self._commands[due], self._clocks[due], time_s, due.start,
            exactly=True,
        )  # fmt: skip
        self._commands[due] = rows

    def _advance(self, time_s: float) -> float:
        """Move the fleet along its grid to the last boundary at or before `time_s`."""
        time_s = float(time_s)
        latest = float(self._clocks.max())
        if not (isfinite(time_s) and time_s >= latest - rk4.SAME_INSTANT * self._step):
            raise ValueError(
                f"{self.model.name}: time {time_s} s lies before {latest} s, where the fleet "
                "already is; ask in the order of time"
            )
        self._move(self._states, self._commands, self._clocks, time_s)
        return time_s

    def _move(
        self, states: Floats, commands: Floats, clocks: Floats, time_s: float, first: int = 0,
        *, exactly: bool = False,
    ) -> None:  # fmt: skip
        """Move these rows along the grid, or to exactly `time_s`; `first` is the number of their
        first vehicle.
        """
        lost = rk4.advance(
            self.model.equations, self._hull, states, commands, *self._current, clocks, self._start,
            self._step, time_s, exactly,
        )  # fmt: skip
        if lost >= 0:
            raise DivergenceError(self.model.name, first + lost, clocks[lost], states[lost])


def trajectory(
    model: str,
    times: ArrayLike,
    commands: ArrayLike,
    *,
    current_m_per_s: Sequence[float] | Floats = (0.0, 0.0),
    initial: ArrayLike | None = None,
    step_s: float = 0.05,
    overrides: Mapping[str, float] | None = None,
) -> Floats:
    """Follow one vehicle through the water: its state at each of `times`.

    `times` (n,) increasing (s); `commands` (n, command), row k held on [t_k, t_{k+1}), the last row
    never felt; `initial` (state,), at rest at the origin unless given; the result is (n, state).
    Columns are those of `MODELS[model].states` and `.commands`. The current (m/s, North and East)
    is uniform and constant; the velocities of a state are over ground. Steps of `step_s` are split
    exactly where the command changes, and only there, so a row does not depend on the other times.
    The Otter's propeller lag wants `step_s=0.02` for 1 mm where it reverses.

    Raises ValueError for an unknown model and for arguments that do not fit it, DivergenceError for
    a state that becomes infinite or pitches beyond +-89 deg.

    >>> trajectory("cybership2", [0, 10], [[1.5, 0, 0]] * 2)[-1, :3].round(3).tolist()
    [2.426, 0.0, 0.0]
    """
    kind, instants = find(model), numbers(model, "times", times, (None,))
    if (np.diff(instants) <= 0).any():
        k = int(np.argmax(np.diff(instants) <= 0)) + 1
        raise ValueError(
            f"{model}: times[{k}] = {instants[k]} does not follow times[{k - 1}] = "
            f"{instants[k - 1]}; times must increase"
        )
    shape = len(instants), len(kind.commands)
    rows = numbers(model, "commands", commands, shape, kind.commands)
    start = np.zeros(len(kind.states)) if initial is None else initial
    fleet = Fleet(
        model, [numbers(model, "initial", start, (len(kind.states),), kind.states)],
        commands=rows[:1], current_m_per_s=current_m_per_s, overrides=overrides, step_s=step_s,
        start_s=instants[0],
    )  # fmt: skip
    states = np.empty((len(instants), len(kind.states)))
    for k, instant in enumerate(instants):
        states[k] = fleet.at(instant)[0]
        if k and np.any(rows[k] != rows[k - 1]):
            fleet.command(instant, 0, rows[k])
    return states


WINDOW_S = 5.0  # motion is averaged over this long
SETTLED = 1e-6  # relative difference below which the averages of two windows are equal
PATIENCE_S = 4000.0  # the slowest motion here, yaw of a REMUS at 0.3 m/s, dies within minutes
NO_TURN = 1e-9  # rad/s: a vehicle that yaws less goes straight


@dataclass(frozen=True)
class SteadyTurn:
    """The circle into which a vehicle settles: horizontal speed (m/s), yaw rate (rad/s, positive to
    starboard), radius (m, positive, infinite on a straight line).
    """

    speed_m_per_s: float
    yaw_rate_rad_per_s: float
    radius_m: float


def steady_turn(
    model: str,
    command: ArrayLike,
    *,
    overrides: Mapping[str, float] | None = None,
    step_s: float = 0.05,
) -> SteadyTurn:
    """Return the circle into which a vehicle settles in still water with one command held.

    Solved by moving the vehicle from rest until speed and yaw rate, averaged over 5 s, are
    constant. Raises ValueError for a motion that does not settle, and as `Fleet` does.

    >>> round(steady_turn("otter", [70, 50], step_s=0.02).radius_m, 2)
    8.25
    """
    motion = _settle(model, command, overrides, step_s)
    yaw_rate = float(motion[2])
    speed = float(motion[1])
    return SteadyTurn(speed, yaw_rate, speed / abs(yaw_rate) if abs(yaw_rate) > NO_TURN else inf)


def steady_speed(
    model: str,
    command: ArrayLike,
    *,
    overrides: Mapping[str, float] | None = None,
    step_s: float = 0.05,
) -> float:
    """Return the speed (m/s, in any direction) that a vehicle reaches with one command held.

    Raises as `steady_turn` does.

    >>> round(steady_speed("remus100", [0, 0, 1000]), 3)
    1.674
    """
    return float(_settle(model, command, overrides, step_s)[0])


def _settle(
    model: str, command: ArrayLike, overrides: Mapping[str, float] | None, step_s: float
) -> Floats:
    """Return the settled speed, horizontal speed (m/s) and yaw rate (rad/s) under one command."""
    rest = np.zeros((1, len(find(model).states)))
    fleet = Fleet(model, rest, commands=np.atleast_2d(command), overrides=overrides, step_s=step_s)
    before = np.full(3, np.nan)
    for window in range(round(PATIENCE_S / WINDOW_S)):
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # a drag that drives never settles
                motion = _window(fleet, window * WINDOW_S)
        except DivergenceError as lost:
            raise ValueError(
                f"{model}: the motion under command {np.asarray(command).tolist()} grows without "
                f"end, at {lost.time_s:g} s already; give coefficients that a vehicle can have"
            ) from None
        if np.all(np.abs(motion - before) <= SETTLED * np.abs(motion).max() + NO_TURN):
            return motion
        before = motion
    raise ValueError(
        f"{model}: the motion under command {np.asarray(command).tolist()} has not settled after "
        f"{PATIENCE_S:.0f} s: it swings or creeps; hold another command or close a loop"
    )


def _window(fleet: Fleet, begin: float) -> Floats:
    """Return mean speed and mean horizontal speed (m/s) and mean yaw rate (rad/s) over WINDOW_S."""
    model, samples = fleet.model, 21
    rows = np.array([fleet.at(t)[0] for t in np.linspace(begin, begin + WINDOW_S, samples)])
    speed = np.linalg.norm(rows[:, model.velocity], axis=1).mean()
    # the arc through equally spaced points of a circle is longer than its chords by x / sin(x)
    chords = np.linalg.norm(np.diff(rows[:, :2], axis=0), axis=1)
    turned = np.diff(rows[:, model.heading])
    path = (chords / np.sinc(turned / (2.0 * np.pi))).sum()
    return np.array([speed, path / WINDOW_S, turned.sum() / WINDOW_S])
