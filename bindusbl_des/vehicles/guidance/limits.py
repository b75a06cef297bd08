"""What a vehicle can be asked for: how fast it goes at most, how tightly it turns."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..hulls import MODELS, parameters, steady_speed, steady_turn
from ..hulls import bluerov2 as rov
from ..hulls.frames import Floats
from . import bluerov2, cybership2, remus100

FOLLOWERS = ("remus100", "remus100_pvs", "bluerov2")  # fly along paths
KEEPERS = ("otter", "cybership2")  # keep stations
TURN_MARGIN = 1.3  # over the REMUS's tightest circle: curvature steps, its rudder and yaw do not


class GuidanceError(RuntimeError):
    """A vehicle cannot go where it is told to: `vehicle` (its name), `time_s` and `reason`."""

    def __init__(self, vehicle: str, time_s: float, reason: str) -> None:
        super().__init__(vehicle, time_s, reason)  # all of it: SimPy and pickle make it anew
        self.vehicle, self.time_s, self.reason = vehicle, time_s, reason

    def __str__(self) -> str:
        return f"{self.vehicle} at {self.time_s:.6g} s: {self.reason}"


def _frozen(overrides: Mapping[str, float] | None) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((overrides or {}).items()))


def top_speed(model: str, overrides: Mapping[str, float] | None = None) -> float:
    """Return the speed through still water (m/s) that full command gives, straight ahead.

    Raises ValueError for a model or a parameter that there is not.

    >>> round(top_speed("bluerov2"), 2), round(top_speed("cybership2"), 2)
    (0.73, 0.58)
    """
    return _top_speed(model, _frozen(overrides))


@cache
def _top_speed(model: str, overrides: tuple[tuple[str, float], ...]) -> float:
    body = parameters(model, dict(overrides))
    step = 0.02 if model == "otter" else 0.05
    return steady_speed(model, _full_ahead(model, body), overrides=dict(overrides), step_s=step)


def _full_ahead(model: str, body: Any) -> list[float]:
    """Return the command that drives a vehicle straight ahead with all it has."""
    if model == "bluerov2":
        sinking = MODELS[model].pack(body)[rov.SINKING]
        return [body.thruster_limit_n / bluerov2.PER_PUSH, 0.0, -sinking, 0.0, 0.0, 0.0]
    if model == "otter":
        return [body.propeller_limit_ahead_rad_per_s] * 2
    if model == "cybership2":
        return [cybership2.SURGE_LIMIT, 0.0, 0.0]
    return [0.0, 0.0, body.propeller_limit_rpm]


def smallest_turn(model: str, speed: float, overrides: Mapping[str, float] | None = None) -> float:
    """Return the radius (m) with which a vehicle's path may turn at a speed (m/s).

    REMUS: 1.3 times the circle in which it settles with full rudder. BlueROV2: what the shares of
    its thrusters and its yaw loop allow. Raises ValueError for a model that follows no path and a
    speed that it does not reach.

    >>> round(smallest_turn("bluerov2", 0.6), 2), round(smallest_turn("remus100", 1.5), 1)
    (1.01, 27.2)
    """
    if model not in FOLLOWERS:
        raise ValueError(
            f"{model} keeps a station and plans no turns; models that follow paths: "
            f"{', '.join(FOLLOWERS)}"
        )
    fastest = top_speed(model, overrides)
    if not 0.0 < speed <= fastest:
        raise ValueError(
            f"{model}: a speed of {speed} m/s is not between 0 and the {fastest:.3f} m/s that it "
            "reaches"
        )
    return _smallest_turn(model, float(speed), _frozen(overrides))


@cache
def _smallest_turn(model: str, speed: float, overrides: tuple[tuple[str, float], ...]) -> float:
    body = parameters(model, dict(overrides))
    p = MODELS[model].pack(body)
    if model == "bluerov2":
        return bluerov2.smallest_turn(speed, p, body.thruster_limit_n)
    command = np.array([body.fin_limit_rad, 0.0, 60.0 * remus100.revolutions(speed, p)])
    return TURN_MARGIN * steady_turn(model, command, overrides=dict(overrides)).radius_m


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
    fastest = top_speed(model, overrides)
    mean = float(np.hypot(*currents.mean(axis=0)))
    for vehicle, asked in zip(names, speed.tolist(), strict=True):
        if model in FOLLOWERS and not 0.0 < asked <= fastest:
            raise GuidanceError(
                vehicle,
                0.0,
                f"asked for {asked:g} m/s, but a {model} reaches {fastest:.3f} m/s; ask for a "
                "speed above zero and not above that",
            )
        own = asked if model.startswith("remus100") else fastest
        if mean >= own:
            raise GuidanceError(
                vehicle,
                0.0,
                f"the current of {mean:.3f} m/s is stronger than the {own:.3f} m/s that it makes "
                "through the water, and would carry it away",
            )
