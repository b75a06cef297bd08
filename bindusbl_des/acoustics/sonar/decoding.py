"""How surely a sonar's signal is decoded, and how finely its arrival is timed, by its SNR."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...scenario.channel_settings import Sound
from .budget import LinkBudget
from .detection import DETECTORS, detected
from .frames import frame_error
from .probability import normal_cdf

Floats = NDArray[np.float64]

# Shadowing is averaged at these standard deviations: with steps of a sixteenth the mean over
# 12 dB is right to 1e-6 for frames of 2000 bits, whose chance rises within 3 dB.
_STEPS = np.linspace(-6.0, 6.0, 193)
_WEIGHTS = np.exp(-0.5 * _STEPS**2) / np.exp(-0.5 * _STEPS**2).sum()


class Message(NamedTuple):
    """What is to be decoded: how long its sound lasts (s), and how many bits it carries."""

    duration_s: float
    bits: int = 0


def threshold_db(sonar: Sound, budget: LinkBudget, band_range_m: float) -> float:
    """Return the SNR (dB) at which every other signal is decoded by the decoding `threshold`.

    Where it is not given, that at the band's range: a disc of that radius with a soft edge.

    >>> from ...scenario.channel_settings import Sonar
    >>> from .budget import link_budget
    >>> round(threshold_db(Sonar(), link_budget(Sonar()), 50.0), 6)
    67.221835
    """
    given = sonar.snr_threshold_db
    return float(budget.snr_db(band_range_m)) if given is None else given


def chance_decoded(
    sonar: Sound, snr_db: ArrayLike, message: Message, threshold: float = math.nan
) -> Floats:
    """Return the probability that a message of a mean SNR (dB) is decoded where nothing overlaps.

    The SNR is log-normal about its mean.  Decoding `threshold` succeeds where it exceeds the
    `threshold` (dB, see :func:`threshold_db`): Phi((SNR - threshold) / sd).  Matched filters are
    given the pulse's energy, E/N0 = SNR B T; frames' bits share it, so a code's redundancy lends
    its energy to them, but corrects nothing.
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


def _unshadowed(sonar: Sound, snr_db: Floats, message: Message) -> Floats:
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
    sonar: Sound, snr_db: ArrayLike, duration_s: float, floor_s: float, carrier: bool = False
) -> Floats:
    """Return the standard deviation (s) of the instant at which an element hears a pulse.

    The floor and the Cramer-Rao bound 1 / (2 pi beta sqrt(2 E/N0)) together, with beta = B/sqrt(12)
    by the envelope, sqrt(fc^2 + B^2/12) with the `carrier`; SNR in dB.
    Source: H. L. Van Trees, Detection, Estimation, and Modulation Theory (1968), part III.

    >>> from ...scenario.channel_settings import Sonar
    >>> [f"{float(timing_sd_s(Sonar(), 0.0, 0.01, 0.0, it)):.4g}" for it in (False, True)]
    ['3.898e-06', '4.472e-07']
    """
    energy = pulse_energy(sonar, snr_db, duration_s)
    square = (sonar.bandwidth_khz * 1e3) ** 2 / 12.0
    if carrier:
        square += (sonar.frequency_khz * 1e3) ** 2
    return np.asarray(np.sqrt(floor_s**2 + 1.0 / (4.0 * math.pi**2 * square * 2.0 * energy)))
