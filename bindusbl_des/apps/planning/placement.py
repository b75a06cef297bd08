"""Best positions of a few ASVs for a scenario's AUVs: in a regular formation, or freely chosen.

Nothing is simulated: positions are judged by the share of planned paths in range, by the Fisher
information of ranges and bearings there, or by the predicted error.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from ...core.geometry.covering import k_centre, max_cover
from ...core.geometry.formation import formation
from ...core.geometry.placement import descended, information, trace_of_inverse
from ...core.setup import Setup
from ...support.arrays import Floats
from .prediction.gathering import inputs_of
from .prediction.inputs import Inputs
from .prediction.predicting import predict
from .prediction.sights import ExpectedSights, located, looked_up, seen

# The names of functions that judge a placement of ASVs; the smallest value is best.
Objective: TypeAlias = Literal["coverage", "information", "error"]
#: A function that judges positions (m, 2; m).
Value: TypeAlias = Callable[[Floats], float]

# Weights of all AUVs, and of their distances in reaches, beside the worst AUV's weight of 1.
OF_ALL, OF_WAY = 0.1, 1e-3
# The reach of a channel without a limit is the distance where it decodes this share of signals.
REACHED = 0.5
# A position (m) out of range of all AUVs.
NOWHERE = ((1e7, 1e7),)
# The smallest prior variance (m2), of AUVs just after their launch.
SUREST_M2 = 1e-6


def objective_of(name: Objective, inputs: Inputs) -> Value:
    """Return the function of positions that an objective names.

    Raises:
        ValueError: when there is no such objective.
    """
    known = {"coverage": _unserved, "information": _unknown, "error": _predicted}
    if name not in known:
        raise ValueError(f"there is no objective {name!r}; use one of {', '.join(known)}")
    return known[name](inputs)


def reach_of(inputs: Inputs) -> float:
    """Return the horizontal distance (m) at which ASVs hear the deepest AUV.

    For a channel without a range it is where half of the pings are decoded.
    """
    hf, deepest = inputs.hf, float(inputs.ways.depths_m.max())
    slant = hf.range_m
    if not hf.is_cut:
        heard = np.flatnonzero(hf.chances >= REACHED)
        slant = hf.step_m * float(heard[-1]) if len(heard) else 0.0
    if hf.is_cut and not hf.by_slant:
        return slant
    return float(np.sqrt(max(slant**2 - deepest**2, 0.0)))


def _unserved(inputs: Inputs) -> Value:
    """Judge by the share of paths on which AUVs get no fix."""
    reach = max(reach_of(inputs), 1.0)

    def value(places: Floats) -> float:
        sights = seen(inputs, places)
        served = located(inputs, sights).mean(axis=2) * _delivered(inputs, sights)
        own, nearest = served.mean(axis=1), sights.level_m.min(axis=2).mean()
        return float(1.0 - own.min() + OF_ALL * (1.0 - own.mean()) + OF_WAY * nearest / reach)

    return value


def _unknown(inputs: Inputs) -> Value:
    """Judge by the mean variance (m2) after one fix on top of dead reckoning."""
    alone = predict(inputs, NOWHERE).error_over_time
    prior = 2.0 / np.maximum(alone**2, 2.0 * SUREST_M2)  # of each axis

    def value(places: Floats) -> float:
        sights, noise = seen(inputs, places), inputs.noise
        heard = sights.heard * _delivered(inputs, sights)[..., None]
        with np.errstate(divide="ignore"):
            along, across = (
                looked_up(table, noise.step_m, sights.level_m) / heard
                for table in (noise.along_m2, noise.across_m2)
            )
        gained = information(inputs.ways.places_m, places, along, across)
        return float(trace_of_inverse(gained + prior[..., None, None] * np.eye(2)).mean())

    return value


def _predicted(inputs: Inputs) -> Value:
    """Judge by the predicted error of the worst AUV."""
    return lambda places: predict(inputs, places).worst("position_error_p95_m")


def _delivered(inputs: Inputs, sights: ExpectedSights) -> Floats:
    """Return the probability (n, k) that an AUV decodes the frame with its fix."""
    access, delivered = inputs.access, sights.delivered
    replies = access.downlink.replies
    if access.ranging.asvs_ping or (replies and not access.replies_in_frames):
        return np.ones(delivered.shape[:2])
    if access.broadcaster.chosen_by == "one" and not replies:
        return np.asarray(delivered[:, :, access.fixed_asv])
    if replies or access.broadcaster.serves_nearest:
        nearest = sights.level_m.argmin(axis=2)[:, :, None]
        return np.asarray(np.take_along_axis(delivered, nearest, axis=2)[:, :, 0])
    return np.asarray(delivered.mean(axis=2))


# The first grid of formations: radii up to the widest, angles within the formation's symmetry.
RADII, ANGLES = 12, 8
# How many of them are improved, to which share of the widest radius, in at most how many steps.
IMPROVED, FINELY, MOST_ASKED = 3, 1e-7, 400
# Free positions improve by steps from this share of the reach down to this length (m), in at most
# so many trials for each coordinate.
STEP, FINELY_M, TRIALS = 0.25, 0.05, 40
# Rings are improved to this share of the widest.
FINE_RING = 1e-3


def best_ring(
    setup: Setup,
    count: int,
    objective: Objective | Value = "coverage",
    inputs: Inputs | None = None,
) -> tuple[float, float]:
    """Return radius (m) and angle (deg) of the best regular formation of `count` ASVs.

    Its centre is the survey's, its radius at most the distance to the farthest corner.  Arguments
    and errors are those of :func:`free_places`.
    """
    value = _value(setup, objective, inputs)
    area = setup.area
    widest = max(math.dist(area.centroid, corner) for corner in area.outline)
    ring = least_ring(count, value, widest, area.centroid, finely=FINE_RING)
    return round(ring.radius, 1), round(math.degrees(ring.angle), 1)


class Ring(NamedTuple):
    """A regular formation: its radius (m), the angle (rad) of its first vessel, and its value."""

    radius: float
    angle: float
    value: float


def least_ring(
    count: int,
    value: Callable[[Floats], float],
    widest: float,
    middle: tuple[float, float] = (0.0, 0.0),
    *,
    finely: float = FINELY,
) -> Ring:
    """Return the regular formation of `count` vessels whose `value` is smallest.

    `value` takes positions (count, 2; m).  A grid of radii up to the `widest` (m) and of angles
    within the formation's symmetry is tried, and the best are improved
    (:func:`...core.geometry.placement.descended`) to the share `finely` of the widest radius.
    Raises ValueError as :func:`...core.geometry.formation.formation` does.
    """
    if count <= 1:
        return Ring(0.0, 0.0, value(formation(count, 0.0) + middle))
    turn = 2.0 * math.pi / count

    def at(place: Floats) -> float:
        radius, angle = float(place[0]) * widest, float(place[1]) * turn
        if not 0.0 <= radius <= widest:
            return math.inf
        return value(formation(count, radius, angle) + middle)

    grid = [np.array((r, a)) for r in _steps(RADII, closed=True) for a in _steps(ANGLES)]
    ranked = sorted(((at(place), n) for n, place in enumerate(grid)), key=lambda pair: pair)
    tried = [descended(at, grid[n], 0.5 / RADII, finely, MOST_ASKED) for _, n in ranked[:IMPROVED]]
    place, least = min(tried, key=lambda pair: pair[1])
    return Ring(float(place[0]) * widest, float(place[1] % 1.0) * turn, least)


def _steps(count: int, *, closed: bool = False) -> Floats:
    """Return `count` even steps from 0 to 1, or from 0 through 1 if `closed`."""
    return np.linspace(0.0, 1.0, count + closed, endpoint=closed)


def free_places(
    setup: Setup,
    count: int,
    objective: Objective | Value = "coverage",
    inputs: Inputs | None = None,
) -> Floats:
    """Return the positions (count, 2; m) from which `count` ASVs serve the AUVs best.

    The objective is a function of positions (count, 2), whose smallest value is best, or one of:

    * `coverage`: the share of its path on which an AUV is served, of the worst AUV and of all;
    * `information`: the mean over all paths of tr (P^-1 + J)^-1, P the covariance of dead reckoning
      alone until then, J the Fisher information of range and bearing, weighted with the probability
      that each ASV hears the AUV;
    * `error`: the predicted error of the worst AUV, `position_error_p95_m`.

    The search begins with the best of three placements: the best ring, k centres, and, if those are
    out of reach, most path points covered; it descends to a local minimum.  `inputs` are those of
    the scenario's prediction, if known already.  Equal scenarios get equal positions.

    Raises:
        ValueError: for less than one ASV, an unknown objective, and as
            :func:`.prediction.gathering.inputs_of` does.
    """
    inputs = inputs or inputs_of(setup)
    value = _value(setup, objective, inputs)
    starts = _starts(setup, count, value, inputs)
    if (closed := setup.closed) is not None:  # move positions ashore to the nearest water
        starts = [np.array([closed.afloat((x, y)) for x, y in start.tolist()]) for start in starts]
    start = min(starts, key=value)
    step = STEP * max(reach_of(inputs), FINELY_M)

    def flat(numbers: Floats) -> float:
        return value(numbers.reshape(-1, 2))

    places, _ = descended(flat, start.ravel(), step, FINELY_M, TRIALS * start.size)
    return np.round(places.reshape(-1, 2), 1) + 0.0


def _value(setup: Setup, objective: Objective | Value, inputs: Inputs | None) -> Value:
    value = objective
    if not callable(value):
        value = objective_of(value, inputs or inputs_of(setup))
    if setup.closed is None:
        return value
    asked, closed = value, setup.closed
    return lambda places: math.inf if closed.holds(places).any() else asked(places)


def _starts(setup: Setup, count: int, value: Value, inputs: Inputs) -> list[Floats]:
    """Return placements (count, 2; m) from which to search."""
    radius, angle = best_ring(setup, count, value, inputs)
    ring = formation(count, radius, math.radians(angle)) + setup.area.centroid
    ways, reach = inputs.ways.places_m.reshape(-1, 2), reach_of(inputs)
    covering = k_centre(ways, count)
    if covering.radius <= reach or reach == 0.0:
        return [ring, covering.places]
    return [ring, covering.places, max_cover(ways, count, reach).places]
