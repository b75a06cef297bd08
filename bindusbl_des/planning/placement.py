"""Where few ASVs serve the AUVs of a scenario best: in a regular formation, or each by itself.

Nothing is simulated here: places are judged by who is heard along the ways that are planned, by
what ranges and bearings tell of AUVs there, or by the error that is predicted.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ..geometry import regular
from ..geometry.covering import k_centre, max_cover
from ..geometry.formation import formation
from ..geometry.placement import descended
from ..scenario.scenario import Scenario
from ..scenario.survey_area import area_of
from .objectives import Objective, Value, objective_of, reach_of
from .prediction.inputs import Inputs, inputs_of

Floats = NDArray[np.float64]

# A placement is improved by steps of this share of the reach at first, to this length (m) in the
# end, and in so many trials for each of its numbers at most.
STEP, FINELY_M, TRIALS = 0.25, 0.05, 40
# Rings are improved to this share of the widest.
FINE_RING = 1e-3


def best_ring(
    scenario: Scenario,
    count: int,
    objective: Objective | Value = "coverage",
    inputs: Inputs | None = None,
) -> tuple[float, float]:
    """Return radius (m) and angle (deg) of the regular formation of `count` ASVs that is best.

    Its middle is that of the survey, its radius at most the way to the farthest corner.  Arguments
    and errors are those of :func:`free_places`.
    """
    value = _value(scenario, objective, inputs)
    area = area_of(scenario)
    widest = max(math.dist(area.centroid, corner) for corner in area.outline)
    ring = regular.best_ring(count, value, widest, area.centroid, finely=FINE_RING)
    return round(ring.radius, 1), round(math.degrees(ring.angle), 1)


def free_places(
    scenario: Scenario,
    count: int,
    objective: Objective | Value = "coverage",
    inputs: Inputs | None = None,
) -> Floats:
    """Return the places (count, 2), m, from which `count` ASVs serve the AUVs' ways best.

    What is best says the objective, or a function of places (count, 2) whose value is to be least:

    * `coverage`: the share of its way on which an AUV is served, of the worst AUV and of all;
    * `information`: the mean over all ways of tr (P^-1 + J)^-1, P the covariance of dead reckoning
      alone until then and J the Fisher information of range and bearing of the ASVs, each by how
      likely it hears the AUV;
    * `error`: the predicted error of the worst AUV, `position_error_p95_m`.

    It begins with the best ring, with every place as near as possible (k centres) and, where that
    is too far, with most places heard, and descends from the best of these to a minimum nearby.
    `inputs` are those of the scenario's prediction, where somebody has them already.  The same
    scenario has the same places.

    Raises:
        ValueError: for less than one ASV, an objective that there is not, and as
            :func:`.prediction.inputs.inputs_of` does.
    """
    inputs = inputs or inputs_of(scenario)
    value = _value(scenario, objective, inputs)
    start = min(_starts(scenario, count, value, inputs), key=value)
    step = STEP * max(reach_of(inputs), FINELY_M)

    def flat(numbers: Floats) -> float:
        return value(numbers.reshape(-1, 2))

    places, _ = descended(flat, start.ravel(), step, FINELY_M, TRIALS * start.size)
    return np.round(places.reshape(-1, 2), 1)


def _value(scenario: Scenario, objective: Objective | Value, inputs: Inputs | None) -> Value:
    if callable(objective):
        return objective
    return objective_of(objective, inputs or inputs_of(scenario))


def _starts(scenario: Scenario, count: int, value: Value, inputs: Inputs) -> list[Floats]:
    """Return placements (count, 2), m, from which a better one may be near."""
    radius, angle = best_ring(scenario, count, value, inputs)
    ring = formation(count, radius, math.radians(angle)) + area_of(scenario).centroid
    ways, reach = inputs.ways.places_m.reshape(-1, 2), reach_of(inputs)
    covering = k_centre(ways, count)
    if covering.radius <= reach or reach == 0.0:
        return [ring, covering.places]
    return [ring, covering.places, max_cover(ways, count, reach).places]
