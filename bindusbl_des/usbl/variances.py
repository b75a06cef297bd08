"""How far off fixes by one array are, by distance: what a prediction takes of an instrument."""

import math

import numpy as np

from ..core.arrays import Floats
from ..core.compiled import compiled
from ..records.rows import Rows
from .array import NOTHING, dot, turned
from .measuring import NOISE_WIDTH, Instrument, Sighting, path_sd, placed, spread_sd


@compiled
def variances(
    away: Floats, depth: float, snr_db: Floats, moved: float, weighs: bool,
    array: Floats, metric: Floats, levels: Rows,
) -> Floats:  # fmt: skip
    """Return the variances along, across and down, and the covariance of along and down (g, 4), m2,
    of fixes at horizontal distances (g,), m, and a depth (m).

    Of the path of a call and its answer, which an AUV has `moved` on (m2) meanwhile, half is the
    range.  A filter that `weighs` them knows the direction better than one fix, and so how far away
    an AUV is as well as the range itself is known (:mod:`..navigation.turning`).
    """
    instrument = Instrument(array, metric, levels[0])
    out, none, believed = np.empty((away.size, 4)), np.zeros(NOISE_WIDTH), np.eye(3)
    for k in range(away.size):
        reach = max(math.hypot(away[k], depth), 1e-3)
        unit = away[k] / reach, 0.0, depth / reach
        ranging_sd = path_sd(reach, instrument.levels)
        if moved >= 0.0:
            ranging_sd = 0.5 * math.sqrt(path_sd(2.0 * reach, instrument.levels) ** 2 + moved)
        seen = Sighting(NOTHING, unit, believed, reach, snr_db[k], depth)
        _, spread = placed(seen, reach, ranging_sd, none, instrument)
        if weighs:
            spread_m2 = spread_sd(reach, instrument.levels) ** 2
            own = instrument.levels.gnss_sd_m**2 + (1.0 - instrument.levels.slow_share) * spread_m2
            bent = dot(turned(spread, unit), unit) - ranging_sd**2 - own
            for i in range(3):
                for j in range(3):
                    spread[i, j] -= bent * unit[i] * unit[j]
        out[k, 0], out[k, 1] = spread[0, 0], spread[1, 1]
        out[k, 2], out[k, 3] = spread[2, 2], spread[0, 2]
    return out
