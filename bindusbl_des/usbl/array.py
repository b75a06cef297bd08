"""Where a ping comes from: the direction that a small array of hydrophones makes out.

Frames: the survey frame has x north, y east and z down; the array frame has x
forward, y to starboard and z down, so a target below the array has a positive z.  Angles are in
radians: azimuth from x towards y, elevation positive downwards.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled

Vector = NDArray[np.float64]

# Hydrophone positions in the array frame (m).
ARRAYS: dict[str, Vector] = {
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

# Gauss-Newton steps on the sphere; the second changes the direction by less than 1e-6 rad
REFINEMENTS = 2


def scatter(array: Vector) -> Vector:
    """Return the scatter matrix M = sum (p - mean)(p - mean)^T of an array, (3, 3), m2.

    The larger M is along an axis, the better the array resolves direction cosines along it.

    >>> scatter(ARRAYS["oem5"]).diagonal().round(10)
    array([0.0019847 , 0.0019847 , 0.00431945])
    """
    centred = array - array.mean(axis=0)
    return np.asarray(centred.T @ centred)


@compiled
def rotation(roll: float, pitch: float, yaw: float) -> Vector:
    """Return the rotation R = Rz(yaw) Ry(pitch) Rx(roll) from the array to the survey frame."""
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
    array: Vector, source: Vector, sound_speed: float, noise: Vector, quantum: float
) -> Vector:
    """Return the arrival time differences (s) of all pairs of hydrophones, (i, j) with i < j.

    `source` is in the array frame (m); the wave is spherical; `noise` (s) is that of each element;
    differences are rounded to the `quantum` (s) of the sampling unless it is zero.
    """
    count = array.shape[0]
    arrivals = np.empty(count)
    for k in range(count):
        x, y, z = source[0] - array[k, 0], source[1] - array[k, 1], source[2] - array[k, 2]
        arrivals[k] = math.sqrt(x * x + y * y + z * z) / sound_speed + noise[k]
    differences = np.empty(count * (count - 1) // 2)
    pair = 0
    for i in range(count):
        for j in range(i + 1, count):
            differences[pair] = arrivals[i] - arrivals[j]
            if quantum > 0.0:
                differences[pair] = round(differences[pair] / quantum) * quantum
            pair += 1
    return differences


@compiled
def tangents(unit: Vector) -> tuple[Vector, Vector]:
    """Return two unit vectors that span the plane across a direction, the first one level.

    Straight above or below, where every vector across is level, the first is the y axis.
    """
    level = math.sqrt(unit[0] ** 2 + unit[1] ** 2)
    if level > 1e-9:
        first = np.array((-unit[1] / level, unit[0] / level, 0.0))
    else:
        first = np.array((0.0, 1.0, 0.0))
    second = np.empty(3)
    second[0] = unit[1] * first[2] - unit[2] * first[1]
    second[1] = unit[2] * first[0] - unit[0] * first[2]
    second[2] = unit[0] * first[1] - unit[1] * first[0]
    return first, second


@compiled
def direction(array: Vector, differences: Vector, sound_speed: float, metric: Vector) -> Vector:
    """Return the unit vector from the array to the source, in the array frame.

    A plane wave is fitted to the arrival time differences by least squares, s = -c M^-1 X^T t / n,
    then refined on the sphere by Gauss-Newton in the metric M (the scatter matrix, diagonal here),
    which makes it efficient where the array resolves some axes better than others.
    """
    count = array.shape[0]
    plane = np.zeros(3)
    pair = 0
    for i in range(count):
        for j in range(i + 1, count):
            for axis in range(3):
                plane[axis] -= (array[i, axis] - array[j, axis]) * differences[pair]
            pair += 1
    for axis in range(3):
        plane[axis] *= sound_speed / (count * metric[axis, axis])
    length = math.sqrt(plane[0] ** 2 + plane[1] ** 2 + plane[2] ** 2)
    if length < 1e-9:  # a source within the array has no direction; any will do
        return np.array((0.0, 0.0, 1.0))
    unit = plane / length
    for _ in range(REFINEMENTS):
        east, down = tangents(unit)
        a = b = d = f = g = 0.0
        for axis in range(3):
            weight, miss = metric[axis, axis], plane[axis] - unit[axis]
            a += weight * east[axis] * east[axis]
            b += weight * east[axis] * down[axis]
            d += weight * down[axis] * down[axis]
            f += weight * east[axis] * miss
            g += weight * down[axis] * miss
        determinant = a * d - b * b
        along_east, along_down = (d * f - b * g) / determinant, (a * g - b * f) / determinant
        for axis in range(3):
            unit[axis] = unit[axis] + along_east * east[axis] + along_down * down[axis]
        length = math.sqrt(unit[0] ** 2 + unit[1] ** 2 + unit[2] ** 2)
        for axis in range(3):
            unit[axis] /= length
    return unit
