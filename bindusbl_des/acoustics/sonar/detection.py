"""Detection of a known pulse in noise, by the energy of the pulse over the noise's density."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .probability import normal_cdf, normal_quantile, poisson_at_least

Floats = NDArray[np.float64]


def detected(energy: ArrayLike, false_alarm: float, detector: str = "non_coherent") -> Floats:
    """Return the probability of detection for E/N0 (a ratio, not in dB) of a pulse.

    `non_coherent`: a matched filter's envelope, Q1(sqrt(2 E/N0), sqrt(-2 ln Pfa)).  `coherent`: of
    known phase, Q(Q^-1(Pfa) - sqrt(2 E/N0)).  `rayleigh`: the envelope where E is the mean of a
    fading channel, Pfa^(1 / (1 + E/N0)).  Raises KeyError for another detector, ValueError for a
    false-alarm probability outside (0, 1).
    Source: H. L. Van Trees, Detection, Estimation, and Modulation Theory (1968), part I, 2.6, 4.4.

    >>> [round(float(detected(10.0, 1e-4, it)), 4) for it in DETECTORS]
    [0.6161, 0.7743, 0.4329]
    """
    if not 0.0 < false_alarm < 1.0:
        raise ValueError(f"false-alarm probability must lie in (0, 1); met {false_alarm}")
    return DETECTORS[detector](np.asarray(energy, dtype=float), false_alarm)


def _non_coherent(energy: Floats, false_alarm: float) -> Floats:
    return poisson_at_least(energy, -math.log(false_alarm))


def _coherent(energy: Floats, false_alarm: float) -> Floats:
    return normal_cdf(normal_quantile(false_alarm) + np.sqrt(2.0 * energy))


def _rayleigh(energy: Floats, false_alarm: float) -> Floats:
    return np.asarray(false_alarm ** (1.0 / (1.0 + energy)))


DETECTORS = {"non_coherent": _non_coherent, "coherent": _coherent, "rayleigh": _rayleigh}
