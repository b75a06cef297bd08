"""How vehicles move through the sea: a torpedo, a hovering vehicle and two surface vehicles.

`trajectory` follows one of them under given commands, `Fleet` moves several of one model lazily,
`steady_turn` and `steady_speed` tell what a command leads to. SI units and radians; North, East,
Down; velocities over ground in body axes; yaw clockwise from North.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ...core.arrays import Floats
from .fleet import DivergenceError, Fleet, SteadyTurn, steady_speed, steady_turn
from .models import MODELS, Model, find, parameters

__all__ = [
    "MODELS",
    "DivergenceError",
    "Fleet",
    "Model",
    "SteadyTurn",
    "parameters",
    "steady_speed",
    "steady_turn",
    "trajectory",
]


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
    exactly where the command changes, and only there: which times are asked for changes no bit of
    the rows. The Otter's propeller lag wants `step_s=0.02` for 1 mm where it reverses.

    Raises ValueError for an unknown model and for arguments that do not fit it, DivergenceError
    for a state that becomes infinite or stands on end.

    >>> trajectory("cybership2", [0, 10], [[1.5, 0, 0]] * 2)[-1, :3].round(3).tolist()
    [2.426, 0.0, 0.0]
    """
    kind = find(model)
    instants = _instants(model, times)
    rows = np.asarray(commands, dtype=np.float64)
    wanted = (len(instants), len(kind.commands))
    if rows.shape != wanted:
        raise ValueError(
            f"{model}: commands has shape {rows.shape}, not {wanted}: "
            f"a row [{', '.join(kind.commands)}] for each of times"
        )
    if not np.isfinite(rows).all():
        raise ValueError(
            f"{model}: commands row {np.argwhere(~np.isfinite(rows))[0][0]} is not finite"
        )
    fleet = Fleet(
        model, [_initial(kind, initial)], commands=rows[:1], current_m_per_s=current_m_per_s,
        overrides=overrides, step_s=step_s, start_s=instants[0],
    )  # fmt: skip
    states = np.empty((len(instants), len(kind.states)))
    for k, instant in enumerate(instants):
        states[k] = fleet.at(instant)[0]
        if k and np.any(rows[k] != rows[k - 1]):
            fleet.command(instant, 0, rows[k])
    return states


def _instants(model: str, times: ArrayLike) -> Floats:
    """Return the times as an increasing array, or say what is wrong with them."""
    instants = np.asarray(times, dtype=np.float64)
    if instants.ndim != 1 or len(instants) == 0:
        raise ValueError(f"{model}: times has shape {instants.shape}, not (n,) with n at least 1")
    if not np.isfinite(instants).all():
        raise ValueError(f"{model}: times[{np.argmax(~np.isfinite(instants))}] is not finite")
    late = np.flatnonzero(np.diff(instants) <= 0)
    if len(late):
        k = int(late[0]) + 1
        raise ValueError(
            f"{model}: times[{k}] = {instants[k]} does not follow times[{k - 1}] = "
            f"{instants[k - 1]}; times must increase"
        )
    return instants


def _initial(kind: Model, initial: ArrayLike | None) -> Floats:
    """Return the state at the start; at rest at the origin unless given."""
    if initial is None:
        return np.zeros(len(kind.states))
    state = np.asarray(initial, dtype=np.float64)
    if state.shape != (len(kind.states),):
        raise ValueError(
            f"{kind.name}: initial has shape {state.shape}, not ({len(kind.states)},): "
            f"[{', '.join(kind.states)}]"
        )
    return state
