"""Which vehicles hear each other on the paths, with which probability, and the errors of fixes.

Systematic errors (arrays, GNSS, sound speed, clocks) are approximated by one position error that an
AUV's fixes have in common.  It has the covariance of the AUV's position, and decorrelates as GNSS
errors change and as the AUV moves around the ASVs.
"""

from typing import NamedTuple

import numpy as np

from ....support.arrays import Flags, Floats
from .inputs import Chances, Inputs

# A smaller probability counts as out of range, as in :mod:`....core.acoustics.channel`.
SELDOM = 1e-6

# At a smaller horizontal distance (m) an AUV is below an ASV.
CLOSE_M = 1e-6


class ExpectedSights(NamedTuple):
    """Distances and probabilities between n AUVs and m ASVs at k instants, (n, k, m) each.

    `level_m` is the horizontal distance, `slant_m` the slant one; `in_range` as the protocol counts
    it; `heard` and `delivered` are the probabilities that a ping and a frame are decoded.
    """

    level_m: Floats
    slant_m: Floats
    in_range: Flags
    heard: Floats
    delivered: Floats


class Fixes(NamedTuple):
    """The errors of fixes: variances and covariance xx, yy, xy (n, k, w, 3; m2) of their own
    `noise`, and of their common error (`lasts`), which decorrelates at a `rate` (n, k, w; 1/s).

    There are w = m kinds of fixes if each is of one ASV, else one.
    """

    noise: Floats
    lasts: Floats
    rate: Floats


def looked_up(table: Floats, step: float, away: Floats) -> Floats:
    """Interpolate tables (n, m, g) or (g,) at distances (n, ..., m), constant beyond their end.

    Where m = 1 in a table, it holds for every ASV.
    """
    place = np.minimum(away / step, table.shape[-1] - 1.0)
    low = np.minimum(place.astype(np.int64), table.shape[-1] - 2)
    share = place - low
    if table.ndim == 1:
        return np.asarray(table[low] + share * (table[low + 1] - table[low]))
    rows = np.arange(len(table)).reshape(-1, *(1,) * (away.ndim - 1))
    whose = np.minimum(np.arange(away.shape[-1]), table.shape[1] - 1)
    at = table[rows, whose, low]
    return np.asarray(at + share * (table[rows, whose, low + 1] - at))


def seen(inputs: Inputs, stations: Floats) -> ExpectedSights:
    """Return distances and probabilities along the AUVs' paths for stations (m, 2; m)."""
    return sights(inputs, inputs.ways.places_m, stations)


def sights(inputs: Inputs, places: Floats, stations: Floats) -> ExpectedSights:
    """Return distances and probabilities for AUVs at places (n, k, 2; m) and stations (m, 2; m)."""
    north = places[:, :, np.newaxis, 0] - stations[:, 0]
    east = places[:, :, np.newaxis, 1] - stations[:, 1]
    squares = north * north + east * east
    depths = inputs.ways.depths_m[:, np.newaxis, np.newaxis]
    level, slant = np.sqrt(squares), np.sqrt(squares + depths * depths)
    counted = slant if inputs.hf.by_slant else level
    in_range = counted <= inputs.hf.range_m
    heard = _chance(inputs.hf, level, slant)
    delivered = _chance(inputs.mf, level, slant)
    if inputs.land is not None:
        blocked = inputs.land.crossed(places.reshape(-1, 2), stations).reshape(level.shape)
        for found in (in_range, heard, delivered):
            found[blocked] = 0
    return ExpectedSights(level, slant, in_range, heard, delivered)


def _chance(chances: Chances, level: Floats, slant: Floats) -> Floats:
    found = looked_up(chances.chances, chances.step_m, slant)
    if not chances.is_cut:
        return found
    return np.where((slant if chances.by_slant else level) <= chances.range_m, found, 0.0)


def located(inputs: Inputs, sights: ExpectedSights) -> Floats:
    """Return the probability that a ping makes a fix (n, k, w).

    All ASVs that hear an AUV's ping make one fix; with passive ranging each ASV's ping makes its
    own.
    """
    heard = sights.heard
    if inputs.access.ranging.asvs_ping:
        return heard
    missed = np.ones(heard.shape[:2])
    for asv in range(heard.shape[2]):
        missed = missed * (1.0 - heard[:, :, asv])
    found = 1.0 - missed
    if inputs.access.ranging.calls:
        nearest = sights.level_m.argmin(axis=2)[:, :, np.newaxis]
        found = found * np.take_along_axis(heard, nearest, axis=2)[:, :, 0]
    return np.asarray(found[:, :, np.newaxis])


