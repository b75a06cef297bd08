"""Vehicles of one model in one sea, moved only as far as somebody looks; and what one settles into
when nothing is changed any more: its speed, its turning circle.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, degrees, inf, isfinite

import numpy as np
from numpy.typing import ArrayLike

from ...core.arrays import Floats
from . import rk4
from .models import Model, find, parameters


class DivergenceError(FloatingPointError):
    """A vehicle left what its equations can describe: a state without bounds, or standing on end.

    `model`, `vehicle` (row in the fleet) and `time_s` (end of the step in which it happened) say
    who and when.
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


class Fleet:
    """Vehicles of one model, each with its own command, on one grid of integration steps.

    `at(t)` answers where they are, `command` tells one of them something new. Steps begin at
    `start_s + k * step_s` and at the instants of commands, so the answers do not depend, to the
    last bit, on which other instants were asked for.

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
        self.model = find(model)
        self._p = self.model.pack(parameters(model, overrides))
        self._states = _rows(self.model, "states", states, self.model.states)
        _refuse_steep(self.model, self._states)
        count = len(self._states)
        idle = np.zeros((count, len(self.model.commands)))
        self._commands = _rows(
            self.model,
            "commands",
            idle if commands is None else commands,
            self.model.commands,
            count,
        )
        self._current = _current(self.model, current_m_per_s)
        self._step, self._start = _step_length(self.model, step_s), float(start_s)
        self._clocks = np.full(count, self._start)

    def at(self, time_s: float) -> Floats:
        """Return the states (vehicles, state) at `time_s`, a copy.

        Raises ValueError for a time before the last step boundary already passed, DivergenceError
        for a vehicle lost on the way.
        """
        time_s = self._advance(time_s)
        states, clocks = self._states.copy(), self._clocks.copy()
        self._leap(states, self._commands, clocks, time_s)
        return states

    def command(self, time_s: float, vehicle: int, values: ArrayLike) -> None:
        """From `time_s` on, one vehicle holds `values` (command,); its step is split exactly there.

        Raises as `at` does, and ValueError for values that do not fit the model.
        """
        if not 0 <= vehicle < len(self._states):
            raise ValueError(
                f"{self.model.name}: no vehicle {vehicle} among {len(self._states)}; count from 0"
            )
        rows = _rows(self.model, "values", np.atleast_2d(values), self.model.commands, 1)
        self._hold(time_s, slice(vehicle, vehicle + 1), rows)

    def command_all(self, time_s: float, values: ArrayLike) -> None:
        """From `time_s` on, each vehicle holds its row of `values` (vehicles, command).

        Raises as `command` does.
        """
        rows = _rows(self.model, "values", values, self.model.commands, len(self._states))
        self._hold(time_s, slice(0, len(rows)), rows)

    def _hold(self, time_s: float, due: slice, rows: Floats) -> None:
        """Bring these vehicles to exactly `time_s` and give them their new commands."""
        time_s = self._advance(time_s)
        self._leap(self._states[due], self._commands[due], self._clocks[due], time_s, due.start)
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

    def _leap(
        self, states: Floats, commands: Floats, clocks: Floats, time_s: float, first: int = 0
    ) -> None:
        """Move these rows, of which `first` is the first vehicle, to exactly `time_s`."""
        self._move(states, commands, clocks, time_s, first, exactly=True)

    def _move(
        self, states: Floats, commands: Floats, clocks: Floats, time_s: float, first: int = 0,
        *, exactly: bool = False,
    ) -> None:  # fmt: skip
        lost = rk4.advance(
            self.model.equations, self._p, states, commands, *self._current, clocks, self._start,
            self._step, time_s, exactly,
        )  # fmt: skip
        if lost >= 0:
            raise DivergenceError(self.model.name, first + lost, clocks[lost], states[lost])


def _rows(
    model: Model, what: str, values: ArrayLike, columns: tuple[str, ...], count: int | None = None
) -> Floats:
    """Return a fresh (rows, columns) array of finite numbers, or say which shape is wanted."""
    rows = np.array(values, dtype=np.float64, order="C")
    fits = rows.ndim == 2 and rows.shape[1] == len(columns) and count in (None, len(rows))
    if not fits:
        wanted = f"({'n' if count is None else count}, {len(columns)})"
        raise ValueError(
            f"{model.name}: {what} has shape {rows.shape}, not {wanted}; "
            f"a row is [{', '.join(columns)}]"
        )
    if not np.isfinite(rows).all():
        row, column = np.argwhere(~np.isfinite(rows))[0]
        raise ValueError(
            f"{model.name}: {what} row {row}, {columns[column]}, is {rows[row, column]}; "
            "every number must be finite"
        )
    return rows


def _refuse_steep(model: Model, states: Floats) -> None:
    """Raise ValueError for a vehicle that starts standing on end."""
    if "theta" not in model.states:
        return
    for vehicle, pitch in enumerate(states[:, model.states.index("theta")]):
        if cos(pitch) < rk4.COS_STEEPEST:
            raise ValueError(
                f"{model.name}: vehicle {vehicle} starts at pitch {degrees(pitch):.1f} deg; Euler "
                f"angles need it within +-{degrees(rk4.STEEPEST):.0f} deg"
            )


def _current(model: Model, current: Sequence[float] | Floats) -> tuple[float, float]:
    """Return the current's North and East components (m/s)."""
    values = np.asarray(current, dtype=np.float64)
    if values.shape != (2,) or not np.isfinite(values).all():
        raise ValueError(
            f"{model.name}: current_m_per_s must be two finite numbers, North and East, "
            f"not {current!r}"
        )
    return float(values[0]), float(values[1])


