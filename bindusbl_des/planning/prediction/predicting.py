"""The error of each AUV, predicted without simulation (see docs/planning.md, Predicted error)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .inputs import Inputs

Floats = NDArray[np.float64]


class Prediction(NamedTuple):
    """What is expected of each of n AUVs; fields are those of table `auvs`.

    (n,) each but for `error_over_time` (n, k), m, at the instants of the inputs' ways; and of the
    worst AUV, as table `mission` has it: the expected largest (`worst_...`) of what single missions
    have, which is more than the largest expected.
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
    worst: dict[str, float]
    mean: dict[str, float]


def predict(inputs: Inputs, stations: ArrayLike) -> Prediction:
    """Return what is expected of each AUV with ASVs at `stations` (m, 2), m."""
    raise NotImplementedError