def fixes(inputs: Inputs, sights: ExpectedSights, places: Floats, stations: Floats) -> Fixes:
    """Return the errors of fixes at places (n, k, 2; m)."""
    noise, level = inputs.noise, sights.level_m
    along, across, down, leaning = (
        looked_up(table, noise.step_m, level)
        for table in (noise.along_m2, noise.across_m2, noise.down_m2, noise.leaning_m2)
    )
    above = level < CLOSE_M  # where the bearing is arbitrary
    away = np.where(above, 1.0, level)
    cosine = np.where(above, 1.0, (places[:, :, np.newaxis, 0] - stations[:, 0]) / away)
    sine = np.where(above, 0.0, (places[:, :, np.newaxis, 1] - stations[:, 1]) / away)
    line, apart = (cosine, sine), (level, sights.slant_m)
    if inputs.access.ranging.asvs_ping:
        one = Fixes(_turned(along, across, line), *_common_of_each(inputs, *apart, line))
        return _with_slow(inputs, one, looked_up(noise.slow, noise.step_m, level))
    weights = sights.heard
    if inputs.access.downlink.replies:  # the nearest ASV answers with its own fix
        weights = np.where(level == level.min(axis=2, keepdims=True), weights, 0.0)
    fused = _fused((along, across, down, leaning), weights, line)
    if inputs.systematic.is_none:
        return Fixes(fused, np.zeros(fused.shape), np.zeros(fused.shape[:3]))
    found = Fixes(fused, *_common_of_all(inputs, *apart, line, weights, (along, across)))
    slow = added(weights * looked_up(noise.slow, noise.step_m, level))
    share = slow / np.maximum(added(weights), SELDOM)
    return _with_slow(inputs, found, share[:, :, np.newaxis])


def _with_slow(inputs: Inputs, fixes: Fixes, share: Floats) -> Fixes:
    """Move the slow share (n, k, w) of the noise of fixes to their common error."""
    lasts_s = inputs.systematic.slow_s
    if lasts_s == 0.0:
        return fixes
    noise, common, rate = fixes
    slow = share[..., np.newaxis] * noise
    own, other = slow[..., 0] + slow[..., 1], common[..., 0] + common[..., 1]
    rate = (own / lasts_s + other * rate) / np.maximum(own + other, 1e-30)
    return Fixes(noise - slow, common + slow, rate)


def _fused(
    errors: tuple[Floats, Floats, Floats, Floats], weights: Floats, line: tuple[Floats, Floats]
) -> Floats:
    """Return the covariance (n, k, 1, 3) of the fix of all ASVs that hear a ping.

    Their information is added in three axes, since several measured depths constrain distances;
    each is weighted with the probability that the ASV hears a ping that any ASV hears.
    """
    (along, across, down, leaning), (cosine, sine) = errors, line
    missed = np.ones(weights.shape[:2])
    for asv in range(weights.shape[2]):
        missed = missed * (1.0 - weights[:, :, asv])
    share = weights / np.maximum(1.0 - missed, SELDOM)[:, :, np.newaxis]
    determinant = np.maximum(along * down - leaning * leaning, 1e-30)
    by_along, by_down = share * down / determinant, share * along / determinant
    by_both, by_across = -share * leaning / determinant, share / np.maximum(across, 1e-30)
    plain = _turned(by_along, by_across, line)
    xx, yy, xy = (added(plain[:, :, :, k]) for k in range(3))
    zz, xz, yz = added(by_down), added(by_both * cosine), added(by_both * sine)
    zz = np.maximum(zz, 1e-30)
    xx, yy, xy = xx - xz * xz / zz, yy - yz * yz / zz, xy - xz * yz / zz
    determinant = np.maximum(xx * yy - xy * xy, 1e-30)
    return np.stack((yy / determinant, xx / determinant, -xy / determinant), axis=-1)[:, :, None]


