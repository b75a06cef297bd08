"""The sonar equation: SNR = SL - TL - NL - 10 lg B + DI, over slant range; the noise of the sea;
and the probability that a signal of some SNR is detected or decoded, and how exactly it is timed.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from ...support.wording import refuse
from ..sea.water import USUAL_WATER, Water, absorption, absorption_ainslie_mccolm, absorption_thorp
from .sound_settings import Sonar, Sound


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
    """Return the level (dB) of the sum of powers with these levels (dB); of no power, -inf.

    >>> round(float(power_sum_db(60.0, 60.0)), 3)
    63.01
    """
    powers = sum(10.0 ** (np.asarray(level, dtype=float) / 10.0) for level in levels_db)
    with np.errstate(divide="ignore"):
        return 10.0 * np.log10(powers)


def detected(energy: ArrayLike, false_alarm: float, detector: str = "non_coherent") -> Floats:
    """Return the probability of detection for E/N0 (a ratio, not in dB) of a pulse.

    `non_coherent`: envelope of a matched filter, Q1(sqrt(2 E/N0), sqrt(-2 ln Pfa)).  `coherent`:
    with known phase, Q(Q^-1(Pfa) - sqrt(2 E/N0)).  `rayleigh`: the envelope where E is the mean of
    a fading channel, Pfa^(1 / (1 + E/N0)).  Raises KeyError for another detector, ValueError for a
    false-alarm probability outside (0, 1).  Source: H. L. Van Trees, Detection, Estimation, and
    Modulation Theory (1968), part I, 2.6, 4.4.

    >>> [round(float(detected(10.0, 1e-4, detector)), 4) for detector in DETECTORS]
    [0.6161, 0.7743, 0.4329]
    """
    if not 0.0 < false_alarm < 1.0:
        raise ValueError(f"false-alarm probability must lie in (0, 1); met {false_alarm}")
    return DETECTORS[detector](np.asarray(energy, dtype=float), false_alarm)


def _non_coherent(energy: Floats, false_alarm: float) -> Floats:
    return poisson_at_least(energy, -math.log(false_alarm))


def _coherent(energy: Floats, false_alarm: float) -> Floats:
    return normal_cdf(NormalDist().inv_cdf(false_alarm) + np.sqrt(2.0 * energy))


def _rayleigh(energy: Floats, false_alarm: float) -> Floats:
    return np.asarray(false_alarm ** (1.0 / (1.0 + energy)))


DETECTORS = {"non_coherent": _non_coherent, "coherent": _coherent, "rayleigh": _rayleigh}


# Levels of sources are those at 1 m: no receiver is nearer than that.
REFERENCE_M = 1.0

# Spreading for channels whose table has the loss of bent rays beside it
SPHERICAL = 2.0


def absorption_of(sonar: Sound, water: Water) -> float:
    """Return the absorption (dB/km) of a sonar's sound in water, by its law."""
    if sonar.absorption == "thorp":
        return absorption_thorp(sonar.frequency_khz)
    law = absorption if sonar.absorption == "francois_garrison" else absorption_ainslie_mccolm
    return law(sonar.frequency_khz, *water, sonar.ph)


def transmission_loss_db(
    range_m: ArrayLike, absorption_db_per_km: float, spreading: float = 2.0
) -> Floats:
    """Return the loss (dB) by spreading and absorption over slant ranges (m).

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

    Source level (dB re 1 uPa at 1 m), spreading, absorption (dB/km), and the noise in the band (dB
    re 1 uPa) after the receiver's directivity.
    """

    source_level_db: float
    spreading: float
    absorption_db_per_km: float
    noise_db: float

    def level_db(self, range_m: ArrayLike) -> Floats:
        """Return the received level over slant ranges (m), in dB re 1 uPa: SL - TL."""
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


_erfc = np.frompyfunc(math.erfc, 1, 1)


def normal_cdf(value: ArrayLike) -> Floats:
    """Return Phi, the probability that a standard normal number is below a value.

    >>> float(normal_cdf(0.0))
    0.5
    """
    tails = _erfc(-np.asarray(value, dtype=float) / math.sqrt(2.0))
    return 0.5 * np.asarray(tails, dtype=float)


def poisson_at_least(mean: ArrayLike, other: float) -> Floats:
    """Return the probability that a Poisson number is at least an independent one of mean `other`.

    That is Marcum's Q1(sqrt(2 mean), sqrt(2 other)), within 1e-13: the joint distribution is summed
    up to the largest value that the second number ever reaches.  Source: J. I. Marcum, IRE Trans.
    Inf.  Theory 6, 59 (1960); the sum is that of the non-central chi-square distribution.

    >>> round(float(poisson_at_least(10.0, -math.log(1e-4))), 9)
    0.616135849
    """
    first = np.asarray(mean, dtype=float)
    exactly, whole = np.exp(-first), math.exp(-other)
    above = 1.0 - whole
    below = exactly * above
    for number in range(1, _most(other)):
        exactly = exactly * first / number
        whole *= other / number
        above = max(above - whole, 0.0)
        below = below + exactly * above
    return np.asarray(np.maximum(1.0 - below, 0.0))


def _most(mean: float) -> int:
    """Return a number that a Poisson number with this mean exceeds less often than 1e-16."""
    return math.ceil(mean + 10.0 * math.sqrt(mean) + 25.0)


