"""The speed of sound by the standard equation of sea water, from the package gsw."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .water import check_water

Floats = NDArray[np.float64]

MISSING = "TEOS-10 needs the package gsw: pip install 'bindusbl-des[ocean]'"


def sound_speed_teos10(
    temperature_c: ArrayLike,
    salinity_psu: ArrayLike,
    depth_m: ArrayLike,
    place_deg: tuple[float, float],
) -> Floats:
    """Return how fast sound travels in sea water (m/s), after TEOS-10.

    Temperature in degC, practical salinity, depth in m below the surface, numbers or arrays of one
    shape, at a latitude and longitude (deg): gravity makes pressure of depth, and seas' salts
    differ.  Raises ValueError for values that no water has, ImportError without gsw.
    Source: T. J. McDougall, P. M. Barker, Getting started with TEOS-10 and the GSW toolbox (2011).

    >>> round(float(sound_speed_teos10(10.0, 35.0, 10.0, (47.0, -30.0))), 3)
    1489.982
    """
    try:
        import gsw
    except ImportError:
        raise ImportError(MISSING) from None
    water = temperature_c, salinity_psu, depth_m
    warm, salt, deep = (np.asarray(it, dtype=float) for it in water)
    check_water(warm, salt, deep)
    latitude, longitude = place_deg
    pressure = gsw.p_from_z(-deep, latitude)
    absolute = gsw.SA_from_SP(salt, pressure, longitude, latitude)
    conservative = gsw.CT_from_t(absolute, warm, pressure)
    return np.asarray(gsw.sound_speed(absolute, conservative, pressure))
