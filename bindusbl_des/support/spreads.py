"""Sizes of errors: as data sheets state them, and as they grow in dead reckoning."""

import math
from typing import Literal

Statistic = Literal["cep", "drms", "p95"]

# Median, root mean square and 95th percentile of the length of a circular Gaussian error, per
# standard deviation along one axis (Rayleigh distribution, quantile sqrt(-2 ln(1 - p))).
PER_AXIS_SD: dict[Statistic, float] = {
    "cep": math.sqrt(2.0 * math.log(2.0)),
    "drms": math.sqrt(2.0),
    "p95": math.sqrt(2.0 * math.log(20.0)),
}


# Below this share of a time constant a series of three terms is exact to 1e-10.
SHORT = 1e-3


def per_axis_sd(stated: float, statistic: Statistic) -> float:
    """Return the standard deviation along each axis of a horizontal error that a data sheet states.

    `cep` is the radius of the circle that holds half of all errors, `drms` their root mean square,
    `p95` the radius that holds 95 %; errors are a circular Gaussian.  Any unit.

    >>> [round(1.0 / per_axis_sd(1.0, name), 4) for name in ("cep", "drms", "p95")]
    [1.1774, 1.4142, 2.4477]
    """
    return stated / PER_AXIS_SD[statistic]


def drift_rms(time: float, bias: tuple[float, float], random_walk: float) -> float:
    """Return the RMS of the horizontal drift (m) on a straight leg after `time` (s).

    sqrt(|b|^2 t^2 + 2 sigma^2 t); the paper's eq. error_envelope has a quarter of the first term
    and half of the second (docs/errata.md).

    >>> round(drift_rms(300, (0.06, 0.06), 0.027), 6)
    25.464434
    """
    return math.sqrt((math.hypot(*bias) * time) ** 2 + 2 * random_walk**2 * time)


def wandering_rms(time: float, sd: float, time_constant: float) -> float:
    """Return the RMS error per axis (m) that a wandering velocity bias causes in `time` (s).

    It is the integral of a stationary Gauss-Markov process of `sd` (m/s) and a time constant tau
    (s): sd tau sqrt(2 (t / tau - 1 + exp(-t / tau))); it grows as sd t at first, as sqrt(t) later
    on.

    >>> round(wandering_rms(60.0, 0.05, 60.0), 6), round(wandering_rms(60.0, 0.05, math.inf), 6)
    (2.573292, 3.0)
    """
    if math.isinf(time_constant):
        return sd * time
    share = time / time_constant
    if share < SHORT:  # a series, since the difference below would lose all digits
        return sd * time * math.sqrt(1.0 - share / 3.0 + share**2 / 12.0)
    return sd * time_constant * math.sqrt(2.0 * (share + math.expm1(-share)))
