"""What fixes have in common all the time: errors of arrays, of GNSS, of sound speed and clocks.

All of it is taken for one error of place that the fixes of an AUV share: it has the covariance that
belongs to where the AUV is, and falls apart as GNSS errors wander and as the AUV moves on around
the ASVs.
"""

import numpy as np

from ...core.arrays import Floats
from .inputs import Inputs


def of_each(
    inputs: Inputs, level: Floats, slant: Floats, line: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Return xx, yy, xy (..., 3), m2, of what lasts in fixes by single arrays, and at which rate
    (...), 1/s, it falls apart.

    They are `level` (...), m, away seen from above and `slant` in truth, in the direction `line`,
    its cosine and sine.
    """
    systematic, share = inputs.systematic, level / np.maximum(slant, 1e-9)
    late = systematic.clock_s * inputs.slots.sound_speed_m_per_s * share
    along = (systematic.sound_speed_share * level) ** 2 + late**2 + systematic.gnss_m**2
    across = (systematic.misalignment_rad * level) ** 2 + systematic.gnss_m**2
    return turned(along, across, line), _rate(inputs, along + across, level)


def of_all(
    inputs: Inputs,
    level: Floats,
    slant: Floats,
    line: tuple[Floats, Floats],
    weights: Floats,
    errors: tuple[Floats, Floats],
) -> tuple[Floats, Floats]:
    """Return xx, yy, xy (n, k, 1, 3), m2, of what lasts in fixes that ASVs make together, and at
    which rate (n, k, 1), 1/s, it falls apart.

    Arguments (n, k, m) as of :func:`of_each`; `weights` tell how likely each hears a ping, `errors`
    (m2) what else the fix of each errs by along and across its line.  What each array has by itself
    averages out; what all ranges have adds up by direction, and is nothing between two opposite
    ASVs.
    """
    systematic, (cosine, sine) = inputs.systematic, line
    turns = (systematic.misalignment_rad * level) ** 2 + systematic.gnss_m**2
    shifts = np.full(level.shape, systematic.gnss_m**2)
    along, across = errors[0] + shifts, errors[1] + turns
    said = turned(weights / np.maximum(along, 1e-30), weights / np.maximum(across, 1e-30), line)
    own = turned(shifts, turns, line)
    late = systematic.clock_s * inputs.slots.sound_speed_m_per_s * level / np.maximum(slant, 1e-9)
    far = systematic.sound_speed_share * level
    xx, yy, xy = (_added(said[..., k]) for k in range(3))
    determinant = np.maximum(xx * yy - xy * xy, 1e-30)
    pull = np.empty((*level.shape, 2, 2))  # what each ASV's fix adds to that of all
    for i, (first, second) in enumerate(((yy, -xy), (-xy, xx))):
        for j, column in enumerate(((0, 2), (2, 1))):
            product = (
                first[..., None] * said[..., column[0]] + second[..., None] * said[..., column[1]]
            )
            pull[..., i, j] = product / determinant[..., None]
    out = np.zeros((*level.shape[:2], 3))
    for k, (i, j) in enumerate(((0, 0), (1, 1), (0, 1))):
        out[..., k] = _added(
            pull[..., i, 0] * (own[..., 0] * pull[..., j, 0] + own[..., 2] * pull[..., j, 1])
            + pull[..., i, 1] * (own[..., 2] * pull[..., j, 0] + own[..., 1] * pull[..., j, 1])
        )
        for size in (late, far):
            moved = [
                _added((pull[..., axis, 0] * cosine + pull[..., axis, 1] * sine) * size)
                for axis in (i, j)
            ]
            out[..., k] += moved[0] * moved[1]
    heard = np.maximum(_added(weights), 1e-9)
    apart = _added(weights * level) / heard
    rate = _rate(inputs, out[..., 0] + out[..., 1], apart, heard)
    return out[:, :, np.newaxis], rate[:, :, np.newaxis]


def _rate(inputs: Inputs, square: Floats, level: Floats, arrays: Floats | float = 1.0) -> Floats:
    """Return the rate (1/s) at which an error of some mean `square` (m2) falls apart.

    What is of GNSS wanders with its time constant; all else turns with the direction of ASVs that
    are `level` (m) away on average.
    """
    ways, systematic = inputs.ways, inputs.systematic
    moved = np.diff(ways.places_m, axis=1)
    speed = np.sqrt((moved * moved).sum(axis=2)).sum(axis=1) / inputs.duration_s
    by_gnss = np.minimum(2.0 * systematic.gnss_m**2 / arrays / np.maximum(square, 1e-30), 1.0)
    turning = speed.reshape(-1, *(1,) * (level.ndim - 1)) / np.maximum(level, 1.0)
    return np.asarray(by_gnss / systematic.gnss_time_constant_s + (1.0 - by_gnss) * turning)


def turned(along: Floats, across: Floats, line: tuple[Floats, Floats]) -> Floats:
    """Return variances xx, yy and covariance xy (..., 3) of errors along and across a line."""
    cosine, sine = line
    beside = (along - across) * cosine * sine
    xx = along * cosine * cosine + across * sine * sine
    yy = along * sine * sine + across * cosine * cosine
    return np.stack((xx, yy, beside), axis=-1)


def _added(parts: Floats) -> Floats:
    """Return the sum over the last axis, its first element first."""
    total = np.zeros(parts.shape[:-1])
    for asv in range(parts.shape[-1]):
        total = total + parts[..., asv]
    return total
