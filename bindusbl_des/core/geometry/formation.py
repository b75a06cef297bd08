"""The stations of ASVs: a regular polygon about the survey's middle, and the paper's bounds."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from .area import Area, vertices

# An ASV that moves by at most this share of its range keeps station.
KEPT = 0.1


def keep_station(ways: ArrayLike, reach: float) -> bool:
    """Tell whether vessels on tracks (m, k, 2), m, stay within the share KEPT of `reach` (m) of the
    start.

    >>> keep_station([[(0.0, 0.0), (3.0, 4.0)]], 60.0), keep_station([[(0.0, 0.0), (3.0, 4.0)]], 40)
    (True, False)
    """
    places = np.asarray(ways, dtype=np.float64)
    away = np.hypot(*np.moveaxis(places - places[:, :1], -1, 0))
    return bool(np.max(away, initial=0.0) <= KEPT * reach)


def formation(count: int, radius: float, angle_rad: float = 0.0) -> Floats:
    """Return the stations of the ASVs, the vertices of a regular polygon about the origin.

    Shape (count, 2), x and y in m.  ASV 0 lies at `angle_rad` from +x towards +y, the others follow
    in that sense of rotation.  A single ASV lies at the origin for any radius (m). Raises
    ValueError for less than one ASV, or a radius that is negative or not finite. Source: eq.
    formation.

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
    """Return the radius (m) of a regular formation (m, 2), m, of two ASVs or more about any centre.

    >>> ring_radius([[300.0, 360.0], [300.0, 240.0]])
    60.0
    """
    places = np.asarray(asvs, dtype=np.float64)
    return float(np.hypot(*(places - places.mean(axis=0))[0]))


def corner_distance(survey: Area | float, asvs: ArrayLike) -> float:
    """Return the largest distance (m) from an open corner of the survey to its nearest ASV.

    The paper takes one corner of the square and does not say which.  The result does not bound the
    distance from the rest of the survey: see :func:`.coverage.covering_radius`.  `survey` is an
    area, or the side (m) of a square about the origin; `asvs` has shape (n, 2), m. Raises
    ValueError as :func:`stations` does.  Source: eq. corner_dist.

    >>> round(corner_distance(60.0, formation(2, 50.0)), 3)
    36.056
    """
    if isinstance(survey, Area):
        corners = np.array(survey.open_corners)
    else:
        _check_length("side", survey)
        corners = survey / 2.0 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return float(distances(corners, stations(asvs)).min(axis=1).max())


def formation_radius_bound(side: float, hf_range: float) -> float:
    """Return the smallest formation radius (m) for which the paper promises coverage.

    L/2 - sqrt(R^2 - (L/2)^2): from this radius on, an ASV on the +x axis reaches the two nearest
    corners.  The bound guarantees no coverage (L = 60 m, R = 50 m: two ASVs 50 m out leave 10.6 %
    uncovered), and there is no upper bound beside it.  A negative value allows any radius. Raises
    ValueError where R < L/2, and for lengths that are negative or not finite. Source: eq. coverage.

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
    """Return positions of ASVs as a float array (n, 2), m.

    Raises ValueError if there is none, if a row has not two numbers, or if a number is not finite.

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
    """Return the distances (..., n), m, between points (..., 2) and places (n, 2)."""
    offsets = points[..., None, :] - places
    return np.hypot(offsets[..., 0], offsets[..., 1])


def _check_length(name: str, value: float) -> None:
    if not 0.0 <= value < math.inf:
        raise ValueError(
            f"{name} must be a finite number not below 0; met {value}; give it in metres"
        )
