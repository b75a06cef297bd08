"""Sea water: speed and absorption of sound."""

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from ...support.wording import refuse

# Sea water: how fast sound travels in it.


Value = TypeVar("Value", float, Floats)

# Sea water of 40 psu at 8000 m freezes near -8.4 degC (UNESCO 44); anything colder is a mistake.
COLDEST_C = -10.0


class Water(NamedTuple):
    """The water that a sound is in: temperature (degC), salinity (psu) and depth (m)."""

    temperature_c: float = 10.0
    salinity_psu: float = 35.0
    depth_m: float = 10.0


# The water of a sea of which nothing is known
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


# The speed of sound by the standard equation of sea water, from the package gsw.


MISSING = "TEOS-10 needs the package gsw: pip install 'bindusbl-des[ocean]'"

# TEOS-10's atlas of salts ends there.
SOUTHERNMOST_DEG = -86.0


def sound_speed_teos10(
    temperature_c: ArrayLike,
    salinity_psu: ArrayLike,
    depth_m: ArrayLike,
    place_deg: tuple[float, float],
) -> Floats:
    """Return how fast sound travels in sea water (m/s), after TEOS-10.

    Temperature in degC, practical salinity, depth in m below the surface, numbers or arrays of one
    shape, at a latitude and longitude (deg): gravity makes pressure of depth, and seas' salts
    differ.  Raises ValueError for values and places that no water has, ImportError without gsw.
    Source: T. J. McDougall, P. M. Barker, Getting started with TEOS-10 and the GSW toolbox (2011).

    >>> round(float(sound_speed_teos10(10.0, 35.0, 10.0, (47.0, -30.0))), 3)
    1489.982
    """
    try:
        import gsw
    except ImportError:
        raise ImportError(MISSING) from None
    water = temperature_c, salinity_psu, depth_m
    warm, salt, deep = (np.asarray(value, dtype=float) for value in water)
    check_water(warm, salt, deep)
    latitude, longitude = place_deg
    check("latitude (deg)", latitude, SOUTHERNMOST_DEG, "TEOS-10 knows no water farther south")
    pressure = gsw.p_from_z(-deep, latitude)
    absolute = gsw.SA_from_SP(salt, pressure, longitude, latitude)
    conservative = gsw.CT_from_t(absolute, warm, pressure)
    return np.asarray(gsw.sound_speed(absolute, conservative, pressure))


# Absorption of sound by sea water.


def absorption(
    frequency_khz: Value,
    temperature_c: float = 10.0,
    salinity_psu: float = 35.0,
    depth_m: float = 10.0,
    ph: float = 8.1,
) -> Value:
    """Return the absorption of sound by sea water (dB/km), after Francois and Garrison.

    Boric acid, magnesium sulphate and pure water add up.  Frequency in kHz (a number or an array),
    temperature in degC, salinity in psu, depth in m.  Raises ValueError for values that no water or
    sound has. Source: R. E. Francois, G. R. Garrison, J. Acoust. Soc. Am. 72, 1879 (1982).

    >>> round(absorption(25.0), 4)
    5.0138
    """
    check_water(temperature_c, salinity_psu, depth_m)
    check("pH", ph, 0.0, "give a value between 0 and 14")
    _check_frequency(frequency_khz)
    warm, square = temperature_c, frequency_khz**2
    speed = 1412.0 + 3.21 * warm + 1.19 * salinity_psu + 0.0167 * depth_m
    boric: float = 8.86 / speed * 10.0 ** (0.78 * ph - 5.0)
    boric_khz: float = (
        2.8 * math.sqrt(salinity_psu / 35.0) * 10.0 ** (4.0 - 1245.0 / (warm + 273.0))
    )
    magnesium = 21.44 * salinity_psu / speed * (1.0 + 0.025 * warm)
    magnesium *= 1.0 - 1.37e-4 * depth_m + 6.2e-9 * depth_m**2
    magnesium_khz: float = 8.17 * 10.0 ** (8.0 - 1990.0 / (warm + 273.0))
    magnesium_khz /= 1.0 + 0.0018 * (salinity_psu - 35.0)
    share = boric * boric_khz / (boric_khz**2 + square)
    share = share + magnesium * magnesium_khz / (magnesium_khz**2 + square)
    return (share + _pure_water(warm, depth_m)) * square


def _pure_water(temperature_c: float, depth_m: float) -> float:
    """Return the absorption of sound by pure water, per kHz squared (dB/km/kHz2)."""
    warm = temperature_c
    if warm <= 20.0:
        water = 4.937e-4 + warm * (-2.59e-5 + warm * (9.11e-7 - 1.50e-8 * warm))
    else:
        water = 3.964e-4 + warm * (-1.146e-5 + warm * (1.45e-7 - 6.5e-10 * warm))
    return water * (1.0 - 3.83e-5 * depth_m + 4.9e-10 * depth_m**2)


def absorption_ainslie_mccolm(
    frequency_khz: Value,
    temperature_c: float = 10.0,
    salinity_psu: float = 35.0,
    depth_m: float = 10.0,
    ph: float = 8.1,
) -> Value:
    """Return the absorption of sound by sea water (dB/km), after Ainslie and McColm.

    Arguments and errors as in :func:`absorption`, which it simplifies: within 10 % of it for -6-35
    degC, 5-50 psu, 0-7000 m, pH 7.7-8.3 and 0.1-1000 kHz, each varied alone, say its authors.
    Source: M. A. Ainslie, J. G. McColm, J. Acoust. Soc. Am. 103, 1671 (1998).

    >>> round(absorption_ainslie_mccolm(25.0), 4)
    5.1229
    """
    check_water(temperature_c, salinity_psu, depth_m)
    check("pH", ph, 0.0, "give a value between 0 and 14")
    _check_frequency(frequency_khz)
    warm, salt, deep, square = temperature_c, salinity_psu / 35.0, depth_m / 1e3, frequency_khz**2
    boric_khz = 0.78 * math.sqrt(salt) * math.exp(warm / 26.0)
    magnesium_khz = 42.0 * math.exp(warm / 17.0)
    share = 0.106 * math.exp((ph - 8.0) / 0.56) * boric_khz / (boric_khz**2 + square)
    magnesium = 0.52 * (1.0 + warm / 43.0) * salt * math.exp(-deep / 6.0)
    share = share + magnesium * magnesium_khz / (magnesium_khz**2 + square)
    return (share + 0.00049 * math.exp(-(warm / 27.0 + deep / 17.0))) * square


def absorption_thorp(frequency_khz: Value) -> Value:
    """Return the absorption of sound (dB/km) by sea water of about 4 degC at about 1000 m.

    Frequency in kHz (a number or an array), fitted for 0.1-50 kHz.  Raises ValueError for a
    frequency that is not positive.  Source: W. H. Thorp, J. Acoust. Soc. Am. 42, 270 (1967), in the
    metric form of the textbooks.

    >>> round(absorption_thorp(25.0), 4)
    6.1048
    """
    _check_frequency(frequency_khz)
    square = frequency_khz**2
    share = 0.11 / (1.0 + square) + 44.0 / (4100.0 + square) + 2.75e-4
    return share * square + 0.003


def _check_frequency(frequency_khz: Value) -> None:
    if not np.all(np.isfinite(frequency_khz) & (np.asarray(frequency_khz) > 0.0)):
        refuse("frequency (kHz)", frequency_khz, "be positive and finite", "give kilohertz")
