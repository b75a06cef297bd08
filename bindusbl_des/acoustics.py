"""Sound in the sea: how fast it travels, what it loses on the way, and when it arrives."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NoReturn, TypeVar

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled

Floats = NDArray[np.float64]
Value = TypeVar("Value", float, Floats)

# Sea water of 40 psu at 8000 m freezes near -8.4 degC (UNESCO 44); anything colder is a mistake.
COLDEST_C = -10.0

# Range (m) beyond which the loss law is held constant (eq. fix_loss).
LONGEST_LOSS_RANGE = 800.0

# Largest loss probability by range alone (eq. fix_loss_total; same cap in the thesis simulator).
LARGEST_RANGE_LOSS = 0.999

# Light-time loop: a fixed point is found when the delay changes by less than this (s).
SETTLED = 1e-13

# A step shrinks the error by speed / sound speed: 200 suffice up to 0.86 of the sound speed.
MOST_STEPS = 200


def sound_speed(temperature_c: Value, salinity_psu: float, depth_m: Value | float) -> Value:
    """Return how fast sound travels in sea water (m/s), after Mackenzie (1981).

    Temperature in degC, salinity in psu, depth in m below the surface; temperature may be an array
    (a profile), depth then an array of the same shape.  Fitted for 2-30 degC, 25-40 psu, 0-8000 m
    with a standard error of 0.07 m/s; outside that it extrapolates.  Raises ValueError for values
    that no water has.  Source: K. V. Mackenzie, J. Acoust. Soc. Am. 70, 807 (1981).

    >>> round(sound_speed(25.0, 35.0, 1000.0), 3)
    1550.744
    """
    _check_water(temperature_c, salinity_psu, depth_m)
    warm, salt = temperature_c, salinity_psu - 35.0
    surface = 1448.96 + warm * (4.591 + warm * (-5.304e-2 + 2.374e-4 * warm)) + 1.340 * salt
    deep = depth_m * (1.630e-2 + 1.675e-7 * depth_m) - 7.139e-13 * warm * depth_m**3
    return surface - 1.025e-2 * warm * salt + deep


def sound_speed_medwin(temperature_c: Value, salinity_psu: float, depth_m: Value | float) -> Value:
    """Return how fast sound travels in shallow sea or lake water (m/s), after Medwin (1975).

    Arguments and errors as in :func:`sound_speed`; fitted for 0-35 degC, 0-45 psu, 0-1000 m.
    Source: H. Medwin, J. Acoust. Soc. Am. 58, 1318 (1975).

    >>> round(sound_speed_medwin(10.0, 35.0, 10.0), 3)
    1490.15
    """
    _check_water(temperature_c, salinity_psu, depth_m)
    warm, salt = temperature_c, salinity_psu - 35.0
    surface = 1449.2 + warm * (4.6 + warm * (-0.055 + 0.00029 * warm))
    return surface + (1.34 - 0.010 * warm) * salt + 0.016 * depth_m


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
    _check_water(temperature_c, salinity_psu, depth_m)
    _check("pH", ph, 0.0, "give a value between 0 and 14")
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


@dataclass(frozen=True)
class LossLaw:
    """How likely a ping is lost by range r (m): a e^(b r) + c e^(d r) (eq. fix_loss)."""

    a: float
    b: float
    c: float
    d: float
    source: str


_SIMULATOR = "github.com/rwth-irt/USBL-Simulator (e9f29b7)"

LOSS_LAWS: Mapping[str, LossLaw] = MappingProxyType(
    {
        "paper": LossLaw(-6.070, 2.12e-3, 5.987, 2.25e-3, "paper, eq. fix_loss"),
        "thesis": LossLaw(
            -6.07039718341056,
            0.00212458825600739,
            5.98749360969012,
            0.00225378907075506,
            f"M. Nitsch, RWTH Aachen 2024, doi 10.18154/RWTH-2024-05964; digits of {_SIMULATOR}",
        ),
        "head": LossLaw(
            0.0037, 0.0174, 0.0, 0.0174, f"OEM 120/180 kHz head, settings shipped in {_SIMULATOR}"
        ),
        "none": LossLaw(0.0, 0.0, 0.0, 0.0, "no loss by range"),
    }
)


def range_loss(slant_range: float, law: LossLaw = LOSS_LAWS["thesis"]) -> float:
    """Return the raw value of the loss law at a slant range (m): not yet a probability.

    'paper' and 'thesis' are negative below 105.909 m and 106.432 m and exceed 1 beyond 517.6 m and
    518.8 m, 'head' exceeds 1 beyond 321.8 m: a combiner makes it a probability.  Beyond 800 m the
    law is held constant.  Raises ValueError for a range that is negative or not finite.
    Source: eq. fix_loss.

    >>> round(range_loss(50.0, LOSS_LAWS["paper"]), 6)
    -0.048873
    """
    if not 0.0 <= slant_range < math.inf:
        _refuse("slant range", slant_range, "be a finite number not below 0", "give it in metres")
    return _law(slant_range, law.a, law.b, law.c, law.d)


@compiled
def _law(slant_range: float, a: float, b: float, c: float, d: float) -> float:
    reach = min(slant_range, LONGEST_LOSS_RANGE)
    return a * math.exp(b * reach) + c * math.exp(d * reach)


def contention_loss(auv_count: int, per_auv: float = 0.05) -> float:
    """Return what AUVs that share the uplink add to the loss of each ping, (N - 1) P_col.

    Raises ValueError for less than one AUV or a `per_auv` outside [0, 1].
    Source: eq. fix_loss_total, P_col = 0.05 per additional AUV.

    >>> round(contention_loss(4), 3)
    0.15
    """
    if auv_count < 1:
        _refuse("AUV count", auv_count, "be at least 1", "count the pinging AUV itself")
    if not 0.0 <= per_auv <= 1.0:
        _refuse("loss per additional AUV", per_auv, "lie in [0, 1]", "the paper has 0.05")
    return (auv_count - 1) * per_auv


@compiled
def clamp_first(loss: float, contention: float, cap: float) -> float:
    """Return the probability that a ping is lost, range loss made a probability before adding.

    >>> round(clamp_first(range_loss(50.0), contention_loss(3), 0.999), 6)
    0.1
    """
    return min(min(max(loss, 0.0), LARGEST_RANGE_LOSS) + contention, cap)


@compiled
def paper_raw(loss: float, contention: float, cap: float) -> float:
    """Return the probability that a ping is lost, by the paper's literal sum (eq. fix_loss_total).

    Below 106 m the negative law takes up to 0.083 off the contention.

    >>> round(paper_raw(range_loss(50.0, LOSS_LAWS["paper"]), contention_loss(3), 0.999), 6)
    0.051127
    """
    return max(0.0, min(loss + contention, cap))


@compiled
def off(loss: float, contention: float, cap: float) -> float:
    """Return the probability that a ping is lost by range alone: collisions are simulated.

    >>> off(range_loss(50.0), contention_loss(3), 0.999)
    0.0
    """
    return min(max(loss, 0.0), cap)


# (range loss, contention, cap) -> probability in [0, cap]
COMBINERS: Mapping[str, Callable[[float, float, float], float]] = MappingProxyType(
    {"clamp_first": clamp_first, "paper_raw": paper_raw, "off": off}
)


@compiled
def loss_probability(
    slant_range: float, coefficients: Floats, combine: int, contention: float, cap: float
) -> float:
    """Return the probability that a ping is lost over a slant range (m), as a scenario has it.

    `coefficients` (4,) are those of a loss law, `combine` the number of a combiner in COMBINERS.
    """
    loss = _law(slant_range, coefficients[0], coefficients[1], coefficients[2], coefficients[3])
    if combine == 0:
        return clamp_first(loss, contention, cap)
    if combine == 1:
        return paper_raw(loss, contention, cap)
    return off(loss, contention, cap)


def travel_time(
    source: Sequence[float],
    receiver_at: Callable[[float], Sequence[float]],
    sent_at: float,
    sound_speed: float,
) -> float:
    """Return how long (s) a sound sent at `sent_at` travels until it meets a receiver that moves.

    `source` begins with x, y, z (m) of where it was sent, `receiver_at(t)` with those of the
    receiver at time t (s).  Fixed point of D = |receiver_at(sent_at + D) - source| / c, within
    1e-13 s; a still receiver is asked twice.  How the source moves after sending does not matter.
    Raises ValueError for a sound speed that is not positive, for positions that are not finite and
    for a receiver that outruns the sound.  Source: light-time equation.

    >>> round(travel_time((0, 0, 0), lambda t: (100 + 1.5 * t, 0, 0), 0.0, 1500.0), 12)
    0.066733400067
    """
    if not 0.0 < sound_speed < math.inf:
        _refuse("sound speed", sound_speed, "be positive and finite", "sea water has about 1500")
    x, y, z = source[0], source[1], source[2]
    settled = SETTLED + math.ulp(sent_at)  # no clock is finer than its own last digit
    delay = 0.0
    for _ in range(MOST_STEPS):
        place = receiver_at(sent_at + delay)
        ahead, aside, below = place[0] - x, place[1] - y, place[2] - z
        reached = math.sqrt(ahead * ahead + aside * aside + below * below) / sound_speed
        if abs(reached - delay) < settled:
            return reached
        delay = reached
    raise ValueError(
        "a receiver must have a finite position and move slower than sound; after "
        f"{MOST_STEPS} steps the delay of the sound sent from ({x}, {y}, {z}) at {sent_at} s was "
        f"{delay} s and unsettled; check the positions and the speed of the receiver"
    )


def travel_time_constant_velocity(
    offset: Sequence[float], velocity: Sequence[float], sound_speed: float
) -> float:
    """Return how long (s) a sound travels to a receiver that keeps its course.

    `offset` (m) points from the source to the receiver when the sound is sent, `velocity` (m/s) is
    the receiver's, both with the same number of axes.  Raises ValueError for values that are not
    finite and for a receiver as fast as sound.  Source: |d + v D| = c D solved for D.

    >>> round(travel_time_constant_velocity((100, 0, 0), (1.5, 0, 0), 1500.0), 12)
    0.066733400067
    """
    distance, speed = math.hypot(*offset), math.hypot(*velocity)
    if not math.isfinite(distance):
        _refuse("offset", offset, "be finite", "give metres from source to receiver")
    if not speed < sound_speed < math.inf:
        _refuse("receiver speed (m/s)", speed, f"be below {sound_speed}", "give metres per second")
    receding = sum(d * v for d, v in zip(offset, velocity, strict=True))
    excess = (sound_speed - speed) * (sound_speed + speed)
    root = math.sqrt(receding**2 + excess * distance**2)
    if receding >= 0.0:
        return (receding + root) / excess
    return distance**2 / (root - receding)  # the same number, without a difference of near equals


def _check_water(temperature_c: Value, salinity_psu: float, depth_m: Value | float) -> None:
    _check("temperature (degC)", temperature_c, COLDEST_C, "give degrees Celsius")
    _check("salinity (psu)", salinity_psu, 0.0, "fresh water has 0, the ocean about 35")
    _check("depth (m)", depth_m, 0.0, "count metres downwards from the surface")


def _check_frequency(frequency_khz: Value) -> None:
    if not np.all(np.isfinite(frequency_khz) & (np.asarray(frequency_khz) > 0.0)):
        _refuse("frequency (kHz)", frequency_khz, "be positive and finite", "give kilohertz")


def _check(name: str, value: Value | float, lowest: float, remedy: str) -> None:
    if not np.all(np.isfinite(value) & (np.asarray(value) >= lowest)):
        _refuse(name, value, f"be a finite number not below {lowest:g}", remedy)


def _refuse(name: str, value: object, rule: str, remedy: str) -> NoReturn:
    raise ValueError(f"{name} must {rule}; met {value}; {remedy}")
