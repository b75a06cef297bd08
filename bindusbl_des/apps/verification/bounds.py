"""How far off a fix of one ASV may be: every error of its instrument, and all that lasts, at once.

Gaussian errors have no bound: they are taken as so many standard deviations as they exceed with a
chance that one chooses (:func:`exceeded`).
"""

import math
from typing import NamedTuple

import numpy as np

from ...core.usbl.instrument import Usbl

# Nearer (in sizes of the array) than this a wave is too round for the array to tell a direction.
ROUND = 10.0


class Beside(NamedTuple):
    """What makes a fix wrong beside the instrument.

    Standard deviations of a misalignment (rad), of slow GNSS errors and of outliers along an axis
    (m); and bounds: of clocks (s), of the error of the sound speed assumed (m/s), and of how far
    the AUV goes while it is ranged (m).
    """

    misalignment_sd: float = 0.0
    slow_gnss_sd: float = 0.0
    outlier_sd: float = 0.0
    clock_s: float = 0.0
    sound_speed_error: float = 0.0
    moved_m: float = 0.0


def exceeded(chance: float, draws: float) -> float:
    """Return how many standard deviations z none of some `draws` exceeds but with a `chance`.

    Of a vector of d independent standard normal numbers the norm exceeds z + sqrt(d) with less than
    exp(-z^2 / 2) (concentration of Gaussian measure), and all draws together with at most the sum
    (Boole).

    >>> round(exceeded(1e-6, 1e5), 2)
    7.12
    """
    return math.sqrt(2.0 * math.log(max(draws, 1.0) / chance))


def farthest_off(usbl: Usbl, nearest: float, reach: float, beside: Beside, z: float) -> float:
    """Return how far (m), horizontally, a fix by one ASV may be from where its AUV pinged.

    The AUV is from `nearest` to `reach` (m) away; each Gaussian error is less than `z` standard
    deviations (:func:`exceeded`).  With r' the range measured along u', r along u the true one, it
    is |r' u' - r u| <= |r' - r| + r |u' - u|, and what moves the fix as a whole.
    """
    levels, speed = usbl.levels[0], usbl.sound_speed
    path = reach * speed / (speed - beside.sound_speed_error)
    noise = math.hypot(speed * levels["travel_time_sd_s"], levels["path_share"] * path)
    ranged = path - reach + z * noise
    ranged += speed * beside.clock_s + beside.moved_m
    turned, variance = _turned(usbl, beside, z)
    longest = reach + ranged
    shortened = min(variance / 2, 1.0) * longest  # of directions that are not sure (`debias`)
    across = reach * turned + _rounded(usbl)
    if usbl.sheet is None and nearest < ROUND * _size(usbl):
        across = max(across, 2 * ROUND * _size(usbl))
    spread = math.hypot(levels["spread_sd_m"], levels["spread_share"] * longest)
    moved = usbl.gnss_sd + beside.slow_gnss_sd + beside.outlier_sd + spread
    return float(ranged + shortened + min(across, 2 * reach) + _norm(z, 2) * moved)


def _norm(z: float, axes: int) -> float:
    return z + math.sqrt(axes)


def _turned(usbl: Usbl, beside: Beside, z: float) -> tuple[float, float]:
    """Return how far apart (chord) the unit vectors of a believed and a true direction may be, and
    the variance (rad2) that the instrument gives a direction.
    """
    attitude = math.hypot(*usbl.attitude_sd)
    aside = _norm(z, 3) * attitude + z * beside.misalignment_sd
    if usbl.sheet is not None:
        sds = usbl.sheet.bearing_sd, usbl.sheet.elevation_sd
        return aside + _norm(z, 2) * math.hypot(*sds), math.hypot(*sds, attitude) ** 2
    # The direction that comes nearest to what was measured is no farther from that than the truth
    # is, in the metric of the array: it is off by twice the error of the arrivals at most.
    weakest, levels = _weakest(usbl), usbl.levels[0]
    off = usbl.sound_speed * _norm(z, 3) * levels["element_sd_s"]
    scaled = beside.sound_speed_error / (usbl.sound_speed - beside.sound_speed_error)
    off += scaled * math.sqrt(float(np.linalg.eigvalsh(usbl.metric)[-1]))
    angle_sd = usbl.sound_speed * levels["element_sd_s"] / math.sqrt(weakest)
    return aside + 2 * off / math.sqrt(weakest), 2 * angle_sd**2 + attitude**2


def _rounded(usbl: Usbl) -> float:
    """Return how far (m) a fix is off, at whatever range, because the wave is not plane."""
    if usbl.sheet is not None:
        return 0.0
    ways = np.linalg.norm(usbl.array, axis=1)
    aside = np.linalg.norm(usbl.array - usbl.array.mean(axis=0), axis=1)
    return float((aside * ways**2).sum() / (1 - 1 / ROUND) / _weakest(usbl))


def _weakest(usbl: Usbl) -> float:
    """Return the scatter (m2) of the array along the axis in which it resolves least."""
    return float(np.linalg.eigvalsh(usbl.metric)[0])


def _size(usbl: Usbl) -> float:
    return float(np.linalg.norm(usbl.array, axis=1).max())
