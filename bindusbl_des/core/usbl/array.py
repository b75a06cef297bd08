"""The direction of a ping, measured by a small array of hydrophones.

Frames: the survey frame has x north, y east and z down; the array frame has x forward, y to
starboard and z down, so a target below the array has a positive z.  Angles are in radians: azimuth
from x towards y, elevation positive downwards.  Vectors are tuples of three numbers, which compiled
code keeps in registers (arrays would be allocated each time); sums run from x to z.
"""

import math
from collections.abc import Sequence
from math import sqrt

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined

# x, y, z
Vector = tuple[float, float, float]

NOTHING: Vector = (0.0, 0.0, 0.0)


@inlined
def plus(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def minus(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def scaled(a: Vector, factor: float) -> Vector:
    """Return a times a factor."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@inlined
def divided(a: Vector, divisor: float) -> Vector:
    """Return a over a divisor."""
    return a[0] / divisor, a[1] / divisor, a[2] / divisor


@inlined
def negative(a: Vector) -> Vector:
    """Return -a."""
    return -a[0], -a[1], -a[2]


@inlined
def dot(a: Vector, b: Vector) -> float:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def length(a: Vector) -> float:
    """Return |a|."""
    return sqrt(dot(a, a))


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def weighted(metric: Floats, a: Vector, b: Vector) -> float:
    """Return a^T M b of a metric M (3, 3), symmetric."""
    along = metric[0, 0] * a[0] * b[0] + metric[1, 1] * a[1] * b[1]
    along += metric[2, 2] * a[2] * b[2]
    along += metric[0, 1] * (a[0] * b[1] + a[1] * b[0])
    along += metric[0, 2] * (a[0] * b[2] + a[2] * b[0])
    return float(along + metric[1, 2] * (a[1] * b[2] + a[2] * b[1]))


@inlined
def row_of(matrix: Floats, row: int) -> Vector:
    """Return a row of a matrix (n, 3)."""
    return matrix[row, 0], matrix[row, 1], matrix[row, 2]


@inlined
def rotated(rotation: Floats, a: Vector) -> Vector:
    """Return R a of a rotation R (3, 3)."""
    return dot(row_of(rotation, 0), a), dot(row_of(rotation, 1), a), dot(row_of(rotation, 2), a)


@inlined
def rotated_back(rotation: Floats, a: Vector) -> Vector:
    """Return R^T a of a rotation R (3, 3)."""
    x = rotation[0, 0] * a[0] + rotation[1, 0] * a[1] + rotation[2, 0] * a[2]
    y = rotation[0, 1] * a[0] + rotation[1, 1] * a[1] + rotation[2, 1] * a[2]
    z = rotation[0, 2] * a[0] + rotation[1, 2] * a[1] + rotation[2, 2] * a[2]
    return x, y, z


# Number of elements whose noise is at the beginning of a row of noise
ELEMENTS = 5

# Hydrophone positions in the array frame (m).
ARRAYS: dict[str, Floats] = {
    # Nitsch 2024, USBL-Simulator: four at the base, one at the apex, apex down, centroid at 0
    "oem5": np.array(
        [
            [0.022275, 0.022275, -0.014696],
            [0.022275, -0.022275, -0.014696],
            [-0.022275, 0.022275, -0.014696],
            [-0.022275, -0.022275, -0.014696],
            [0.0, 0.0, 0.058784],
        ]
    ),
    # Cross of 30 mm arms; the height sqrt(2.5) d makes all directions equally good
    "cross5": np.array(
        [
            [0.03, 0.0, 0.0],
            [-0.03, 0.0, 0.0],
            [0.0, 0.03, 0.0],
            [0.0, -0.03, 0.0],
            [0.0, 0.0, 0.03 * math.sqrt(2.5)],
        ]
    ),
}


def elements_of(array: str | Sequence[Sequence[float]]) -> Floats:
    """Return the positions of an array's elements (n, 3), m, in the array frame.

    An array is named, or given by the positions of its elements (m, body frame): their mean is the
    origin, which is the position of the vessel's navigation.
    """
    if isinstance(array, str):
        return ARRAYS[array]
    places = np.array(array, dtype=np.float64)
    return np.asarray(places - places.mean(axis=0))


# Relative rounding errors off the diagonal of a scatter matrix
ROUNDING = 1e-12

# Gauss-Newton steps on the sphere; the second changes the direction by less than 1e-6 rad
REFINEMENTS = 2


def scatter(array: Floats) -> Floats:
    """Return the scatter matrix M = sum (p - mean)(p - mean)^T of an array, (3, 3), m2.

    The larger M is along an axis, the better the array resolves direction cosines along it.

    >>> scatter(ARRAYS["oem5"]).diagonal().round(10)
    array([0.0019847 , 0.0019847 , 0.00431945])
    """
    centred = array - array.mean(axis=0)
    metric = centred.T @ centred
    metric[np.abs(metric) < ROUNDING * metric.max()] = 0.0  # exactly 0 for a symmetric array
    return np.asarray(metric)


@compiled
def rotation(roll: float, pitch: float, yaw: float) -> Floats:
    """Return the rotation (3, 3) by three angles (rad) from array to survey frame, Rz(yaw)
    Ry(pitch) Rx(roll).
    """
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    out[1, 0], out[1, 1], out[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    out[2, 0], out[2, 1], out[2, 2] = -sp, cp * sr, cp * cr
    return out


@compiled
def arrival_differences(
    array: Floats, source: Vector, sound_speed: float, noise: Floats, sd: float
) -> Floats:
    """Return the arrival time differences (s) of all pairs of hydrophones, (i, j) with i < j.

    `source` is in the array frame (m); the wave is spherical; `noise` are standard normal numbers,
    one for each element, with the standard deviation `sd` (s).  Nothing is rounded: instruments
    measure differences by phases or between the samples of a correlation (EvoLogics' telegram
    USBLPHYD has them in ns), while a rounding error would be the same from ping to ping if nothing
    moves.
    """
    count = array.shape[0]
    pairs = count * (count - 1) // 2
    times = np.empty(pairs + count)  # one array, since an allocation takes as long as a dozen sums
    differences, arrivals = times[:pairs], times[pairs:]
    for k in range(count):
        way = length(minus(source, row_of(array, k)))
        # A row of noise begins with five elements; further ones are at its end
        drawn = noise[k] if k < ELEMENTS else noise[noise.size - 1 - k + ELEMENTS]
        arrivals[k] = way / sound_speed + sd * drawn
    pair = 0
    for i in range(count):
        for j in range(i + 1, count):
            differences[pair] = arrivals[i] - arrivals[j]
            pair += 1
    return differences


@compiled
def tangents(unit: Vector) -> tuple[Vector, Vector]:
    """Return two unit vectors that span the plane across a direction, the first one horizontal.

    For the vertical, where all are horizontal, the first is the y axis.
    """
    level, first = math.sqrt(unit[0] ** 2 + unit[1] ** 2), (0.0, 1.0, 0.0)
    if level > 1e-9:
        first = -unit[1] / level, unit[0] / level, 0.0
    return first, cross(unit, first)


@compiled
def direction(array: Floats, differences: Floats, sound_speed: float, metric: Floats) -> Vector:
    """Return the unit vector from the array to the source, in the array frame.

    A plane wave is fitted to the arrival time differences by least squares, s = -c M^-1 X^T t / n,
    then refined on the sphere by Gauss-Newton in the metric M (the scatter matrix),
    which makes it efficient where the array resolves some axes better than others.
    """
    count, pair = array.shape[0], 0
    plane = NOTHING
    for i in range(count):
        for j in range(i + 1, count):
            apart = minus(row_of(array, i), row_of(array, j))
            plane = minus(plane, scaled(apart, differences[pair]))
            pair += 1
    plane = plane_wave(metric, plane, sound_speed, count)
    if length(plane) < 1e-9:  # a source within the array has no direction; any will do
        return 0.0, 0.0, 1.0
    unit = divided(plane, length(plane))
    for _ in range(REFINEMENTS):
        east, down = tangents(unit)
        x, y, determinant = across_by_metric(metric, east, down, minus(plane, unit))
        unit = plus(unit, scaled(east, x / determinant))
        unit = plus(unit, scaled(down, y / determinant))
        unit = divided(unit, length(unit))
    return unit


@compiled
def plane_wave(metric: Floats, a: Vector, sound_speed: float, count: int) -> Vector:
    """Return M^-1 a c / n of a symmetric metric M (3, 3), by its adjugate; a diagonal one is
    divided axis by axis.
    """
    xx, yy, zz = metric[0, 0], metric[1, 1], metric[2, 2]
    xy, xz, yz = metric[0, 1], metric[0, 2], metric[1, 2]
    if xy == 0.0 and xz == 0.0 and yz == 0.0:
        return (
            a[0] * (sound_speed / (count * xx)),
            a[1] * (sound_speed / (count * yy)),
            a[2] * (sound_speed / (count * zz)),
        )
    first = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    second = first[1], xx * zz - xz * xz, xy * xz - xx * yz
    third = first[2], second[2], xx * yy - xy * xy
    determinant = xx * first[0] + xy * first[1] + xz * first[2]
    solved = dot(first, a), dot(second, a), dot(third, a)
    return scaled(solved, sound_speed / (count * determinant))


@compiled
def across_by_metric(
    metric: Floats, east: Vector, down: Vector, way: Vector
) -> tuple[float, float, float]:
    """Return the coefficients of two vectors that best fit a vector `way` in the metric of an
    array, both times a determinant, and that determinant.

    Source: weighted least squares, (T^T M T)^-1 T^T M w with T = (east, down).
    """
    a, d = weighted(metric, east, east), weighted(metric, down, down)
    b = weighted(metric, east, down)
    f, g = weighted(metric, east, way), weighted(metric, down, way)
    return d * f - b * g, a * g - b * f, a * d - b * b
