"""A log through our navigators, with the noise that a scenario says: the filter as it would have
run, and the smoother afterwards.
"""

from dataclasses import dataclass, replace
from math import hypot, inf, radians
from typing import Any, NamedTuple

import numpy as np

from ..core.arrays import Floats
from ..navigation.belief import STATES, Belief, Growth, begun_at, first_belief
from ..navigation.dead_reckoning import Odometry
from ..navigation.smoothing import Sights, Smoothed, smooth
from ..records.rows import Rows
from ..setup import Setup
from .log import Log
from .sighting import SEEN, SIGHT, Mixture, follow, look

# How far off a start that was found may be, per axis (m), and its heading (rad): it was found from
# the very ranges that navigate, so they must be free to move it.
START_SD, HEADING_SD = 10.0, 0.1


@dataclass(frozen=True)
class Noise:
    """What is unsure in a log: of ranges (m), a share of outliers and their further error (m), dead
    reckoning's random walk (m/sqrt(s)) and velocity bias (m/s, ahead and to the side of y).

    `bias_sd` is what a bias may be beyond the one given (m/s), which wanders with a time constant
    `bias_time_constant_s` (s) or, if that is infinite, is constant; the scale of the way is off by
    `scale_sd`, its heading by `heading_sd` (rad), both constant.  A sight that not even the
    variance of an outlier explains is refused: its normalised square is above `gate`; 0: none is.
    """

    range_sd: float
    outlier_share: float
    outlier_sd: float
    random_walk: float
    bias: tuple[float, float] = (0.0, 0.0)
    bias_sd: float = 0.0
    gate: float = 0.0
    start_sd: float = 0.0
    in_body: bool = True
    scale_sd: float = 0.0
    heading_sd: float = 0.0
    bias_time_constant_s: float = inf

    def with_start_found(self) -> "Noise":
        """Return noise that leaves a start that was found free to move."""
        start_sd, heading_sd = max(self.start_sd, START_SD), max(self.heading_sd, HEADING_SD)
        return replace(self, start_sd=start_sd, heading_sd=heading_sd)

    @property
    def mixture(self) -> Mixture:
        """The noise of sights."""
        return Mixture(*map(float, (self.range_sd, self.outlier_share, self.outlier_sd, self.gate)))

    def first(self) -> Belief:
        """Return what is believed at the start."""
        constant = 0.0 if self.wanders else self.bias_sd
        ahead, aside = (hypot(bias, constant) for bias in self.bias)
        return first_belief(self.start_sd, (ahead, aside), 0.0, self._further[0])

    @property
    def wanders(self) -> bool:
        """Whether the bias beyond the one given changes with time."""
        return self.bias_sd > 0.0 and self.bias_time_constant_s < inf

    @property
    def _further(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The standard deviations and time constants (s) of states 6 and 7, which stretch and turn
        the way, and of 8 and 9, a bias that wanders, if it does.
        """
        sds, time_constants = (self.scale_sd, self.heading_sd), (inf, inf)
        if not self.wanders:
            return sds, time_constants
        return (*sds, self.bias_sd, self.bias_sd), (
            *time_constants,
            self.bias_time_constant_s,
            self.bias_time_constant_s,
        )

    def growth(self) -> Growth:
        """Return how beliefs become less sure."""
        sds, time_constants = map(np.array, self._further)
        wandering = STATES + 2 if self.wanders else 0
        walk = float(self.random_walk) ** 2
        return Growth(walk, 0.0, self.in_body, STATES, wandering, sds, time_constants)


def noise_of(setup: Setup) -> Noise:
    """Return the noise that a scenario tells AUVs of, as far as a log has any use for it."""
    setup = setup.taken
    scenario = setup.scenario
    navigation, usbl, sensors = scenario.navigation, scenario.usbl, setup.own_sensors
    return Noise(
        setup.usbl.range_sd(2 if setup.usbl.sheet is not None and setup.ranging.calls else 1),
        usbl.outlier_share,
        usbl.outlier_sd_m if usbl.outlier_share > 0.0 else 0.0,
        sensors.random_walk_m_per_sqrt_s,
        sensors.bias_m_per_s,
        sensors.bias_sd_m_per_s,
        navigation.nis_gate or 0.0,
        navigation.initial_position_sd_m,
        navigation.bias_frame == "body",
        sensors.scale_factor_sd,
        radians(sensors.heading_sd_deg),
        inf if sensors.bias_time_constant_s is None else sensors.bias_time_constant_s,
    )


# Sights are looked at anew from where they have put the vehicle until that moves by less (m).
SETTLED, MOST_LOOKS = 1e-3, 50


class NavigatedTrack(NamedTuple):
    """Where a vehicle was taken for at n instants (n,), s: places (n, 2), m, and their covariances
    xx, yy, xy (n, 3), m2; what became of each of m sights (m,), SEEN.
    """

    times: Floats
    places: Floats
    covariances: Floats
    seen: Rows

    def at(self, times: Floats) -> Floats:
        """Return the places (k, 2), m, of some of the instants (k,), s."""
        return self.places[np.searchsorted(self.times, times)]


class Prepared(NamedTuple):
    """A log as navigators take it: its odometry at all instants of rows and sights, the sights."""

    odometry: Odometry
    sights: Rows

    def first(self, noise: Noise) -> Belief:
        """Return what is believed at the first instant."""
        x, y = self.odometry.position[0].tolist()
        return begun_at(noise.first(), (x, y))


def prepared(log: Log) -> Prepared:
    """Return a log that is placed, its sights in the order in which they hold."""
    times = np.unique(np.concatenate((log.times, log.ranges.times, log.fixes.times)))
    ranges = _blank(len(log.ranges.times))
    beacons = log.beacons.places[log.ranges.beacons]
    ranges["node"] = np.searchsorted(times, log.ranges.times)
    ranges["x_m"], ranges["y_m"] = beacons[:, 0], beacons[:, 1]
    ranges["z_m"] = beacons[:, 2] - log.at(log.depths, log.ranges.times)
    ranges["range_m"] = log.ranges.metres
    fixes = _blank(len(log.fixes.times))
    fixes["node"] = np.searchsorted(times, log.fixes.times)
    fixes["x_m"], fixes["y_m"] = log.fixes.places.T
    xx, yy, xy = log.fixes.covariances.T
    spreads, axes = np.linalg.eigh(np.stack((xx, xy, xy, yy), axis=-1).reshape(-1, 2, 2))
    fixes["along_m2"], fixes["across_m2"] = spreads.T
    fixes["axis_x"], fixes["axis_y"] = axes[:, 0, 0], axes[:, 1, 0]
    sights = np.concatenate((ranges, fixes))
    order = np.argsort(sights["node"], kind="stable")
    return Prepared(log.odometry(times), sights[order].view(np.recarray))


def _blank(count: int) -> Any:
    rows = np.zeros(count, dtype=SIGHT)
    rows["range_m"] = np.nan
    return rows


def filter_log(log: Prepared, noise: Noise) -> NavigatedTrack:
    """Return where the vehicle would have taken itself for, sight by sight, as an extended Kalman
    filter has it.
    """
    count, own = len(log.odometry.times), log.first(noise)
    seen = np.zeros(len(log.sights), dtype=SEEN).view(np.recarray)
    places, covariances = np.empty((count, 2)), np.empty((count, 3))
    follow(own, log.odometry, log.sights, noise.mixture, noise.growth(), seen, places, covariances)
    return NavigatedTrack(log.odometry.times, places, covariances, seen)


def smooth_log(
    log: Prepared, noise: Noise, begin: NavigatedTrack
) -> tuple[NavigatedTrack, Smoothed]:
    """Return where all sights together say that it was, and what is believed of all states.

    Sights are looked at from `begin`, and from where that leads, until nothing changes: the most
    likely track.
    """
    first, growth = log.first(noise), noise.growth()
    places = begin.places
    for _ in range(MOST_LOOKS):
        sights, seen = _looked_at(log, noise, places)
        found = smooth(first, log.odometry, sights, growth)
        before, places = places, log.odometry.position - found.states[:, :2]
        if np.abs(places - before).max() < SETTLED:
            break
    spread = found.covariances
    covariances = np.column_stack((spread[:, 0, 0], spread[:, 1, 1], spread[:, 0, 1]))
    return NavigatedTrack(log.odometry.times, places, covariances, seen), found


def _looked_at(log: Prepared, noise: Noise, places: Floats) -> tuple[Sights, Rows]:
    """Return sights made linear at places (n, 2), m, and what is thought of each there."""
    most, states = 2 * len(log.sights), len(noise.first().state)
    linear = Sights(
        np.zeros(most, dtype=np.int64), np.zeros((most, states)), np.zeros(most), np.zeros(most)
    )
    seen = np.zeros(len(log.sights), dtype=SEEN).view(np.recarray)
    count = look(log.sights, places, log.odometry.position, noise.mixture, linear, seen)
    nodes, rows, values, variances = linear
    return Sights(nodes[:count], rows[:count], values[:count], variances[:count]), seen
