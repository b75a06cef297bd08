"""Several fixes of one ping, made one: the minimum-variance linear unbiased estimate (MVLUE)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled

Vector = NDArray[np.float64]

# Numbers whose variance, given the others, is below this share of the largest are known exactly.
SINGULAR = 1e-13


def fuse(fixes: Sequence[Vector], covariances: Sequence[Vector]) -> tuple[Vector, Vector]:
    """Fuse independent fixes of the same ping; return the estimate (n,) and covariance (n, n).

    The additive form z + A (A + B)^- (z' - z) is the inverse-covariance average where covariances
    are regular, and stays right where they are singular (a perfect range, say).  With K equal
    covariances R the result has R / K, so every standard deviation shrinks by sqrt(K).

    >>> fixes = [np.array([1.0, 5.0]), np.array([3.0, 2.0])]
    >>> z, P = fuse(fixes, [np.diag([0.0, 1.0]), np.diag([1.0, 0.0])])
    >>> z.tolist()
    [1.0, 2.0]
    """
    if not len(fixes) or len(fixes) != len(covariances):
        raise ValueError(
            f"fusion needs one covariance per fix and at least one fix, got {len(fixes)} fixes "
            f"and {len(covariances)} covariances"
        )
    points, spreads = np.array(fixes, dtype=np.float64), np.array(covariances, dtype=np.float64)
    estimate, covariance = points[0], spreads[0]
    for fix, other in zip(points[1:], spreads[1:], strict=True):
        estimate, covariance = fuse_pair(estimate, covariance, fix, other)
    return estimate, covariance


@compiled
def fuse_pair(
    estimate: Vector, covariance: Vector, fix: Vector, other: Vector
) -> tuple[Vector, Vector]:
    """Fuse two independent estimates (n,) and their covariances (n, n); see :func:`fuse`."""
    size, total = estimate.size, covariance.copy()
    for i in range(size):
        for j in range(size):
            total[i, j] += other[i, j]
    gain = product(covariance, _inverse(total))
    left = product(gain, covariance)
    fused, spread = estimate.copy(), np.empty((size, size))
    for i in range(size):
        for j in range(size):
            fused[i] += gain[i, j] * (fix[j] - estimate[j])
            spread[i, j] = (covariance[i, j] - left[i, j] + covariance[j, i] - left[j, i]) / 2
    return fused, spread


class Fused(NamedTuple):
    """What a fix has made of an estimate: that (n,), its covariance (n, n), the `gain` (n, 3) by
    which the fix went in, and the normalised square of what it was off (3 degrees of freedom).
    """

    estimate: Vector
    covariance: Vector
    gain: Vector
    square: float


@compiled
def fuse_shared(
    estimate: Vector, covariance: Vector, fix: Vector, other: Vector, jacobian: Vector
) -> Fused:
    """Fuse a fix into an estimate whose own errors it shares.

    `estimate` (n,) and `covariance` (n, n) are those of a place (m) and of n - 3 unknowns beside
    it; `fix` (3,) with the covariance `other` (3, 3) is that place, `jacobian` (3, n - 3) times
    those unknowns off.  Source: Kalman update, z = p + J u + noise.
    """
    size = len(estimate)
    shared, spread, miss = np.empty((size, 3)), np.empty((3, 3)), np.empty(3)
    for i in range(size):
        for j in range(3):
            shared[i, j] = covariance[i, j]
            for k in range(3, size):
                shared[i, j] += covariance[i, k] * jacobian[j, k - 3]
    for i in range(3):
        miss[i] = fix[i] - estimate[i]
        for k in range(3, size):
            miss[i] -= jacobian[i, k - 3] * estimate[k]
        for j in range(3):
            spread[i, j] = shared[i, j]
            for k in range(3, size):
                spread[i, j] += jacobian[i, k - 3] * shared[k, j]
            spread[i, j] += other[i, j]
    inverse = _inverse(spread)
    gain, square = np.zeros((size, 3)), 0.0
    for i in range(size):
        for j in range(3):
            for k in range(3):
                gain[i, j] += shared[i, k] * inverse[k, j]
    for i in range(3):
        for j in range(3):
            square += miss[i] * inverse[i, j] * miss[j]
    fused, left = estimate.copy(), covariance.copy()
    for i in range(size):
        for j in range(3):
            fused[i] += gain[i, j] * miss[j]
            for k in range(size):
                left[i, k] -= (gain[i, j] * shared[k, j] + gain[k, j] * shared[i, j]) / 2
    return Fused(fused, left, gain, square)


@compiled
def product(a: Vector, b: Vector) -> Vector:
    """Return the product of two small square matrices (numba's own needs scipy)."""
    size = len(a)
    product = np.zeros((size, size))
    for i in range(size):
        for j in range(size):
            for k in range(size):
                product[i, j] += a[i, k] * b[k, j]
    return product


@compiled
def _inverse(matrix: Vector) -> Vector:
    """Return the inverse of a symmetric positive semidefinite matrix (n, n); where it is singular,
    a generalised one, G of M G M = M, as good as any for what M can explain.

    Source: the sweep operator, largest pivot first; J. H. Goodnight, "A tutorial on the SWEEP
    operator", The American Statistician 33(3), 1979.
    """
    size, out = len(matrix), matrix.copy()
    waiting, least = np.ones(size, dtype=np.bool_), 0.0
    for k in range(size):
        least = max(least, SINGULAR * matrix[k, k])
    for _ in range(size):
        pivot, largest = -1, least
        for k in range(size):
            if waiting[k] and out[k, k] > largest:
                pivot, largest = k, out[k, k]
        if pivot < 0:
            break
        waiting[pivot] = False
        for i in range(size):
            for j in range(size):
                if i != pivot and j != pivot:
                    out[i, j] -= out[i, pivot] * out[pivot, j] / largest
        for k in range(size):
            out[k, pivot] = out[pivot, k] = out[pivot, k] / largest
        out[pivot, pivot] = -1.0 / largest
    for i in range(size):
        for j in range(size):
            out[i, j] = 0.0 if waiting[i] or waiting[j] else -out[i, j]
    return out
