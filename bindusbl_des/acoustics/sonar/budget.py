"""The sonar equation: SNR = SL - TL - NL - 10 lg B + DI, over slant range."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...scenario.channel_settings import Sonar, Sound
from ...sea.absorption import absorption, absorption_ainslie_mccolm, absorption_thorp
from ...sea.water import USUAL_WATER, Water
from .ambient import ambient_noise_db, power_sum_db

Floats = NDArray[np.float64]

# Levels of sources are those at 1 m: nobody is heard from nearer than that.
REFERENCE_M = 1.0

# How sound spreads where a table says what bent rays lose beside that.
SPHERICAL = 2.0


def absorption_of(sonar: Sound, water: Water) -> float:
    """Return what water takes of a sonar's sound (dB/km) by the law chosen."""
    if sonar.absorption == "thorp":
        return absorption_thorp(sonar.frequency_khz)
    law = absorption if sonar.absorption == "francois_garrison" else absorption_ainslie_mccolm
    return law(sonar.frequency_khz, *water, sonar.ph)


def transmission_loss_db(
    range_m: ArrayLike, absorption_db_per_km: float, spreading: float = 2.0
) -> Floats:
    """Return what spreading and absorption take of a sound over slant ranges (m), in dB.

    10 k lg r + alpha r / 1000; nearer than 1 m counts as 1 m.

    >>> round(float(transmission_loss_db(1000.0, 5.013752592869311)), 6)
    65.013753
    """
    reach = np.maximum(np.asarray(range_m, dtype=float), REFERENCE_M)
    loss: Floats = 10.0 * spreading * np.log10(reach) + absorption_db_per_km * reach / 1e3
    return loss


@dataclass(frozen=True)
class LinkBudget:
    """A sonar in a water: what is the same for all its signals.

    Source level (dB re 1 uPa at 1 m), spreading, absorption (dB/km), and the noise in the band
    (dB re 1 uPa) that is left of what the receiver's directivity keeps out.
    """

    source_level_db: float
    spreading: float
    absorption_db_per_km: float
    noise_db: float

    def level_db(self, range_m: ArrayLike) -> Floats:
        """Return how loud signals arrive over slant ranges (m), in dB re 1 uPa: SL - TL."""
        loss = transmission_loss_db(range_m, self.absorption_db_per_km, self.spreading)
        return self.source_level_db - loss

    def snr_db(self, range_m: ArrayLike) -> Floats:
        """Return the signal-to-noise ratio over slant ranges (m), in dB."""
        return np.asarray(self.level_db(range_m) - self.noise_db)


def link_budget(sonar: Sound, water: Water = USUAL_WATER) -> LinkBudget:
    """Return the link budget of a sonar in a water.

    >>> round(float(link_budget(Sonar()).snr_db(1000.0)), 6)
    36.43817
    """
    density = ambient_noise_db(sonar.frequency_khz, sonar.shipping, sonar.wind_m_per_s)
    if sonar.own_noise_db is not None:
        density = power_sum_db(density, sonar.own_noise_db)
    band = 10.0 * np.log10(sonar.bandwidth_khz * 1e3)
    return LinkBudget(
        sonar.source_level_db,
        sonar.spreading if isinstance(sonar, Sonar) else SPHERICAL,
        absorption_of(sonar, water),
        float(density + band) - sonar.directivity_index_db,
    )
