"""The error of each AUV, predicted without simulation (see docs/planning.md, Predicted error)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...records.worst import WORST_IS_LARGEST
from .inputs import Inputs
from .mapping import expected_largest, mean_size, quantile, scatter, sizes_of_all, squares
from .march import errors_of, smoothed
from .rounds import planned_rounds, turns_of
from .sights import SELDOM, fixes, seen
from .waiting import waiting

Floats = NDArray[np.float64]


class Prediction(NamedTuple):
    """What is expected of each of n AUVs; fields are those of table `auvs`.

    (n,) each but for `error_over_time` (n, k), m, at the instants of the inputs' ways.  Errors over
    single missions scatter about those expected by a share that `varies` (n,).
    """

    hf_coverage: Floats
    fix_rate_hz: Floats
    fix_age_mean_s: Floats
    fix_age_p95_s: Floats
    fix_age_max_s: Floats
    position_error_m: Floats
    position_error_rms_m: Floats
    position_error_p95_m: Floats
    error_over_time: Floats
    varies: Floats

    def of_fleet(self, metric: str) -> float:
        """Return the mean of a metric over all AUVs."""
        return float(getattr(self, metric).mean())

    def worst(self, metric: str) -> float:
        """Return a metric of the worst AUV, as it is expected of single missions.

        Which AUV fares worst is partly luck, so that the largest error of a mission is more than
        that of the AUV of which the largest is expected.
        """
        values = getattr(self, metric)
        if metric.startswith("position_error"):
            return expected_largest(values, self.varies)
        return float(values.max() if WORST_IS_LARGEST[metric] else values.min())


def predict(inputs: Inputs, stations: ArrayLike) -> Prediction:
    """Return what is expected of each AUV with ASVs at `stations` (m, 2), m."""
    asvs = np.asarray(stations, dtype=np.float64)
    sights = seen(inputs, asvs)
    plan = planned_rounds(inputs, sights)
    turns = turns_of(inputs, sights, plan)
    known = smoothed if inputs.navigator.kind.is_smoother else errors_of
    errors = known(inputs, turns, fixes(inputs, sights, inputs.ways.places_m, asvs))
    waits = waiting(turns, inputs.duration_s)
    square, shape = squares(errors.mean, errors.covariance)
    over_time = mean_size(square, shape)
    rounds = 1.0 / plan.period_s
    in_range = sights.heard > SELDOM
    passive = inputs.access.ranging.asvs_ping  # where the pings are those of ASVs
    covered = in_range.mean(axis=2) if passive else in_range.any(axis=2)
    return Prediction(
        (covered * rounds).sum(axis=1) / rounds.sum(),
        *waits,
        over_time.mean(axis=1),
        np.sqrt(square.mean(axis=1)),
        quantile(sizes_of_all(square, shape).reshape(len(square), -1), 0.95),
        over_time,
        scatter(errors, square, over_time),
    )