def _common_of_each(
    inputs: Inputs, level: Floats, slant: Floats, line: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Return the common error xx, yy, xy (..., 3; m2) of single arrays' fixes, and its rate.

    The rate (...; 1/s) is that of its decorrelation.  `level` and `slant` (...; m) are distances,
    `line` the cosine and sine of the bearing.
    """
    systematic, share = inputs.systematic, level / np.maximum(slant, 1e-9)
    late = systematic.clock_s * inputs.slots.sound_speed_m_per_s * share
    along = (systematic.sound_speed_share * level) ** 2 + late**2 + systematic.gnss_m**2
    across = (systematic.misalignment_rad * level) ** 2 + systematic.gnss_m**2
    return _turned(along, across, line), _rate(inputs, along + across, level)


def _common_of_all(
    inputs: Inputs,
    level: Floats,
    slant: Floats,
    line: tuple[Floats, Floats],
    weights: Floats,
    errors: tuple[Floats, Floats],
) -> tuple[Floats, Floats]:
    """Return the common error xx, yy, xy (n, k, 1, 3; m2) of fused fixes, and its rate (1/s).

    Arguments (n, k, m) are as in :func:`_common_of_each`; `weights` are probabilities that ASVs
    hear a ping, `errors` (m2) the other variances along and across each line.  Errors of single
    arrays average out; a range error of all adds by direction, and cancels between opposite ASVs.
    """
    systematic, (cosine, sine) = inputs.systematic, line
    turns = (systematic.misalignment_rad * level) ** 2 + systematic.gnss_m**2
    shifts = np.full(level.shape, systematic.gnss_m**2)
    along, across = errors[0] + shifts, errors[1] + turns
    said = _turned(weights / np.maximum(along, 1e-30), weights / np.maximum(across, 1e-30), line)
    own = _turned(shifts, turns, line)
    late = systematic.clock_s * inputs.slots.sound_speed_m_per_s * level / np.maximum(slant, 1e-9)
    far = systematic.sound_speed_share * level
    xx, yy, xy = (added(said[..., k]) for k in range(3))
    determinant = np.maximum(xx * yy - xy * xy, 1e-30)
    pull = np.empty((*level.shape, 2, 2))  # the weight matrix of each ASV's fix
    for i, (first, second) in enumerate(((yy, -xy), (-xy, xx))):
        for j, column in enumerate(((0, 2), (2, 1))):
            product = (
                first[..., None] * said[..., column[0]] + second[..., None] * said[..., column[1]]
            )
            pull[..., i, j] = product / determinant[..., None]
    out = np.zeros((*level.shape[:2], 3))
    for k, (i, j) in enumerate(((0, 0), (1, 1), (0, 1))):
        out[..., k] = added(
            pull[..., i, 0] * (own[..., 0] * pull[..., j, 0] + own[..., 2] * pull[..., j, 1])
            + pull[..., i, 1] * (own[..., 2] * pull[..., j, 0] + own[..., 1] * pull[..., j, 1])
        )
        for size in (late, far):
            moved = [
                added((pull[..., axis, 0] * cosine + pull[..., axis, 1] * sine) * size)
                for axis in (i, j)
            ]
            out[..., k] += moved[0] * moved[1]
    heard = np.maximum(added(weights), 1e-9)
    apart = added(weights * level) / heard
    rate = _rate(inputs, out[..., 0] + out[..., 1], apart, heard)
    return out[:, :, np.newaxis], rate[:, :, np.newaxis]


def _rate(inputs: Inputs, square: Floats, level: Floats, arrays: Floats | float = 1.0) -> Floats:
    """Return the rate (1/s) at which an error of a mean `square` (m2) decorrelates.

    The GNSS part has its own time constant; the rest turns with the bearing of ASVs at a mean
    distance `level` (m).
    """
    ways, systematic = inputs.ways, inputs.systematic
    moved = np.diff(ways.places_m, axis=1)
    speed = np.sqrt((moved * moved).sum(axis=2)).sum(axis=1) / inputs.duration_s
    by_gnss = np.minimum(2.0 * systematic.gnss_m**2 / arrays / np.maximum(square, 1e-30), 1.0)
    turning = speed.reshape(-1, *(1,) * (level.ndim - 1)) / np.maximum(level, 1.0)
    return np.asarray(by_gnss / systematic.gnss_time_constant_s + (1.0 - by_gnss) * turning)


def _turned(along: Floats, across: Floats, line: tuple[Floats, Floats]) -> Floats:
    """Return variances xx, yy and covariance xy (..., 3) from those along and across a line."""
    cosine, sine = line
    beside = (along - across) * cosine * sine
    xx = along * cosine * cosine + across * sine * sine
    yy = along * sine * sine + across * cosine * cosine
    return np.stack((xx, yy, beside), axis=-1)


def added(parts: Floats) -> Floats:
    """Return the sum over the last axis, its first element first."""
    total = np.zeros(parts.shape[:-1])
    for asv in range(parts.shape[-1]):
        total = total + parts[..., asv]
    return total
