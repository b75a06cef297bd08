"""What sea water takes from a sound on its way."""

import math

import numpy as np

from ..core.wording import refuse
from .water import Value, check, check_water


def absorption(
    frequency_khz: Value,
    temperature_c: float = 10.0,
    salinity_psu: float = 35.0,
    depth_m: float = 10.0,
    ph: float = 8.1,
) -> Value:
    """Return what sea water takes from a sound on its way (dB/km), after Francois and Garrison.

    Boric acid, magnesium sulphate and pure water take their share, in this order.  Frequency in
    kHz (a number or an array), temperature in degC, salinity in psu, depth in m.  Raises ValueError
    for values that no water or sound has.
    Source: R. E. Francois, G. R. Garrison, J. Acoust. Soc. Am. 72, 1879 (1982).

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
    """Return what the water itself takes of a sound, per kHz squared (dB/km/kHz2)."""
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
    """Return what sea water takes from a sound on its way (dB/km), after Ainslie and McColm.

    Arguments and errors as in :func:`absorption`, which it simplifies: within 10 % of it for
    -6-35 degC, 5-50 psu, 0-7000 m, pH 7.7-8.3 and 0.1-1000 kHz, say its authors.
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
    """Return what sea water of about 4 degC at about 1000 m takes from a sound (dB/km).

    Frequency in kHz (a number or an array), fitted for 0.1-50 kHz.  Raises ValueError for a
    frequency that is not positive.  Source: W. H. Thorp, J. Acoust. Soc. Am. 42, 270 (1967), in
    the metric form of the textbooks.

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
