"""A log through our navigators: the filter as it would have run, and the smoother afterwards."""

from typing import Any, NamedTuple

import numpy as np

from ..navigation.belief import Belief, begun_at
from ..navigation.dead_reckoning import Odometry
from ..navigation.smoothing import Sights, Smoothed, smooth
from ..records.rows import Rows
from .log import Array, Log
from .noise import Noise
from .sighting import SEEN, SIGHT, follow, look

# Sights are looked at anew from where they have put the vehicle until that moves by less (m).
SETTLED, MOST_LOOKS = 1e-3, 50


class Track(NamedTuple):
    """Where a vehicle was taken for at n instants (n,), s: places (n, 2), m, and their covariances
    xx, yy, xy (n, 3), m2; what became of each of m sights (m,), SEEN.
    """

    times: Array
    places: Array
    covariances: Array
    seen: Rows

    def at(self, times: Array) -> Array:
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


def filter_log(log: Prepared, noise: Noise) -> Track:
    """Return where the vehicle would have taken itself for, sight by sight, as an extended Kalman
    filter has it.
    """
    count, own = len(log.odometry.times), log.first(noise)
    seen = np.zeros(len(log.sights), dtype=SEEN).view(np.recarray)
    places, covariances = np.empty((count, 2)), np.empty((count, 3))
    follow(own, log.odometry, log.sights, noise.mixture, noise.growth(), seen, places, covariances)
    return Track(log.odometry.times, places, covariances, seen)


def smooth_log(log: Prepared, noise: Noise, begin: Track) -> tuple[Track, Smoothed]:
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
    return Track(log.odometry.times, places, covariances, seen), found


def _looked_at(log: Prepared, noise: Noise, places: Array) -> tuple[Sights, Rows]:
    """Return sights made linear at places (n, 2), m, and what is thought of each there."""
    most, states = 2 * len(log.sights), len(noise.first().state)
    linear = Sights(
        np.zeros(most, dtype=np.int64), np.zeros((most, states)), np.zeros(most), np.zeros(most)
    )
    seen = np.zeros(len(log.sights), dtype=SEEN).view(np.recarray)
    count = look(log.sights, places, log.odometry.position, noise.mixture, linear, seen)
    nodes, rows, values, variances = linear
    return Sights(nodes[:count], rows[:count], values[:count], variances[:count]), seen
