"""What a vehicle can be asked for: how fast it goes at most, how tightly it turns."""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from ...core.arrays import Floats
from ..hulls import MODELS, parameters, steady_speed
from .autopilots import AUTOPILOTS, PathFollower, VehicleParameters, follower


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
    command = AUTOPILOTS[model].full_ahead(_body(model, overrides))
    step = AUTOPILOTS[model].settling_step_s
    return steady_speed(model, command, overrides=dict(overrides), step_s=step)


def _body(model: str, overrides: tuple[tuple[str, float], ...]) -> VehicleParameters:
    own = parameters(model, dict(overrides))
    return VehicleParameters(model, own, dict(overrides), MODELS[model].pack(own))


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
            f"{model}: a speed of {speed} m/s is not between 0 and the {fastest:.3f} m/s that it "
            "reaches"
        )
    return _smallest_turn(model, float(speed), _frozen(overrides))


@cache
def _smallest_turn(model: str, speed: float, overrides: tuple[tuple[str, float], ...]) -> float:
    return follower(model).smallest_turn(_body(model, overrides), speed)


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
    fastest, autopilot = top_speed(model, overrides), AUTOPILOTS[model]
    follows = isinstance(autopilot, PathFollower)
    cannot_stop = isinstance(autopilot, PathFollower) and autopilot.cannot_stop
    mean = float(np.hypot(*currents.mean(axis=0)))
    for vehicle, asked in zip(names, speed.tolist(), strict=True):
        if follows and not 0.0 < asked <= fastest:
            raise GuidanceError(
                vehicle,
                0.0,
                f"asked for {asked:g} m/s, but a {model} reaches {fastest:.3f} m/s; ask for a "
                "speed above zero and not above that",
            )
        own = asked if cannot_stop else fastest
        if mean >= own:
            raise GuidanceError(
                vehicle,
                0.0,
                f"the current of {mean:.3f} m/s is stronger than the {own:.3f} m/s that it makes "
                "through the water, and would carry it away",
            )
