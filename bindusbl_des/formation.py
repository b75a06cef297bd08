"""Where the surface vessels are moored: a regular N-gon, and what the paper says it covers."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def formation_radius(hf_range: float, clearance: float = 0.0) -> float:
    """Return the formation radius R_f = R_HF + clearance (m) (eq. formation).

    >>> formation_radius(50.0)
    50.0
    """
    return hf_range + clearance


def formation(count: int, radius: float, angle: float = 0.0) -> Array:
    """Return the vertices of the regular N-gon, shape (count, 2), m (eq. formation).

    ASV0 stands at `angle` (rad) from +x towards +y; a single ASV stands at the origin.

    >>> formation(2, 50.0).round(9).tolist()
    [[50.0, 0.0], [-50.0, 0.0]]

    Raises:
        ValueError: when `count` is below one or the radius is negative or not finite.
    """
    if count < 1:
        raise ValueError(f"a formation needs at least one ASV, got {count}")
    if not (math.isfinite(radius) and radius >= 0):
        raise ValueError(f"a formation radius is finite and not negative, got {radius} m")
    if count == 1:
        return np.zeros((1, 2))
    turns = angle + 2 * np.pi * np.arange(count) / count
    return radius * np.column_stack((np.cos(turns), np.sin(turns)))


def corner_distance(side: float, asvs: Array) -> float:
    """Return the distance (m) from the worst corner of the survey to its nearest ASV.

    The paper's d_corner (eq. corner_dist) leaves open which corner it means; this is the largest.
    It is no bound on the distance of all points of the survey: see `coverage.covering_radius`.

    >>> round(corner_distance(140, formation(1, 0)), 4)
    98.9949
    """
    corners = side / 2 * np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    distances = np.linalg.norm(corners[:, None] - np.asarray(asvs)[None], axis=2)
    return float(distances.min(axis=1).max())


def formation_radius_bound(side: float, hf_range: float) -> float:
    """Return the least formation radius (m) that the paper asks for (eq. coverage).

    It is neither sufficient (L = 60 m, R = 50 m, two ASVs at R_f = 50 m cover 89.4 %) nor is there
    an upper bound beside it (docs/errata.md).

    >>> formation_radius_bound(60, 50)
    -10.0

    Raises:
        ValueError: when the HF range is below half the side, where the bound is undefined.
    """
    if hf_range < side / 2:
        raise ValueError(
            f"the paper's bound is defined for an HF range of at least half the side, "
            f"{side / 2:g} m, got {hf_range:g} m"
        )
    return side / 2 - math.sqrt(hf_range**2 - (side / 2) ** 2)
