"""How sure a fix is of itself: its covariance, and how it is shortened by what it does not know."""

import math
from typing import NamedTuple

import numpy as np

from ..core.arrays import Floats
from ..core.compiled import compiled
from .array import Vector, cross, divided, length, scaled, tangents, turned_back, weighted

# A source nearer than this (m) is within the array; it only keeps divisions finite.
SHORTEST_RANGE = 1e-3

# Bearings and elevations are told apart beyond so many standard deviations from the vertical.
STEEP = 5.0

# What is added to no variance (rad2), and only keeps divisions finite.
TINY = 1e-30


class Across(NamedTuple):
    """What a direction errs by across itself: a covariance in the plane of two unit vectors (3,),
    scale (d e e^T - b (e f^T + f e^T) + a f f^T), m2, where e is level and f across both.
    """

    east: Vector
    down: Vector
    a: float
    b: float
    d: float
    scale: float


@compiled
def across_by_array(
    offset: Vector, attitude: Floats, metric: Floats, direction_sd: float
) -> Across:
    """Return the errors across an offset (3,), m, of a direction that an array has made out.

    `attitude` is the rotation from array to survey frame, `metric` the scatter matrix (m2),
    `direction_sd` the element noise times the sound speed (m): r^2 T (T^T M T)^-1 T^T sd^2.
    """
    reach = length(offset)
    east, down = tangents(divided(offset, reach))
    along_east, along_down = turned_back(attitude, east), turned_back(attitude, down)
    a, b = weighted(metric, along_east, along_east), weighted(metric, along_east, along_down)
    d = weighted(metric, along_down, along_down)
    return Across(east, down, a, b, d, (reach * direction_sd) ** 2 / (a * d - b * b))


@compiled
def across_by_sheet(offset: Vector, sds: tuple[float, float], share: float) -> Across:
    """Return a share of the errors across an offset (3,), m, of a bearing and an elevation (sd in
    rad, as stated).
    """
    square = offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2
    east, down = tangents(divided(offset, math.sqrt(square)))
    level, steep = sds_across(down[2], sds)
    return Across(east, down, steep**2, 0.0, level**2, share * square)


@compiled
def sds_across(level: float, sds: tuple[float, float]) -> tuple[float, float]:
    """Return what a direction errs by (sd, rad) across itself, level and steep, that is `level` so
    far seen from above (0 to 1), by a bearing and an elevation as stated.

    These are angles across at any elevation.  So few of their standard deviations from the vertical
    that a bearing cannot be told from an elevation, both are their mean square.
    """
    bearing, elevation = sds[0] ** 2, sds[1] ** 2
    apart = level**2 / (STEEP**2 * max(bearing, elevation, TINY))
    mixed = 0.5 * math.exp(-0.5 * apart) * (elevation - bearing)
    return math.sqrt(bearing + mixed), math.sqrt(elevation - mixed)


@compiled
def fix_covariance(
    offset: Vector,
    attitude: Floats,
    across: Across,
    ranging_sd: float,
    attitude_sd: Floats,
    gnss_sd: float,
) -> Floats:
    """Return the first-order covariance (3, 3), m2, of a fix, in the survey frame.

    `offset` points from the array to the source (survey frame, m), not 0; `attitude` is the
    rotation from array to survey frame, `across` what the direction errs by, `ranging_sd` in m,
    `attitude_sd` (roll, pitch, heading) in rad.  Source: physics of the first-order terms of
    eq. usbl_fix, sr^2 s s^T + across + [r s]x Sigma_att [r s]x^T + sg^2 I.
    """
    unit = divided(offset, length(offset))
    east, down, a, b, d, scale = across
    heading = math.atan2(attitude[1, 0], attitude[0, 0])
    ch, sh = math.cos(heading), math.sin(heading)
    by_roll = scaled(cross(offset, (ch, sh, 0.0)), attitude_sd[0])
    by_pitch = scaled(cross(offset, (-sh, ch, 0.0)), attitude_sd[1])
    by_heading = scaled(cross(offset, (0.0, 0.0, 1.0)), attitude_sd[2])
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            tangent = d * east[i] * east[j] - b * (east[i] * down[j] + down[i] * east[j])
            tangent += a * down[i] * down[j]
            out[i, j] = ranging_sd**2 * unit[i] * unit[j] + scale * tangent
            out[i, j] += by_roll[i] * by_roll[j]
            out[i, j] += by_pitch[i] * by_pitch[j]
            out[i, j] += by_heading[i] * by_heading[j]
        out[i, i] += gnss_sd**2
    return out


@compiled
def not_nothing(offset: Vector) -> Vector:
    """Return an offset (3,), m, or another one if it is too short to have a direction."""
    return (0.0, 0.0, SHORTEST_RANGE) if length(offset) < SHORTEST_RANGE else offset


@compiled
def debias(ahead: Vector, covariance: Floats, ranging_sd: float) -> float:
    """Return by how much an offset must be shortened; add what that is uncertain by.

    Given a measured direction with error covariance A, the source lies anywhere on a cap of the
    sphere around it: on average r tr(A) / 2 nearer to the array than the cap's top, with a radial
    variance of r^2 tr(A^2) / 2 that the first-order `covariance` (m2, changed in place) lacks.
    Where the cap would be the whole sphere, a measurement says no more than that the source lies
    somewhere on it: its centre, with a variance of r^2 / 3 along each axis.
    Source: measurement conversion conditioned on the measurement, Duan, Han and Li, IEEE Trans. AES
    40(4), 2004, to second order.  (Conversions that are unbiased over measurements of one place,
    as that of Lerro and Bar-Shalom, 1993, lengthen the offset instead.)
    """
    square = max(ahead[0] ** 2 + ahead[1] ** 2 + ahead[2] ** 2, SHORTEST_RANGE**2)
    trace = trace_of_square = 0.0
    for i in range(3):
        for j in range(3):
            across = covariance[i, j] - ranging_sd**2 * ahead[i] * ahead[j] / square
            trace_of_square += across * across
            if i == j:
                trace += across
    if trace >= 2.0 * square:
        for i in range(3):
            for j in range(3):
                covariance[i, j] = (square + ranging_sd**2) / 3.0 if i == j else 0.0
        return 0.0
    for i in range(3):
        for j in range(3):
            covariance[i, j] += 0.5 * trace_of_square / square * ahead[i] * ahead[j] / square
    return float(1.0 - 0.5 * trace / square)
