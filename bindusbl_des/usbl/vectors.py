"""Vectors of three numbers, which compiled code keeps at hand: arrays would be made anew each time.

Sums run from x to z.
"""

from math import sqrt

from ..core.compiled import inlined
from ..vehicles.motion import Floats

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
    """Return a^T M b of a metric M (3, 3) that is diagonal."""
    along = metric[0, 0] * a[0] * b[0] + metric[1, 1] * a[1] * b[1]
    return float(along + metric[2, 2] * a[2] * b[2])


@inlined
def row_of(matrix: Floats, row: int) -> Vector:
    """Return a row of a matrix (n, 3)."""
    return matrix[row, 0], matrix[row, 1], matrix[row, 2]


@inlined
def turned(rotation: Floats, a: Vector) -> Vector:
    """Return R a of a rotation R (3, 3)."""
    return dot(row_of(rotation, 0), a), dot(row_of(rotation, 1), a), dot(row_of(rotation, 2), a)


@inlined
def turned_back(rotation: Floats, a: Vector) -> Vector:
    """Return R^T a of a rotation R (3, 3)."""
    x = rotation[0, 0] * a[0] + rotation[1, 0] * a[1] + rotation[2, 0] * a[2]
    y = rotation[0, 1] * a[0] + rotation[1, 1] * a[1] + rotation[2, 1] * a[2]
    z = rotation[0, 2] * a[0] + rotation[1, 2] * a[1] + rotation[2, 2] * a[2]
    return x, y, z
