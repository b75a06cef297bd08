"""Frames of bits: how often one is wrong, and with it the frame."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .probability import normal_cdf

Floats = NDArray[np.float64]


def bit_error(energy: ArrayLike, modulation: str = "bpsk") -> Floats:
    """Return the probability that a bit is wrong, for Eb/N0 (a ratio, not in dB) of a bit.

    `bpsk` coherent, `dpsk` and `nc_fsk` (binary, orthogonal) not, in white noise.  Raises KeyError
    for another modulation.  Source: J. G. Proakis, Digital Communications (2001), 5.2.

    >>> [f"{float(bit_error(10.0, it)):.3g}" for it in ("bpsk", "dpsk", "nc_fsk")]
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
