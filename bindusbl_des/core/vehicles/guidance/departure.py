"""What guided vehicles are ordered to do, and their limits: top speed, tightest turn, and the
current that would carry them away.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from math import floor
from typing import Any

from numpy.typing import ArrayLike

from ....support.arrays import Floats
from ...geometry.paths import Path
from ..bottom import UNKNOWN, Bottom, Keeping
from ..currents import CONTROL_S
from ..hulls.fleet import find, parameters, steady_speed, steady_turn
from ..hulls.rk4 import MODELS

TURN_MARGIN = 1.3  # over the REMUS's tightest circle: curvature steps, its rudder and yaw do not
WHOLE = 1e-9  # rounding within which a speed in mm/s, or a control interval in steps, is whole

# Models that follow paths; the others keep station.
FOLLOWING = [name for name, model in MODELS.items() if model.follows]


class GuidanceError(RuntimeError):
    """A vehicle cannot carry out its orders: `vehicle` (its name), `time_s` and `reason`."""

    def __init__(self, vehicle: str, time_s: float, reason: str) -> None:
        super().__init__(vehicle, time_s, reason)  # all three: SimPy and pickle copy by these
        self.vehicle, self.time_s, self.reason = vehicle, time_s, reason

    def __str__(self) -> str:
        return f"{self.vehicle} at {self.time_s:.6g} s: {self.reason}"


@dataclass(frozen=True)
class DeparturePlan:
    """Paths or stations of the vehicles of a fleet, and their names.

    AUVs follow `paths` at a speed and a depth, either one number for all or one for each; ASVs keep
    `stations` (n, 2), m.  AUVs may be `keeping` an altitude above the `bottom` instead of a depth.
    """

    paths: Sequence[Path] | None = None
    stations: ArrayLike | None = None
    speed_m_per_s: ArrayLike = 0.0
    depth_m: ArrayLike = 0.0
    names: Sequence[str] | None = None
    keeping: Keeping | None = None
    bottom: Bottom = UNKNOWN


@dataclass(frozen=True)
class SteeringIntervals:
    """The control interval (s) of a fleet, and the step (s) of its integration, which divides it.

    By default a step is 0.05 s, for an Otter 0.02 s, for a REMUS 0.1 s.
    """

    control_s: float = CONTROL_S
    step_s: float | None = None


def refuse_impossible(
    model: str,
    overrides: Mapping[str, float] | None,
    names: Sequence[str],
    speed: Floats,
    currents: Floats,
) -> None:
    """Raise GuidanceError for a speed above a vehicle's own, or a current that carries it away.

    `speed` (n,) m/s is not read for vehicles that keep station; of the current its mean (n,), m/s,
    counts, since a vehicle makes good what a gust has cost it.
    """
    fastest = top_speed(model, overrides)
    for vehicle, asked in zip(names, speed.tolist(), strict=True):
        if MODELS[model].follows and not 0.0 < asked <= fastest:
            raise GuidanceError(
                vehicle,
                0.0,
                f"asked for {asked:g} m/s, but a {model} reaches {_reached(fastest)} m/s; ask for "
                "a speed above zero and not above that",
            )
    if (found := too_strong(model, overrides, speed.tolist(), currents.tolist())) is not None:
        raise GuidanceError(names[found[0]], 0.0, found[1])


def too_strong(
    model: str,
    overrides: Mapping[str, float] | None,
    speeds: Sequence[float],
    currents: Sequence[float],
) -> tuple[int, str] | None:
    """Return the first vehicle that its current (m/s) would carry away, by number, and why; or
    None.

    A hull that cannot stop must be faster than the current at its ordered speed, of `speeds` (m/s);
    any other at full command.
    """
    fastest = top_speed(model, overrides)
    for number, (asked, current) in enumerate(zip(speeds, currents, strict=True)):
        own = asked if MODELS[model].cannot_stop else fastest
        if current >= own:
            return number, (
                f"the current of {current:.3f} m/s is stronger than the {own:.3f} m/s that it "
                "makes through the water, and would carry it away"
            )
    return None


def top_speed(model: str, overrides: Mapping[str, float] | None = None) -> float:
    """Return the speed through still water (m/s) that full command gives, straight ahead.

    Raises ValueError for an unknown model or parameter.

    >>> round(top_speed("bluerov2"), 2), round(top_speed("cybership2"), 2)
    (0.73, 0.58)
    """
    return _top_speed(model, parameters(model, overrides))


@cache
def _top_speed(model: str, body: Any) -> float:
    kind = MODELS[model]
    command = kind.full_ahead(kind.coefficients(body))
    return steady_speed(model, command, overrides=asdict(body), step_s=kind.settling_step_s)


def smallest_turn(model: str, speed: float, overrides: Mapping[str, float] | None = None) -> float:
    """Return the smallest radius (m) of turns in a vehicle's path at a speed (m/s).

    REMUS: 1.3 times the circle in which it settles with full rudder. BlueROV2: what the thrust
    shares of its axes and its yaw loop allow. Raises ValueError for a model that follows no path
    and a speed that it does not reach.

    >>> round(smallest_turn("bluerov2", 0.6), 2), round(smallest_turn("remus100", 1.5), 1)
    (1.01, 27.2)
    """
    if not find(model).follows:
        raise ValueError(
            f"{model} keeps a station and plans no turns; models that follow paths: "
            f"{', '.join(FOLLOWING)}"
        )
    fastest = top_speed(model, overrides)
    if not 0.0 < speed <= fastest:
        raise ValueError(
            f"{model}: a speed of {speed} m/s is not between 0 and the {_reached(fastest)} m/s "
            "that it reaches; ask for less"
        )
    return _smallest_turn(model, float(speed), parameters(model, overrides))


def _reached(speed: float) -> str:
    """Return a top speed (m/s) in words, rounded down so that a vehicle reaches it.

    >>> _reached(0.73379), _reached(2.554)
    ('0.733', '2.554')
    """
    return f"{floor(1e3 * speed + WHOLE) / 1e3:.3f}"


@cache
def _smallest_turn(model: str, speed: float, body: Any) -> float:
    kind = MODELS[model]
    hull = kind.coefficients(body)
    if kind.smallest_turn is not None:
        return kind.smallest_turn(hull, speed)
    assert kind.hard_over is not None
    command = kind.hard_over(hull, speed)
    return TURN_MARGIN * steady_turn(model, command, overrides=asdict(body)).radius_m