def _step_length(model: Model, step: float) -> float:
    """Return the step (s), or say that there is none."""
    if not (isfinite(step) and step > 0):
        raise ValueError(f"{model.name}: step_s must be a finite number above zero, not {step!r}")
    return float(step)


WINDOW_S = 5.0  # motion is averaged over this long
SETTLED = 1e-6  # averages of two windows that agree to this part are one
PATIENCE_S = 4000.0  # the slowest motion here, yaw of a REMUS at 0.3 m/s, dies within minutes
NO_TURN = 1e-9  # rad/s: a vehicle that yaws less goes straight


@dataclass(frozen=True)
class SteadyTurn:
    """The circle in which a vehicle ends: horizontal speed (m/s), yaw rate (rad/s, positive to
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

    Solved by moving the vehicle from rest until speed and yaw rate, averaged over 5 s, change no
    more. Raises ValueError for a motion that does not settle, and as `Fleet` does.

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
    """Return the speed (m/s, in whatever direction) that a vehicle reaches with one command held.

    Raises as `steady_turn` does.

    >>> round(steady_speed("remus100", [0, 0, 1000]), 3)
    1.674
    """
    return float(_settle(model, command, overrides, step_s)[0])


def _settle(
    model: str, command: ArrayLike, overrides: Mapping[str, float] | None, step_s: float
) -> Floats:
    """Return speed, horizontal speed (m/s) and yaw rate (rad/s) of the motion that lasts."""
    rest = np.zeros((1, len(find(model).states)))
    fleet = Fleet(model, rest, commands=np.atleast_2d(command), overrides=overrides, step_s=step_s)
    before = np.full(3, np.nan)
    for window in range(round(PATIENCE_S / WINDOW_S)):
        with np.errstate(over="ignore", invalid="ignore"):  # a drag that drives never settles
            motion = _window(fleet, window * WINDOW_S)
        if np.all(np.abs(motion - before) <= SETTLED * np.abs(motion).max() + NO_TURN):
            return motion
        before = motion
    raise ValueError(
        f"{model}: the motion under command {np.asarray(command).tolist()} has not settled after "
        f"{PATIENCE_S:.0f} s: it swings or creeps; hold another command or close a loop"
    )


def _window(fleet: Fleet, begin: float) -> Floats:
    """Return mean speed, mean horizontal speed and mean yaw rate over one window."""
    model, samples = fleet.model, 21
    rows = np.array([fleet.at(t)[0] for t in np.linspace(begin, begin + WINDOW_S, samples)])
    speed = np.linalg.norm(rows[:, model.velocity], axis=1).mean()
    # the arc through equally spaced points of a circle is longer than its chords by x / sin(x)
    chords = np.linalg.norm(np.diff(rows[:, :2], axis=0), axis=1)
    turned = np.diff(rows[:, model.heading])
    path = (chords / np.sinc(turned / (2.0 * np.pi))).sum()
    return np.array([speed, path / WINDOW_S, turned.sum() / WINDOW_S])
