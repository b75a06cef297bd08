"""Where vehicles believe to be: their dead reckoning is wrong, and they steer by it."""

from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from .. import logs
from ..compiled import inlined
from ..dynamics.frames import Floats


@dataclass(frozen=True)
class SteeringDrift:
    """How wrong the dead reckoning is by which vehicles steer.

    `bias` (2,) or (n, 2) m/s of velocity, ahead and to starboard if `in_body`, else along x and y;
    `walk` (n, samples, 2) m along x and y at the instants k / `rate` (Hz), straight in between.
    """

    bias: Floats
    in_body: bool
    walk: Floats
    rate: float


def for_fleet(
    model: str, drift: SteeringDrift | None, count: int, duration: float
) -> SteeringDrift:
    """Return the drift with a row for each of `count` vehicles; none at all for None.

    Raises ValueError for a walk that is not given for each vehicle up to the end (`duration`, s).
    """
    if drift is None:
        return SteeringDrift(np.zeros((count, 2)), False, np.zeros((count, 2, 2)), 1.0)
    walk = np.array(drift.walk, dtype=np.float64, order="C")
    samples = max(2, 1 + ceil(duration * drift.rate * (1.0 - 1e-12)))
    if walk.ndim != 3 or walk.shape[0] != count or walk.shape[1] < samples or walk.shape[2] != 2:
        raise ValueError(
            f"{model}: drift.walk has shape {walk.shape}, not ({count}, {samples} or more, 2): "
            f"{count} vehicles for {duration:g} s at {drift.rate:g} Hz"
        )
    bias = np.array(np.broadcast_to(drift.bias, (count, 2)), dtype=np.float64, order="C")
    if not (np.isfinite(walk).all() and np.isfinite(bias).all()):
        raise ValueError(f"{model}: drift.bias and drift.walk must be finite numbers")
    return SteeringDrift(bias, bool(drift.in_body), walk, float(drift.rate))


@inlined
def error(
    time: float, line: Floats, bias: Floats, in_body: bool, walk: Floats, rate: float
) -> tuple[float, float]:
    """Return how far (m) along x and y a vehicle believes to be from where it is.

    `line` of its log holds the integrals of its heading; `bias` (2,) m/s; `walk` (samples, 2) m.
    """
    if in_body:
        ahead, aside = line[logs.COS], line[logs.SIN]
        north, east = ahead * bias[0] - aside * bias[1], aside * bias[0] + ahead * bias[1]
    else:
        north, east = time * bias[0], time * bias[1]
    whole = min(floor(time * rate), walk.shape[0] - 2)
    share = time * rate - whole
    here, there = walk[whole], walk[whole + 1]
    north += here[0] + share * (there[0] - here[0])
    east += here[1] + share * (there[1] - here[1])
    return north, east
