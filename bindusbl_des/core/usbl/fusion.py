"""Fusion of several fixes of one ping: the minimum-variance linear unbiased estimate (MVLUE)."""

from collections.abc import Sequence
from math import copysign, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...support.compiled import compiled

Vector = NDArray[np.float64]

# Directions whose variance is below this share of the largest count as exact.
SINGULAR = 1e-13

# Jacobi's method squares the off-diagonal elements in each sweep; 3 x 3 needs four or five.
MOST_SWEEPS = 30


def fuse(fixes: Sequence[Vector], covariances: Sequence[Vector]) -> tuple[Vector, Vector]:
    """Fuse independent fixes of the same ping; return the estimate (n,) and covariance (n, n).

    The additive form z + A (A + B)^+ (z' - z) is the inverse-covariance average where covariances
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
    """Fuse an estimate (n,) and an independent `fix` (n,), covariances (n, n), as :func:`fuse`."""
    size, total = estimate.size, covariance.copy()
    for i in range(size):
        for j in range(size):
            total[i, j] += other[i, j]
    gain = product(covariance, _pseudo_inverse(total))
    left, spread = product(gain, covariance), total
    fused = estimate.copy()
    for i in range(size):
        for j in range(size):
            fused[i] += gain[i, j] * (fix[j] - estimate[j])
            spread[i, j] = (covariance[i, j] - left[i, j] + covariance[j, i] - left[j, i]) / 2
    return fused, spread


class Fused(NamedTuple):
    """A fused estimate (n,), its covariance (n, n), the `gain` (n, 3) of the last fix, and the NIS
    of that (3 degrees of freedom).
    """

    estimate: Vector
    covariance: Vector
    gain: Vector
    square: float


@compiled
def fuse_shared(
    estimate: Vector, covariance: Vector, fix: Vector, other: Vector, jacobian: Vector
) -> Fused:
    """Fuse a fix into an estimate with which it has errors in common.

    `estimate` (n,) and `covariance` (n, n) are a position (m) and n - 3 unknowns beside it; `fix`
    (3,) is that position plus `jacobian` (3, n - 3) times those unknowns, with covariance `other`
    (3, 3).  Source: Kalman update, z = p + J u + noise.
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
    inverse = _pseudo_inverse(spread)
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
def _pseudo_inverse(matrix: Vector) -> Vector:
    """Return the pseudo-inverse of a symmetric positive semidefinite matrix (n, n).

    By its eigenvalues, with Jacobi's rotations.  Source: G. H. Golub, C. F. Van Loan, Matrix
    Computations, 4th ed., section 8.5 (cyclic Jacobi).
    """
    size = len(matrix)
    values, vectors = matrix.copy(), np.zeros((size, size))
    for k in range(size):
        vectors[k, k] = 1.0
    for _ in range(MOST_SWEEPS):
        turned = False
        for p in range(size - 1):
            for q in range(p + 1, size):
                beside = values[p, q]
                if abs(beside) <= 1e-17 * sqrt(abs(values[p, p] * values[q, q])):
                    continue
                turned = True
                slope = (values[q, q] - values[p, p]) / (2.0 * beside)
                tangent = copysign(1.0, slope) / (abs(slope) + sqrt(1.0 + slope * slope))
                cosine = 1.0 / sqrt(1.0 + tangent * tangent)
                sine = tangent * cosine
                for k in range(size):
                    first, second = values[k, p], values[k, q]
                    values[k, p] = cosine * first - sine * second
                    values[k, q] = sine * first + cosine * second
                for k in range(size):
                    first, second = values[p, k], values[q, k]
                    values[p, k] = cosine * first - sine * second
                    values[q, k] = sine * first + cosine * second
                    first, second = vectors[k, p], vectors[k, q]
                    vectors[k, p] = cosine * first - sine * second
                    vectors[k, q] = sine * first + cosine * second
                values[p, q] = values[q, p] = 0.0
        if not turned:
            break
    largest = 0.0
    for k in range(size):
        largest = max(largest, values[k, k])
    inverse = np.zeros((size, size))
    for k in range(size):
        if values[k, k] > SINGULAR * largest:
            for i in range(size):
                for j in range(size):
                    inverse[i, j] += vectors[i, k] * vectors[j, k] / values[k, k]
    return inverse
