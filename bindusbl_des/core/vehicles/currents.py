"""The current: uniform, with a slow variation, and a field that differs from place to place.

A :class:`Field` adds to the uniform current.  It holds for a control interval at the position where
the vehicle begins the interval.
"""

import math
from collections.abc import Callable, Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined

# The control interval (s): autopilots act, and the current changes, ten times a second.
CONTROL_S = 0.1


def current_series(
    speed: float,
    direction: float,
    variation: float,
    time_constant: float,
    interval: float,
    noise: Floats,
) -> Floats:
    """Return the current (m/s) along x and y in each of n intervals, shape (n, 2).

    A uniform current of `speed` (m/s) flows towards `direction` (rad, from +x to +y).  Each axis
    varies around it as a stationary first-order Gauss-Markov process of standard deviation
    `variation` (m/s) and `time_constant` (s), exact at intervals of `interval` (s); `noise` are n
    rows of two standard normal numbers.

    >>> current_series(0.3, 0.0, 0.0, 600.0, 0.1, np.zeros((2, 2))).tolist()
    [[0.3, 0.0], [0.3, 0.0]]
    """
    mean = speed * np.array((math.cos(direction), math.sin(direction)))
    return np.asarray(mean + gauss_markov(variation, time_constant, interval, noise))


def gauss_markov(sd: float, time_constant: float, interval: float, noise: Floats) -> Floats:
    """Return stationary first-order Gauss-Markov processes (n, 2) along two axes.

    Exact at intervals of `interval` (s), with a `time_constant` (s); `noise` (n, 2) are standard
    normal numbers.
    """
    varied = np.empty_like(noise)
    _vary(noise, math.exp(-interval / time_constant), varied)
    return np.asarray(sd * varied)


@compiled
def _vary(noise: Floats, kept: float, varied: Floats) -> None:
    """Write a process (n, 2) of unit variance; each row keeps the share `kept` of the one
    before.
    """
    fresh = math.sqrt(1.0 - kept**2)
    for axis in range(2):  # a row at once would take two seconds more to compile
        varied[0, axis] = noise[0, axis]
        for k in range(1, len(noise)):
            varied[k, axis] = kept * varied[k - 1, axis] + fresh * noise[k, axis]


def carried(series: Floats, interval: float, times: Floats) -> Floats:
    """Return the displacement (m) of the water by each instant (s), (n, 2).

    >>> carried(np.array([[1.0, 0.0], [0.0, 1.0]]), 10.0, np.array([5.0, 15.0])).tolist()
    [[5.0, 0.0], [10.0, 5.0]]
    """
    moved = np.concatenate((np.zeros((1, 2)), np.cumsum(series * interval, axis=0)))
    instants = np.arange(len(moved)) * interval
    return np.column_stack([np.interp(times, instants, column) for column in moved.T])


class Field(NamedTuple):
    """A current that differs from place to place: the sum of tides, eddies and a grid.

    `tides` (n, 5): the velocity (m/s) along x and y at phase 0, then at a quarter period, and the
    angular rate (rad/s); the same everywhere.  `eddies` (n, 4): centre x, y and radius R (m), speed
    V (m/s) at R; the water at a distance r circles from +x to +y at V r/R exp((1 - r^2/R^2) / 2),
    its greatest speed, at all depths.  `values` (t, k, n, m, 2): velocities (m/s) along x and y at
    `times` (s), `depths`, `xs` and `ys` (m), which rise; linear in between, constant beyond.
    """

    tides: Annotated[Floats, 2]
    eddies: Annotated[Floats, 2]
    times: Floats
    depths: Floats
    xs: Floats
    ys: Floats
    values: Annotated[Floats, 5]


def field(
    *,
    tides: ArrayLike = (),
    eddies: ArrayLike = (),
    axes: tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike] = ((), (), (), ()),
    values: ArrayLike = (),
) -> Field:
    """Return a field of these parts, each as in :class:`Field`; without any it is still water.

    >>> beyond(field(eddies=[(0.0, 0.0, 100.0, 0.5)]), 0.0, 100.0, 0.0, 5.0)
    (0.0, 0.5)
    """
    times, depths, xs, ys = (np.array(axis, dtype=np.float64) for axis in axes)
    sizes = [axis.size for axis in (times, depths, xs, ys)]
    return Field(
        np.array(tides, dtype=np.float64).reshape(-1, 5),
        np.array(eddies, dtype=np.float64).reshape(-1, 4),
        times,
        depths,
        xs,
        ys,
        np.array(values, dtype=np.float64, order="C").reshape(*sizes, 2),
    )


STILL = field()


@inlined
def flows(field: Field) -> bool:
    """Return whether there is anything in a field."""
    return field.tides.size + field.eddies.size + field.values.size > 0


def fastest(field: Field) -> float:
    """Return a speed (m/s) that a field exceeds nowhere."""
    tides = np.hypot(np.hypot(*field.tides[:, 0:2].T), np.hypot(*field.tides[:, 2:4].T))
    grid = np.hypot(field.values[..., 0], field.values[..., 1])
    return float(tides.sum() + np.abs(field.eddies[:, 3]).sum() + grid.max(initial=0.0))


@inlined
def between(axis: Floats, value: float) -> tuple[int, float]:
    """Return the entry of a rising axis at or before a value, and the share of the way to the next;
    of the first or last two entries for a value beyond them.
    """
    low, high = 0, axis.size - 1
    if high == 0 or value <= axis[0]:
        return 0, 0.0
    if value >= axis[high]:
        return high - 1, 1.0
    while high - low > 1:
        middle = (low + high) // 2
        if axis[middle] <= value:
            low = middle
        else:
            high = middle
    return low, (value - axis[low]) / (axis[high] - axis[low])


