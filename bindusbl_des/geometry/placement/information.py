"""What ranges and bearings of several vessels tell of a place: Fisher information.

A vessel at a distance r measures a place with errors along the line of sight and across it, say
sd_r and r sd_theta; what several tell adds up (physics of the USBL fix, 3.1):
J = sum of (e e^T / sd_r^2 + t t^T / (r sd_theta)^2), e towards the place and t across.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def information(
    places: ArrayLike, vessels: ArrayLike, along_m2: ArrayLike, across_m2: ArrayLike
) -> Floats:
    """Return the information (..., 2, 2), m^-2, that vessels (m, 2) give of places (..., 2), in m.

    Each measures a place with positive variances along the line of sight and across it, (..., m),
    m2; what it does not measure has infinite ones.  Who is at the very place sees it along x.
    """
    apart = np.asarray(places, dtype=np.float64)[..., None, :] - np.asarray(vessels)
    bearing = np.arctan2(apart[..., 1], apart[..., 0])
    cosine, sine = np.cos(bearing), np.sin(bearing)
    along, across = 1.0 / np.asarray(along_m2), 1.0 / np.asarray(across_m2)
    xx = (along * cosine**2 + across * sine**2).sum(axis=-1)
    yy = (along * sine**2 + across * cosine**2).sum(axis=-1)
    xy = ((along - across) * cosine * sine).sum(axis=-1)
    rows = np.stack((xx, xy), axis=-1), np.stack((xy, yy), axis=-1)
    found: Floats = np.stack(rows, axis=-2)
    return found


def trace_of_inverse(information: Floats) -> Floats:
    """Return tr J^-1 (...), m2, the squared error of the best estimate (A-optimality).

    Infinite where an axis is not told of at all.
    """
    determinant = det(information)
    with np.errstate(divide="ignore", invalid="ignore"):
        trace = (information[..., 0, 0] + information[..., 1, 1]) / determinant
    return np.where(determinant > 0.0, trace, np.inf)


def det(information: Floats) -> Floats:
    """Return det J (...), m^-4: the larger, the smaller the ellipse of errors (D-optimality)."""
    xx, yy, xy = information[..., 0, 0], information[..., 1, 1], information[..., 0, 1]
    return np.asarray(xx * yy - xy * xy)
