"""A log through our navigators, and what came out, in numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from inspect import signature
from typing import Any

import numpy as np

from ..navigation.dead_reckoning import Odometry
from ..navigation.navigators import Navigator, OwnNavigator
from ..records.rows import FIX, NONE
from ..scenario.scenario import Scenario
from .fitting import fit
from .log import Array, BadLog, Log
from .navigating import Track, filter_log, prepared, smooth_log
from .noise import Noise, noise_of
from .reference import Reference, robust_optimum
from .sighting import SEEN
from .start import Start, find_start


@dataclass(frozen=True)
class Replay:
    """A log, placed, with the noise by which it was navigated, and where that has put the vehicle.

    `start` is None where the log says itself where it begins, `reference` where there is none.
    """

    log: Log
    start: Start | None
    noise: Noise
    filter: Track
    smoother: Track
    reference: Reference | None


def replay(
    log: Log,
    *,
    navigator: Callable[..., Navigator] | None = None,
    noise: Noise | Scenario | None = None,
) -> Replay:
    """Return what navigators make of a log, with noise that is given or fitted to the log.

    A `navigator` of one's own is called as in a mission, with the dead reckoning and the number of
    vehicles, 1, and with the noise if it has a parameter `noise`; it stands in the filter's place.

    Raises:
        BadLog: when no start can be found; when a navigator of one's own is to go by ranges, or by
            noise that is given but has no parameter for it.
        PluginError: when it cannot be made, or answers no numbers.
    """
    placed, start = placed_log(log)
    if isinstance(noise, Scenario):
        noise = noise_of(noise)
    chosen = fit(placed).noise if noise is None else noise
    if placed.start_found:
        chosen = chosen.with_start_found()
    if placed.has_ranges and chosen.range_sd <= 0.0:
        raise BadLog(f"{log.name}: usbl.travel_time_sd_s must be above 0 to weigh ranges")
    known = prepared(placed)
    track = filter_log(known, chosen)
    later, _ = smooth_log(known, chosen, track)
    if navigator is not None:
        track = _navigated(placed, navigator, chosen, known.odometry.times, given=noise is not None)
    return Replay(placed, start, chosen, track, later, robust_optimum(placed))


def placed_log(log: Log) -> tuple[Log, Start | None]:
    """Return a log in the frame of its beacons, and where it begins if that had to be found."""
    if log.placed:
        return log, None
    start = find_start(log)
    return log.begun_at(start.pose), start


class _Reckoning:
    """The odometry of a log as the dead reckoning of a fleet of one."""

    def __init__(self, log: Log) -> None:
        self._log = log

    def at(self, auv: int, time: float) -> tuple[float, float]:
        x, y = self.sample(auv, np.array((time,)))[1].position[0].tolist()
        return x, y

    def sample(self, auv: int, times: Array) -> tuple[None, Odometry]:
        return None, self._log.odometry(times)


def _navigated(
    log: Log, make: Callable[..., Navigator], noise: Noise, times: Array, *, given: bool
) -> Track:
    """Return where a navigator of one's own takes the vehicle for at instants (n,), s."""
    part = make.func if isinstance(make, partial) else make
    name = f"{part.__module__}:{getattr(part, '__qualname__', type(part).__qualname__)}"
    if log.has_ranges:
        raise BadLog(
            f"{log.name}: {name} cannot be replayed, since a navigator of one's own takes fixes, "
            "and the log has ranges; leave it out, or turn the ranges into fixes"
        )
    if "noise" in signature(make).parameters:
        make = partial(make, noise=noise)
    elif given:
        raise BadLog(
            f"{name} would not know the noise that is given: give it a parameter `noise`, as in "
            "def __init__(self, reckoning, auvs, *, noise=None), or leave the noise out"
        )
    own: Any = OwnNavigator(name, make, _Reckoning(log), np.zeros((1, 2)))  # type: ignore[arg-type]
    fixes = _fixes(log)
    seen = np.zeros(len(fixes), dtype=SEEN).view(np.recarray)
    seen["inlier"], seen["density"], seen["taken"] = 1.0, np.nan, True
    for row, fix in enumerate(fixes):
        then = log.odometry(np.array((fix["valid_at_s"],)))
        off = own.estimate(0, then)[0] - (fix["x_m"], fix["y_m"])
        xx, yy, xy = own.covariance(0, then)[0] + log.fixes.covariances[row]
        seen[row].off_m = np.hypot(*off)
        seen[row].nis = off @ np.linalg.solve([[xx, xy], [xy, yy]], off)
        own.correct(fixes, np.array((row,)))
    odometry = log.odometry(times)
    return Track(times, own.estimate(0, odometry), own.covariance(0, odometry), seen)


def _fixes(log: Log) -> Any:
    """Return the fixes of a log as a mission delivers them, each as it holds."""
    fixes = np.zeros(len(log.fixes.times), dtype=FIX)
    for name, kind in FIX.fields.items():  # type: ignore[union-attr]
        fixes[name] = np.nan if kind[0].kind == "f" else NONE
    fixes["fix"], fixes["auv"] = np.arange(len(fixes)), 0
    for name in ("pinged_at_s", "valid_at_s", "broadcast_at_s", "delivered_at_s"):
        fixes[name] = log.fixes.times
    fixes["latency_s"] = 0.0
    fixes["x_m"], fixes["y_m"] = log.fixes.places.T
    fixes["z_m"], fixes["sd_z_m"] = log.at(log.depths, log.fixes.times), 0.0
    xx, yy, fixes["cov_xy_m2"] = log.fixes.covariances.T
    fixes["sd_x_m"], fixes["sd_y_m"] = np.sqrt(xx), np.sqrt(yy)
    return fixes.view(np.recarray)


def rms_between(places: Array, others: Array) -> float:
    """Return the root mean square distance (m) of places (n, 2) from others.

    >>> rms_between(np.zeros((2, 2)), np.array([[3.0, 4.0], [0.0, 0.0]])).__round__(6)
    3.535534
    """
    return float(np.sqrt(np.mean(np.sum((places - others) ** 2, axis=1))))


def mean_nis(track: Track) -> float:
    """Return the mean normalised innovation squared of what is no outlier, about 1 for ranges (2
    for fixes) where the noise is as told: each sight counts by how likely it is to be none.
    """
    inlier = track.seen["inlier"]
    total = float(inlier.sum())
    return float((inlier * track.seen["nis"]).sum()) / total if total else float("nan")


def outlier_share(track: Track) -> float:
    """Return the share of sights that are likelier outliers than not, or were refused."""
    seen = track.seen
    return float(np.mean((seen["inlier"] < 0.5) | ~seen["taken"]))
