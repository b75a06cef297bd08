"""Who hears whom on the way, how likely, and what a fix errs by then: with stations of the ASVs."""

from typing import NamedTuple

import numpy as np

from ...core.arrays import Flags, Floats
from . import systematic
from .inputs import Inputs
from .parts import Chances

# Signals that are decoded more seldom are out of range, as those of :mod:`...acoustics.channel`.
SELDOM = 1e-6

# An AUV so near (m) to where an ASV is, seen from above, is below it.
CLOSE_M = 1e-6


class ExpectedSights(NamedTuple):
    """What n AUVs and m ASVs are to each other at k instants.

    How far away they are (n, k, m), m, seen from above and slant; which are in range as the
    protocol counts it (n, k, m); how likely a ping is decoded (n, k, m), and a frame.
    """

    level_m: Floats
    slant_m: Floats
    in_range: Flags
    heard: Floats
    delivered: Floats


class Fixes(NamedTuple):
    """What fixes err by: variances and covariance xx, yy, xy (n, k, w, 3), m2, of `noise` of their
    own, and of what `lasts`, which falls apart at a `rate` (n, k, w), 1/s.

    There are as many kinds w of fixes as ASVs where each is of one of them, else one.
    """

    noise: Floats
    lasts: Floats
    rate: Floats


def looked_up(table: Floats, step: float, away: Floats) -> Floats:
    """Return the values of tables (n, g) or (g,) at distances (n, ...): straight between the steps,
    the last one beyond them.
    """
    place = np.minimum(away / step, table.shape[-1] - 1.0)
    low = np.minimum(place.astype(np.int64), table.shape[-1] - 2)
    share = place - low
    if table.ndim == 1:
        return np.asarray(table[low] + share * (table[low + 1] - table[low]))
    rows = np.arange(len(table)).reshape(-1, *(1,) * (away.ndim - 1))
    return np.asarray(table[rows, low] + share * (table[rows, low + 1] - table[rows, low]))


def seen(inputs: Inputs, stations: Floats) -> ExpectedSights:
    """Return what AUVs on their ways and ASVs at stations (m, 2), m, are to each other."""
    return sights(inputs, inputs.ways.places_m, stations)


def sights(inputs: Inputs, places: Floats, stations: Floats) -> ExpectedSights:
    """Return what AUVs at places (n, k, 2), m, and ASVs at stations (m, 2), are to each other."""
    north = places[:, :, np.newaxis, 0] - stations[:, 0]
    east = places[:, :, np.newaxis, 1] - stations[:, 1]
    squares = north * north + east * east
    depths = inputs.ways.depths_m[:, np.newaxis, np.newaxis]
    level, slant = np.sqrt(squares), np.sqrt(squares + depths * depths)
    counted = slant if inputs.hf.by_slant else level
    in_range = counted <= inputs.hf.range_m
    heard = _chance(inputs.hf, level, slant)
    delivered = _chance(inputs.mf, level, slant)
    return ExpectedSights(level, slant, in_range, heard, delivered)


def _chance(chances: Chances, level: Floats, slant: Floats) -> Floats:
    found = looked_up(chances.chances, chances.step_m, slant)
    if not chances.is_cut:
        return found
    return np.where((slant if chances.by_slant else level) <= chances.range_m, found, 0.0)


def located(inputs: Inputs, sights: ExpectedSights) -> Floats:
    """Return how likely a ping of an AUV makes a fix (n, k, w): of all ASVs that hear it together,
    or (passive) the ping of each ASV one of its own.
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
    """Return what fixes err by at places (n, k, 2), m."""
    noise, level = inputs.noise, sights.level_m
    along, across, down, leaning = (
        looked_up(table, noise.step_m, level)
        for table in (noise.along_m2, noise.across_m2, noise.down_m2, noise.leaning_m2)
    )
    above = level < CLOSE_M  # where any line will do
    away = np.where(above, 1.0, level)
    cosine = np.where(above, 1.0, (places[:, :, np.newaxis, 0] - stations[:, 0]) / away)
    sine = np.where(above, 0.0, (places[:, :, np.newaxis, 1] - stations[:, 1]) / away)
    line, apart = (cosine, sine), (level, sights.slant_m)
    if inputs.access.ranging.asvs_ping:
        one = Fixes(
            systematic.turned(along, across, line), *systematic.of_each(inputs, *apart, line)
        )
        return _with_slow(inputs, one, looked_up(noise.slow, noise.step_m, level))
    weights = sights.heard
    if inputs.access.downlink.replies:  # the first to hear it answers by itself
        weights = np.where(level == level.min(axis=2, keepdims=True), weights, 0.0)
    fused = _fused((along, across, down, leaning), weights, line)
    if inputs.systematic.is_none:
        return Fixes(fused, np.zeros(fused.shape), np.zeros(fused.shape[:3]))
    found = Fixes(fused, *systematic.of_all(inputs, *apart, line, weights, (along, across)))
    slow = _added(weights * looked_up(noise.slow, noise.step_m, level))
    share = slow / np.maximum(_added(weights), SELDOM)
    return _with_slow(inputs, found, share[:, :, np.newaxis])


def _with_slow(inputs: Inputs, fixes: Fixes, share: Floats) -> Fixes:
    """Return fixes of whose noise a share (n, k, w) is slow: it is of what they have in common."""
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
    """Return the covariance (n, k, 1, 3) of the fix that ASVs make together of one ping.

    Their information adds up, each by how likely it hears a ping that is heard; it is that of three
    axes, since depths that several measure tell of the distances too.
    """
    (along, across, down, leaning), (cosine, sine) = errors, line
    missed = np.ones(weights.shape[:2])
    for asv in range(weights.shape[2]):
        missed = missed * (1.0 - weights[:, :, asv])
    share = weights / np.maximum(1.0 - missed, SELDOM)[:, :, np.newaxis]
    determinant = np.maximum(along * down - leaning * leaning, 1e-30)
    by_along, by_down = share * down / determinant, share * along / determinant
    by_both, by_across = -share * leaning / determinant, share / np.maximum(across, 1e-30)
    plain = systematic.turned(by_along, by_across, line)
    xx, yy, xy = (_added(plain[:, :, :, k]) for k in range(3))
    zz, xz, yz = _added(by_down), _added(by_both * cosine), _added(by_both * sine)
    zz = np.maximum(zz, 1e-30)
    xx, yy, xy = xx - xz * xz / zz, yy - yz * yz / zz, xy - xz * yz / zz
    determinant = np.maximum(xx * yy - xy * xy, 1e-30)
    return np.stack((yy / determinant, xx / determinant, -xy / determinant), axis=-1)[:, :, None]


def _added(parts: Floats) -> Floats:
    """Return the sum over ASVs (n, k) of parts (n, k, m), the first ASV first."""
    total = np.zeros(parts.shape[:2])
    for asv in range(parts.shape[2]):
        total = total + parts[:, :, asv]
    return total
