"""What a USBL measures of a ping: a fix of where it was sent, and how sure it is of that.

Range comes from the travel time, direction from the array, attitude from the AHRS and the vessel's
own position from GNSS.  Frames are those of :mod:`.array`.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled
from ..records.rows import Row, Rows
from .array import arrival_differences, direction, rotation, scatter, tangents

Vector = NDArray[np.float64]

# Noise of one measurement: 5 element arrivals, 1 travel time, 3 attitude angles, 3 GNSS axes
NOISE_WIDTH = 12

# What all measurements of an instrument share: the sound speed that it computes with and the true
# one (m/s), the noise of one element by itself and with what its clock's steps add (s), that of a
# travel time (s), the step (s), the noise of a range by one way (m), of GNSS along each axis (m),
# and of roll, pitch and heading (rad).
LEVELS = np.dtype(
    [
        ("sound_speed_m_per_s", "f8"),
        ("true_sound_speed_m_per_s", "f8"),
        ("element_sd_s", "f8"),
        ("stepped_element_sd_s", "f8"),
        ("travel_time_sd_s", "f8"),
        ("quantum_s", "f8"),
        ("range_sd_m", "f8"),
        ("gnss_sd_m", "f8"),
        ("attitude_sd_rad", "f8", (3,)),
    ]
)

# A source nearer than this (m) is within the array; it only keeps divisions finite.
SHORTEST_RANGE = 1e-3


class Instrument(NamedTuple):
    """What ASVs measure with: the places of the elements (5, 3), m, their scatter matrix (3, 3), m2
    (:mod:`.array`), and a record of LEVELS.
    """

    array: Vector
    metric: Vector
    levels: Row


def element_sd(tdoa_sd: float, quantum: float = 0.0, elements: int = 5) -> float:
    """Return the noise (s) of one element that has the effect of TDOA pair noise and quantisation.

    Independent element noise sigma_t gives pairs sqrt(2) sigma_t; the rounding errors of the
    n (n - 1) / 2 pairs average out over n pairs per element (physics: T^T T = n M).

    >>> round(element_sd(2.60296781e-7) * 1e6, 6)
    0.184058
    """
    return math.sqrt(tdoa_sd**2 / 2 + quantum**2 / 12 / elements)


def range_sd(travel_time_sd: float, quantum: float, sound_speed: float, ways: int) -> float:
    """Return the noise (m) of a range from a travel time over one way or there and back (2).

    >>> round(range_sd(6.66667e-6, 0.0, 1500.0, ways=2), 6)
    0.005
    """
    return sound_speed / ways * math.sqrt(travel_time_sd**2 + quantum**2 / 12)


@compiled
def fix_covariance(
    offset: Vector,
    attitude: Vector,
    metric: Vector,
    direction_sd: float,
    ranging_sd: float,
    attitude_sd: Vector,
    gnss_sd: float,
) -> Vector:
    """Return the first-order covariance (3, 3), m2, of a fix, in the survey frame.

    `offset` points from the array to the source (survey frame, m); `attitude` is the rotation from
    array to survey frame, `metric` the scatter matrix (diagonal, m2), `direction_sd` the element
    noise times the sound speed (m), `ranging_sd` in m, `attitude_sd` (roll, pitch, heading) in rad.
    Source: physics of the first-order terms of eq. usbl_fix,
    sr^2 s s^T + r^2 T (T^T M T)^-1 T^T sd^2 + [r s]x Sigma_att [r s]x^T + sg^2 I.
    """
    reach = math.sqrt(offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2)
    if reach < SHORTEST_RANGE:  # no direction; any will do
        offset, reach = np.array((0.0, 0.0, SHORTEST_RANGE)), SHORTEST_RANGE
    unit = offset / reach
    east, down = tangents(unit)
    a = b = d = 0.0
    for axis in range(3):  # T^T M T with M turned into the survey frame
        along_east = along_down = 0.0
        for k in range(3):
            along_east += attitude[k, axis] * east[k]
            along_down += attitude[k, axis] * down[k]
        a += metric[axis, axis] * along_east * along_east
        b += metric[axis, axis] * along_east * along_down
        d += metric[axis, axis] * along_down * along_down
    determinant = a * d - b * b
    scale = (reach * direction_sd) ** 2 / determinant
    heading = math.atan2(attitude[1, 0], attitude[0, 0])
    ch, sh = math.cos(heading), math.sin(heading)
    lever = np.zeros((3, 3))  # columns: offset x (roll, pitch, heading) axis, times its sd
    axes = ((ch, sh, 0.0), (-sh, ch, 0.0), (0.0, 0.0, 1.0))
    for k in range(3):
        x, y, z = axes[k]
        lever[0, k] = (offset[1] * z - offset[2] * y) * attitude_sd[k]
        lever[1, k] = (offset[2] * x - offset[0] * z) * attitude_sd[k]
        lever[2, k] = (offset[0] * y - offset[1] * x) * attitude_sd[k]
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            tangent = d * east[i] * east[j] - b * (east[i] * down[j] + down[i] * east[j])
            tangent += a * down[i] * down[j]
            out[i, j] = ranging_sd**2 * unit[i] * unit[j] + scale * tangent
            for k in range(3):
                out[i, j] += lever[i, k] * lever[j, k]
        out[i, i] += gnss_sd**2
    return out


@compiled
def locate(
    source: Vector,
    vessel: Vector,
    yaw: float,
    travel_time: float,
    noise: Vector,
    instrument: Instrument,
) -> tuple[Vector, Vector]:
    """Measure one ping: return the fix (3,), m, and its covariance (3, 3), m2 (eq. usbl_fix).

    `source` is where the ping was sent and `vessel` where the array is when it arrives (survey
    frame, m); `noise` are NOISE_WIDTH standard normal numbers.
    """
    levels = instrument.levels
    unit, believed = sighted(source, vessel, yaw, noise, instrument)
    reach = levels.sound_speed_m_per_s * clocked(travel_time, noise, instrument)
    return placed(vessel, unit, believed, reach, levels.range_sd_m, noise, instrument)


@compiled
def sighted(
    source: Vector,
    vessel: Vector,
    yaw: float,
    noise: Vector,
    instrument: Instrument,
) -> tuple[Vector, Vector]:
    """Return the unit vector to a source that an ASV believes in, and the attitude that it believes
    to have: the rotation (3, 3) from array to survey frame.  Arguments as of :func:`locate`.
    """
    levels = instrument.levels
    attitude_sd = levels.attitude_sd_rad
    truth = rotation(0.0, 0.0, yaw)
    offset = source - vessel
    seen = np.empty(3)  # the source as the array sees it
    for k in range(3):
        seen[k] = truth[0, k] * offset[0] + truth[1, k] * offset[1] + truth[2, k] * offset[2]
    differences = arrival_differences(
        instrument.array, seen, levels.true_sound_speed_m_per_s,
        levels.element_sd_s * noise[:5], levels.quantum_s,
    )  # fmt: skip
    within = direction(instrument.array, differences, levels.sound_speed_m_per_s, instrument.metric)
    believed = rotation(
        attitude_sd[0] * noise[6], attitude_sd[1] * noise[7], yaw + attitude_sd[2] * noise[8]
    )
    unit = np.empty(3)
    for k in range(3):
        unit[k] = (
            believed[k, 0] * within[0] + believed[k, 1] * within[1] + believed[k, 2] * within[2]
        )
    return unit, believed


@compiled
def clocked(travel_time: float, noise: Vector, instrument: Instrument) -> float:
    """Return a travel time (s) as it is measured; none is negative, whatever the noise."""
    quantum = instrument.levels.quantum_s
    measured = travel_time + instrument.levels.travel_time_sd_s * noise[5]
    if quantum > 0.0:
        measured = round(measured / quantum) * quantum
    return float(max(measured, 0.0))


@compiled
def placed(
    vessel: Vector,
    unit: Vector,
    believed: Vector,
    reach: float,
    ranging_sd: float,
    noise: Vector,
    instrument: Instrument,
) -> tuple[Vector, Vector]:
    """Return the fix (3,), m, at a range `reach` (m) in a direction, and its covariance (3, 3), m2.

    `ranging_sd` (m) is that of the range; direction and attitude as of :func:`sighted`.
    """
    ahead, levels = reach * unit, instrument.levels
    direction_sd = levels.sound_speed_m_per_s * levels.stepped_element_sd_s
    covariance = fix_covariance(
        ahead, believed, instrument.metric, direction_sd, ranging_sd, levels.attitude_sd_rad, 0.0
    )
    shrinkage = debias(ahead, covariance, ranging_sd)
    fix = np.empty(3)
    for k in range(3):
        fix[k] = vessel[k] + levels.gnss_sd_m * noise[9 + k] + shrinkage * ahead[k]
        covariance[k, k] += levels.gnss_sd_m**2
    return fix, covariance


@compiled
def debias(ahead: Vector, covariance: Vector, ranging_sd: float) -> float:
    """Return by how much an offset must be shortened; add what that is uncertain by.

    Given a measured direction with error covariance A, the source lies anywhere on a cap of the
    sphere around it: on average r tr(A) / 2 nearer to the array than the cap's top, with a radial
    variance of r^2 tr(A^2) / 2 that the first-order `covariance` (m2, changed in place) lacks.
    Where the cap would be the whole sphere, a measurement says no more than that the source lies
    somewhere on it: its centre, with a variance of r^2 / 3 along each axis.
    Source: measurement conversion conditioned on the measurement, Duan, Han and Li, IEEE Trans. AES
    40(4), 2004, to second order.  (Conversions that are unbiased over measurements of one place,
    as that of Lerro and Bar-Shalom, 1993, lengthen the offset instead.)
    """
    square = max(ahead[0] ** 2 + ahead[1] ** 2 + ahead[2] ** 2, SHORTEST_RANGE**2)
    trace = trace_of_square = 0.0
    for i in range(3):
        for j in range(3):
            across = covariance[i, j] - ranging_sd**2 * ahead[i] * ahead[j] / square
            trace_of_square += across * across
            if i == j:
                trace += across
    if trace >= 2.0 * square:
        for i in range(3):
            for j in range(3):
                covariance[i, j] = (square + ranging_sd**2) / 3.0 if i == j else 0.0
        return 0.0
    for i in range(3):
        for j in range(3):
            covariance[i, j] += 0.5 * trace_of_square / square * ahead[i] * ahead[j] / square
    return float(1.0 - 0.5 * trace / square)


@dataclass(frozen=True)
class Usbl:
    """A USBL instrument: its array and the noise of everything it measures (SI, radians).

    Ranges and directions are computed with `sound_speed`; the true one is `true_sound_speed`, None
    if they are the same.
    """

    array: Vector
    tdoa_sd: float
    travel_time_sd: float
    quantum: float
    attitude_sd: tuple[float, float, float]
    gnss_sd: float
    sound_speed: float
    true_sound_speed: float | None = None
    metric: Vector = field(init=False, repr=False)
    levels: Rows = field(init=False, repr=False)  # (1,)

    def __post_init__(self) -> None:
        levels = np.zeros(1, dtype=LEVELS)
        levels[0] = (
            self.sound_speed,
            self.sound_speed if self.true_sound_speed is None else self.true_sound_speed,
            element_sd(self.tdoa_sd),
            element_sd(self.tdoa_sd, self.quantum),
            self.travel_time_sd,
            self.quantum,
            range_sd(self.travel_time_sd, self.quantum, self.sound_speed, ways=1),
            self.gnss_sd,
            self.attitude_sd,
        )
        object.__setattr__(self, "levels", levels)  # derived once, then frozen
        object.__setattr__(self, "metric", scatter(self.array))

    def locate(
        self, source: Vector, vessel: Vector, yaw: float, travel_time: float, noise: Vector
    ) -> tuple[Vector, Vector]:
        """Measure one ping; see :func:`locate`."""
        instrument = Instrument(self.array, self.metric, self.levels[0])
        return locate(source, vessel, yaw, travel_time, noise, instrument)
