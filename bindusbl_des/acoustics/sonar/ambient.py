"""The noise of the sea."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.wording import refuse

Floats = NDArray[np.float64]


def ambient_noise_db(
    frequency_khz: ArrayLike, shipping: float = 0.5, wind_m_per_s: float = 5.0
) -> Floats:
    """Return the noise of the sea (dB re 1 uPa2/Hz): turbulence, ships, wind and heat.

    Frequencies in kHz, one or an array; `shipping` from 0 (none) to 1 (heavy).  Raises ValueError
    for values that no sea has.
    Source: G. M. Wenz, J. Acoust. Soc. Am. 34, 1936 (1962), in the form of R. F. W. Coates,
    Underwater Acoustic Systems (1990).

    >>> round(float(ambient_noise_db(25.0)), 3)
    38.548
    """
    lines = np.asarray(frequency_khz, dtype=float)
    if not np.all(np.isfinite(lines) & (lines > 0.0)):
        refuse("frequency (kHz)", frequency_khz, "be positive and finite", "give kilohertz")
    if not 0.0 <= shipping <= 1.0:
        refuse("shipping", shipping, "lie in [0, 1]", "0 is none, 1 is heavy")
    if not 0.0 <= wind_m_per_s < np.inf:
        refuse("wind (m/s)", wind_m_per_s, "be finite and not below 0", "a storm has about 25")
    octaves = np.log10(lines)
    turbulence = 17.0 - 30.0 * octaves
    ships = 40.0 + 20.0 * (shipping - 0.5) + 26.0 * octaves - 60.0 * np.log10(lines + 0.03)
    waves = 50.0 + 7.5 * wind_m_per_s**0.5 + 20.0 * octaves - 40.0 * np.log10(lines + 0.4)
    heat = -15.0 + 20.0 * octaves
    return power_sum_db(turbulence, ships, waves, heat)


def power_sum_db(*levels_db: ArrayLike) -> Floats:
    """Return the level (dB) of powers together that have these levels (dB); of no power, -inf.

    >>> round(float(power_sum_db(60.0, 60.0)), 3)
    63.01
    """
    powers = sum(10.0 ** (np.asarray(level, dtype=float) / 10.0) for level in levels_db)
    with np.errstate(divide="ignore"):
        return 10.0 * np.log10(powers)