def bit_error(energy: ArrayLike, modulation: str = "bpsk") -> Floats:
    """Return the probability that a bit is wrong, for Eb/N0 (a ratio, not in dB) of a bit.

    `bpsk` coherent, `dpsk` and `nc_fsk` (binary, orthogonal) not, in white noise.  Raises KeyError
    for another modulation.  Source: J. G. Proakis, Digital Communications (2001), 5.2.

    >>> [f"{float(bit_error(10.0, modulation)):.3g}" for modulation in ("bpsk", "dpsk", "nc_fsk")]
    ['3.87e-06', '2.27e-05', '0.00337']
    """
    return _MODULATIONS[modulation](np.asarray(energy, dtype=float))


def frame_error(energy: ArrayLike, bits: int, modulation: str = "bpsk") -> Floats:
    """Return the probability that one or more bits of a frame are wrong: 1 - (1 - BER)^n.

    For Eb/N0 (a ratio) and a number of bits, each wrong independently of the others.

    >>> round(float(frame_error(10**0.8, 192)), 6)
    0.035994
    """
    whole = np.log1p(-bit_error(energy, modulation)) * bits
    return np.asarray(-np.expm1(whole))


_MODULATIONS: Mapping[str, Callable[[Floats], Floats]] = {
    "bpsk": lambda energy: normal_cdf(-np.sqrt(2.0 * energy)),
    "dpsk": lambda energy: 0.5 * np.exp(-energy),
    "nc_fsk": lambda energy: 0.5 * np.exp(-0.5 * energy),
}


# Points (standard deviations) over which shadowing is averaged: at steps of 1/16 the mean over
# 12 dB is right to 1e-6 for frames of 2000 bits, whose decoding chance rises within 3 dB.
_STEPS = np.linspace(-6.0, 6.0, 193)
_WEIGHTS = np.exp(-0.5 * _STEPS**2) / np.exp(-0.5 * _STEPS**2).sum()


class SoundMessage(NamedTuple):
    """What is to be decoded: the duration of its sound (s), and its number of bits."""

    duration_s: float
    bits: int = 0


def threshold_db(sonar: Sound, budget: LinkBudget, band_range_m: float) -> float:
    """Return the SNR (dB) at which half of all signals are decoded by the decoding `threshold`.

    If none is given, the SNR at the band's range: a disc of that radius with a soft edge.

    >>> from .sound_settings import Sonar
    >>> round(threshold_db(Sonar(), link_budget(Sonar()), 50.0), 6)
    67.221835
    """
    given = sonar.snr_threshold_db
    return float(budget.snr_db(band_range_m)) if given is None else given


def chance_decoded(
    sonar: Sound, snr_db: ArrayLike, message: SoundMessage, threshold: float = math.nan
) -> Floats:
    """Return the probability that a message with a mean SNR (dB) is decoded if nothing overlaps it.

    The SNR is log-normal about its mean.  Decoding `threshold` succeeds where it exceeds the
    `threshold` (dB, see :func:`threshold_db`): Phi((SNR - threshold) / sd).  Matched filters use
    the pulse's energy, E/N0 = SNR B T; the bits of a frame share it, so the redundancy of a code
    adds energy to them, but corrects nothing.
    """
    mean, spread = np.asarray(snr_db, dtype=float), sonar.shadowing_sd_db
    if sonar.decoding == "threshold":
        if spread == 0.0:
            return (mean >= threshold).astype(float)
        return normal_cdf((mean - threshold) / spread)
    if spread == 0.0:
        return _unshadowed(sonar, mean, message)
    chances = _unshadowed(sonar, mean[..., None] + spread * _STEPS, message) @ _WEIGHTS
    return np.asarray(np.clip(chances, 0.0, 1.0))  # a sum of weights may exceed 1 by its rounding


def _unshadowed(sonar: Sound, snr_db: Floats, message: SoundMessage) -> Floats:
    energy = pulse_energy(sonar, snr_db, message.duration_s)
    if sonar.decoding in DETECTORS:
        return detected(energy, sonar.false_alarm, sonar.decoding)
    if message.bits < 1:
        raise ValueError(
            f"decoding {sonar.decoding} is one of bits, and the message carries none; choose "
            f"threshold or one of {', '.join(DETECTORS)}"
        )
    return 1.0 - frame_error(energy / message.bits, message.bits, sonar.decoding)


def pulse_energy(sonar: Sound, snr_db: ArrayLike, duration_s: float) -> Floats:
    """Return E/N0 (a ratio) of a pulse with an SNR (dB) in the band: B T times the SNR."""
    gain = sonar.bandwidth_khz * 1e3 * duration_s
    return np.asarray(gain * 10.0 ** (np.asarray(snr_db, dtype=float) / 10.0))


def timing_sd_s(
    sonar: Sound, snr_db: ArrayLike, duration_s: float, carrier: bool = False
) -> Floats:
    """Return the standard deviation (s) of the time of arrival that an element measures of a pulse.

    The Cramer-Rao bound 1 / (2 pi beta sqrt(2 E/N0)), with beta = B/sqrt(12) by the envelope,
    sqrt(fc^2 + B^2/12) with the `carrier`; SNR in dB.
    Source: H. L. Van Trees, Detection, Estimation, and Modulation Theory (1968), part III.

    >>> from .sound_settings import Sonar
    >>> [f"{float(timing_sd_s(Sonar(), 0.0, 0.01, carrier)):.4g}" for carrier in (False, True)]
    ['3.898e-06', '4.472e-07']
    """
    energy = pulse_energy(sonar, snr_db, duration_s)
    square = (sonar.bandwidth_khz * 1e3) ** 2 / 12.0
    if carrier:
        square += (sonar.frequency_khz * 1e3) ** 2
    return np.asarray(np.sqrt(1.0 / (4.0 * math.pi**2 * square * 2.0 * energy)))
