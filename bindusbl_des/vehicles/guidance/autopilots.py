"""What steers each hull: a record for each, so that nothing else asks a hull for its name.

Compiled :mod:`.flight` alone chooses by number, since numba knows no table of functions.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...core.arrays import Floats
from ...records.rows import Row
from ..hulls import bluerov2 as rov
from ..hulls import steady_turn
from . import bluerov2, cybership2, otter, remus100

TURN_MARGIN = 1.3  # over the REMUS's tightest circle: curvature steps, its rudder and yaw do not


class VehicleParameters(NamedTuple):
    """A vehicle of a `model`: its parameters, those changed by somebody, and all as equations read
    them (`hull`).
    """

    model: str
    parameters: Any
    overrides: Mapping[str, float]
    hull: Floats


class InitialState(NamedTuple):
    """What a vehicle begins with: a `speed` asked for (m/s), the `current` (2,), m/s, and the share
    of it that its log misses.
    """

    speed: float
    current: Floats
    missed: float


@dataclass(frozen=True)
class Autopilot:
    """How a hull is steered.

    It is integrated in steps of `step_s` (s), as it settles in those of `settling_step_s`;
    `full_ahead` gives the command that drives it straight ahead with all it has.
    """

    step_s: float
    settling_step_s: float
    full_ahead: Callable[[VehicleParameters], list[float]]


@dataclass(frozen=True)
class PathFollower(Autopilot):
    """How an AUV is flown along a path.

    `smallest_turn` gives the radius (m) of turns at a speed (m/s); `begin` writes what it remembers
    and its state.  One that `cannot_stop` makes its speed through the water, and circles at the end
    of its path.
    """

    smallest_turn: Callable[[VehicleParameters, float], float]
    begin: Callable[[VehicleParameters, InitialState, Row, Floats], None]
    cannot_stop: bool


@dataclass(frozen=True)
class StationKeeper(Autopilot):
    """How an ASV keeps within its watch circle (m); `begin` writes what all of them remember."""

    watch_circle_m: float
    begin: Callable[[VehicleParameters, Row], None]


def _tightest_circle(body: VehicleParameters, speed: float) -> float:
    """Return the circle (m) in which a REMUS settles with full rudder, and a margin."""
    revolutions = 60.0 * remus100.revolutions(speed, body.hull)
    command = np.array([body.parameters.fin_limit_rad, 0.0, revolutions])
    return TURN_MARGIN * steady_turn(body.model, command, overrides=dict(body.overrides)).radius_m


def _at_cruise(body: VehicleParameters, start: InitialState, own: Row, state: Floats) -> None:
    own["remus100"]["trim"] = remus100.revolutions(start.speed, body.hull)
    remus100.begin(start.speed, start.current, body.hull, state)


def _from_rest(body: VehicleParameters, start: InitialState, own: Row, state: Floats) -> None:
    own["bluerov2"]["most"] = body.parameters.thruster_limit_n
    bluerov2.begin(start.missed * start.current, body.hull, own["bluerov2"], state)


def _with_thrust(body: VehicleParameters, own: Row) -> None:
    helm = own["otter"]
    helm["most_ahead"], helm["most_astern"] = otter.greatest_thrust(body.hull)


REMUS100 = PathFollower(
    step_s=0.1,  # it takes its time
    settling_step_s=0.05,
    full_ahead=lambda body: [0.0, 0.0, body.parameters.propeller_limit_rpm],
    smallest_turn=_tightest_circle,
    begin=_at_cruise,
    cannot_stop=True,
)

AUTOPILOTS: Mapping[str, PathFollower | StationKeeper] = {
    "remus100": REMUS100,
    "remus100_pvs": REMUS100,
    "bluerov2": PathFollower(
        step_s=0.05,
        settling_step_s=0.05,
        full_ahead=lambda body: [
            *(body.parameters.thruster_limit_n / bluerov2.PER_PUSH, 0.0, -body.hull[rov.SINKING]),
            *(0.0, 0.0, 0.0),
        ],
        smallest_turn=lambda body, speed: bluerov2.smallest_turn(
            speed, body.hull, body.parameters.thruster_limit_n
        ),
        begin=_from_rest,
        cannot_stop=False,
    ),
    "otter": StationKeeper(
        step_s=0.02,  # its propellers reverse within a few hundredths of a second
        settling_step_s=0.02,
        full_ahead=lambda body: [body.parameters.propeller_limit_ahead_rad_per_s] * 2,
        watch_circle_m=otter.WATCH_CIRCLE,
        begin=_with_thrust,
    ),
    "cybership2": StationKeeper(
        step_s=0.05,
        settling_step_s=0.05,
        full_ahead=lambda _: [cybership2.SURGE_LIMIT, 0.0, 0.0],
        watch_circle_m=cybership2.WATCH_CIRCLE,
        begin=lambda *_: None,
    ),
}


# Models that follow paths; the others keep stations.
FOLLOWING = [name for name, autopilot in AUTOPILOTS.items() if isinstance(autopilot, PathFollower)]


def follower(model: str) -> PathFollower:
    """Return how an AUV follows paths; ValueError for a model that keeps stations."""
    found = AUTOPILOTS[model]
    if isinstance(found, PathFollower):
        return found
    raise ValueError(
        f"{model} keeps a station and plans no turns; models that follow paths: "
        f"{', '.join(FOLLOWING)}"
    )


def keeper(model: str) -> StationKeeper:
    """Return how an ASV keeps a station; ValueError for a model that follows paths."""
    found = AUTOPILOTS[model]
    if isinstance(found, StationKeeper):
        return found
    raise ValueError(f"{model} follows paths and keeps no station")
