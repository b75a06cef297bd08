"""Several fixes of one ping, made one: the minimum-variance linear unbiased estimate (MVLUE)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

# Directions whose variance is below this share of the largest are taken as known exactly.
SINGULAR = 1e-13


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
    estimate, covariance = fixes[0], covariances[0]
    for fix, other in zip(fixes[1:], covariances[1:], strict=True):
        gain = covariance @ _pseudo_inverse(covariance + other)
        estimate = estimate + gain @ (fix - estimate)
        covariance = covariance - gain @ covariance
        covariance = (covariance + covariance.T) / 2
    return estimate, covariance


def _pseudo_inverse(matrix: Vector) -> Vector:
    values, vectors = np.linalg.eigh(matrix)
    kept = values > SINGULAR * max(values[-1], 0.0)
    inverse = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    return np.asarray((vectors * inverse) @ vectors.T)