@compiled
def beyond(field: Field, time: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the velocity (m/s) of a field along x and y at an instant (s) and a position (m)."""
    along_x = along_y = 0.0
    for tide in range(field.tides.shape[0]):
        phase = field.tides[tide, 4] * time
        cosine, sine = math.cos(phase), math.sin(phase)
        along_x += field.tides[tide, 0] * cosine + field.tides[tide, 2] * sine
        along_y += field.tides[tide, 1] * cosine + field.tides[tide, 3] * sine
    for eddy in range(field.eddies.shape[0]):
        radius = field.eddies[eddy, 2]
        off_x = (x - field.eddies[eddy, 0]) / radius
        off_y = (y - field.eddies[eddy, 1]) / radius
        turning = field.eddies[eddy, 3] * math.exp((1.0 - off_x * off_x - off_y * off_y) / 2.0)
        along_x -= turning * off_y
        along_y += turning * off_x
    if field.values.size > 0:
        first, later = between(field.times, time)
        above, deeper = between(field.depths, z)
        south, norther = between(field.xs, x)
        west, easter = between(field.ys, y)
        for corner in range(16):
            t, k, n, m = corner & 1, corner >> 1 & 1, corner >> 2 & 1, corner >> 3
            weight = later if t else 1.0 - later
            weight *= deeper if k else 1.0 - deeper
            weight *= norther if n else 1.0 - norther
            weight *= easter if m else 1.0 - easter
            if weight > 0.0:
                along_x += weight * field.values[first + t, above + k, south + n, west + m, 0]
                along_y += weight * field.values[first + t, above + k, south + n, west + m, 1]
    return along_x, along_y


def sampled(field: Field, times: Floats, places: Floats) -> Floats:
    """Return velocities (n, 2), m/s, of a field at instants (n,), s, and positions (n, 3), m."""
    found = np.zeros((len(times), 2))
    if flows(field):
        _sample(field, times, np.ascontiguousarray(places), found)
    return found


@compiled
def _sample(field: Field, times: Floats, places: Floats, found: Floats) -> None:
    for k in range(times.size):
        x, y, z = places[k, 0], places[k, 1], places[k, 2]
        found[k, 0], found[k, 1] = beyond(field, times[k], x, y, z)


# The positions (n, 3), m, of a vehicle at instants (n,), s
Way = Callable[[Floats], Floats]

# Instants at which the current along a way is sampled
SAMPLES = 257


class Flow(NamedTuple):
    """A field, and what vehicles meet of it on their planned ways, AUVs before stations.

    Its mean (ways, 2) and root mean square (ways,) on each way, and that on all ways of AUVs, m/s;
    a speed (m/s) that it exceeds nowhere; and how fast it changes for an AUV: the greatest rate
    (m2/s3) at which its variance along an axis grows with time.
    """

    field: Field
    means: Floats
    rms: Floats
    rms_m_per_s: float
    limit_m_per_s: float
    wander: float

    def at(self, times: Floats, places: Floats) -> Floats:
        """Return the field (m/s) at instants (n,), s, and positions (n, 3), m, shape (n, 2)."""
        return sampled(self.field, times, places)


class MissedCurrent(NamedTuple):
    """The current that logs miss: speed (m/s) and direction (rad) of its uniform part, the standard
    deviation (m/s) and time constant (s) of its variation, and what differs on the AUVs' ways.
    """

    speed_m_per_s: float
    towards_rad: float
    varies_m_per_s: float
    lasts_s: float
    flow: Flow
    has_field: bool


# A current that is the same everywhere has nothing beyond that
UNIFORM = Flow(STILL, np.zeros((0, 2)), np.zeros(0), 0.0, 0.0, 0.0)


def flow_on(field: Field, lasts: float, ways: Sequence[Way], auvs: int) -> Flow:
    """Return a field as vehicles meet it on their ways, first AUVs, in a mission of so long (s).

    The rate is the largest of D(T) / T over lags T, D being half the mean square of the change in
    T along both axes: of a Gauss-Markov process 2 sd^2 / time constant, as T goes to 0.

    Raises:
        ValueError: where a vehicle is to go and the field has no water.
    """
    times = np.linspace(0.0, lasts, SAMPLES)
    met = np.stack([sampled(field, times, way(times)) for way in ways])
    if len(dry := np.argwhere(np.isnan(met).any(axis=2))):
        way, k = dry[0].tolist()
        who = f"AUV{way}" if way < auvs else f"ASV{way - auvs}"
        x, y, z = ways[way](times)[k].tolist()
        raise ValueError(
            f"environment.current.file: has no water where {who} is at {times[k]:.0f} s: x {x:.0f} "
            f"m, y {y:.0f} m, depth {z:.1f} m; it is land there, below the bottom, or outside"
        )
    return met_on(field._replace(values=np.nan_to_num(field.values)), met, times, auvs)


def met_on(field: Field, met: Floats, times: Floats, auvs: int) -> Flow:
    """Return a field, and what is met of it on ways, (ways, n, 2), m/s, at instants (n,), s; see
    :func:`flow_on`.
    """
    wander = 0.0
    for lag in (2 ** np.arange(int(math.log2(SAMPLES)))).tolist():
        change = np.square(met[:auvs, lag:] - met[:auvs, :-lag]).sum(axis=2).mean() / 2.0
        wander = max(wander, float(change / times[lag]))
    square = np.square(met).sum(axis=2).mean(axis=1)
    rms = float(square[:auvs].mean() ** 0.5)
    return Flow(field, met.mean(axis=1), np.sqrt(square), rms, fastest(field), wander)
