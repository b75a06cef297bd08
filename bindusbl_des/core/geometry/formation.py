"""Where the ASVs keep station: a regular polygon about the middle of the survey square."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from .area import Area, vertices

# Vessels that stray by less than this share of what they hear keep their stations.
KEPT = 0.1


def keep_station(ways: ArrayLike, reach: float) -> bool:
    """Tell whether vessels with ways (m, k, 2), in m, stay near to where they are at first.

    That is within a tenth of the `reach` (m) at which they hear.

    >>> keep_station([[(0.0, 0.0), (3.0, 4.0)]], 60.0), keep_station([[(0.0, 0.0), (3.0, 4.0)]], 40)
    (True, False)
    """
    places = np.asarray(ways, dtype=np.float64)
    away = np.hypot(*np.moveaxis(places - places[:, :1], -1, 0))
    return bool(np.max(away, initial=0.0) <= KEPT * reach)


def formation(count: int, radius: float, angle_rad: float = 0.0) -> Floats:
    """Return the stations of the ASVs, the vertices of a regular polygon about the origin.

    Shape (count, 2), x and y in m; ASV 0 lies at `angle_rad` from +x towards +y, the others follow
    in that direction of turning.  A single ASV lies at the origin whatever the radius (m).
    Raises ValueError for less than one ASV or a radius that is negative or not finite.
    Source: eq. formation.

    >>> formation(2, 50.0, 0.0).round(6).tolist()
    [[50.0, 0.0], [-50.0, 0.0]]
    """
    if count < 1:
        raise ValueError(f"a formation must have at least one ASV; met {count}; raise the count")
    _check_length("formation radius", radius)
    if not math.isfinite(angle_rad):
        raise ValueError(f"a formation angle must be finite; met {angle_rad}; give radians")
    return np.array(vertices(count, radius, angle_rad))


def ring_radius(asvs: ArrayLike) -> float:
    """Return the radius (m) of a regular formation of two ASVs or more, (m, 2), wherever it lies.

    >>> ring_radius([[300.0, 360.0], [300.0, 240.0]])
    60.0
    """
    places = np.asarray(asvs, dtype=np.float64)
    return float(np.hypot(*(places - places.mean(axis=0))[0]))


def corner_distance(survey: Area | float, asvs: ArrayLike) -> float:
    """Return how far (m) the worst corner of the survey is from its nearest ASV.

    For each corner, of a square (+-L/2, +-L/2), the distance to the nearest ASV is taken; the
    largest of them is returned.  (The paper takes one corner and does not say which.)  It does
    not bound the distance from the rest of the survey: see :func:`.coverage.covering_radius`.
    `survey` is an area, or the side of a square in m, `asvs` of shape (n, 2) in m.  Raises
    ValueError as :func:`stations` does.  Source: eq. corner_dist.

    >>> round(corner_distance(60.0, formation(2, 50.0)), 3)
    36.056
    """
    if isinstance(survey, Area):
        corners = np.array(survey.outline)
    else:
        _check_length("side", survey)
        corners = survey / 2.0 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return float(distances(corners, stations(asvs)).min(axis=1).max())


def formation_radius_bound(side: float, hf_range: float) -> float:
    """Return the smallest formation radius (m) for which the paper promises coverage.

    L/2 - sqrt(R^2 - (L/2)^2): from there on an ASV on the +x axis reaches the two corners next to
    it.  Neither does that cover the square (L = 60 m, R = 50 m: two ASVs 50 m out leave 10.6 % of
    it uncovered), nor is there a bound above.  Negative values allow any radius.  Raises ValueError
    where R < L/2, and for lengths that are negative or not finite.  Source: eq. coverage.

    >>> formation_radius_bound(60.0, 50.0)
    -10.0
    """
    _check_length("side", side)
    _check_length("HF range", hf_range)
    half = side / 2.0
    if hf_range < half:
        raise ValueError(
            f"the paper's bound needs an HF range of at least half the side; met {hf_range} m for "
            f"a side of {side} m: no ASV on an axis reaches two corners; raise the range to "
            f"{half} m or use coverage.covering_radius, which holds for any formation"
        )
    return half - math.sqrt((hf_range - half) * (hf_range + half))


def stations(asvs: ArrayLike) -> Floats:
    """Return positions of ASVs as an array of shape (n, 2), in m.

    Raises ValueError if there is none, if a row has not two numbers or if one is not finite.

    >>> stations([(0, 1), (2, 3)]).shape
    (2, 2)
    """
    array = np.asarray(asvs, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 2 or not len(array):
        raise ValueError(
            f"ASV positions must have the shape (n, 2) with n >= 1; met {array.shape}; "
            "give one row of x and y (m) for each ASV"
        )
    if not np.isfinite(array).all():
        raise ValueError(f"ASV positions must be finite; met {array.tolist()}; give metres")
    return array


def distances(points: Floats, places: Floats) -> Floats:
    """Return the distance (m) from each point (..., 2) to each place (n, 2), shape (..., n)."""
    offsets = points[..., None, :] - places
    return np.hypot(offsets[..., 0], offsets[..., 1])


def _check_length(name: str, value: float) -> None:
    if not 0.0 <= value < math.inf:
        raise ValueError(
            f"{name} must be a finite number not below 0; met {value}; give it in metres"
        )
