"""What a vehicle settles into when nothing is changed any more: its speed, its turning circle."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from .fleet import Fleet
from .frames import Floats
from .models import find

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
