"""Sea water: how fast sound travels in it."""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..core.wording import refuse

Floats = NDArray[np.float64]
Value = TypeVar("Value", float, Floats)

# Sea water of 40 psu at 8000 m freezes near -8.4 degC (UNESCO 44); anything colder is a mistake.
COLDEST_C = -10.0


class Water(NamedTuple):
    """The water that a sound is in: temperature (degC), salinity (psu) and depth (m)."""

    temperature_c: float = 10.0
    salinity_psu: float = 35.0
    depth_m: float = 10.0


# That of a sea of which nothing is known
USUAL_WATER = Water()


def sound_speed(temperature_c: Value, salinity_psu: Value | float, depth_m: Value | float) -> Value:
    """Return how fast sound travels in sea water (m/s), after Mackenzie (1981).

    Temperature in degC, salinity in psu, depth in m below the surface; temperature may be an array
    (a profile), the others then arrays of the same shape.  Fitted for 2-30 degC, 25-40 psu and
    0-8000 m with a standard error of 0.07 m/s; outside that it extrapolates.  Raises ValueError for
    values that no water has.  Source: K. V. Mackenzie, J. Acoust. Soc. Am. 70, 807 (1981).

    >>> round(sound_speed(25.0, 35.0, 1000.0), 3)
    1550.744
    """
    check_water(temperature_c, salinity_psu, depth_m)
    warm, salt = temperature_c, salinity_psu - 35.0
    surface = 1448.96 + warm * (4.591 + warm * (-5.304e-2 + 2.374e-4 * warm)) + 1.340 * salt
    deep = depth_m * (1.630e-2 + 1.675e-7 * depth_m) - 7.139e-13 * warm * depth_m**3
    return surface - 1.025e-2 * warm * salt + deep


def sound_speed_medwin(
    temperature_c: Value, salinity_psu: Value | float, depth_m: Value | float
) -> Value:
    """Return how fast sound travels in shallow sea or lake water (m/s), after Medwin (1975).

    Arguments and errors as in :func:`sound_speed`; fitted for 0-35 degC, 0-45 psu, 0-1000 m.
    Source: H. Medwin, J. Acoust. Soc. Am. 58, 1318 (1975).

    >>> round(sound_speed_medwin(10.0, 35.0, 10.0), 3)
    1490.15
    """
    check_water(temperature_c, salinity_psu, depth_m)
    warm, salt = temperature_c, salinity_psu - 35.0
    surface = 1449.2 + warm * (4.6 + warm * (-0.055 + 0.00029 * warm))
    return surface + (1.34 - 0.010 * warm) * salt + 0.016 * depth_m


def check_water(temperature_c: Value, salinity_psu: Value | float, depth_m: Value | float) -> None:
    """Raise ValueError for a temperature, salinity or depth that no water has."""
    check("temperature (degC)", temperature_c, COLDEST_C, "give degrees Celsius")
    check("salinity (psu)", salinity_psu, 0.0, "fresh water has 0, the ocean about 35")
    check("depth (m)", depth_m, 0.0, "count metres downwards from the surface")


def check(name: str, value: Value | float, lowest: float, remedy: str) -> None:
    """Raise ValueError for a value that is not finite or below the lowest."""
    if not np.all(np.isfinite(value) & (np.asarray(value) >= lowest)):
        refuse(name, value, f"be a finite number not below {lowest:g}", remedy)
