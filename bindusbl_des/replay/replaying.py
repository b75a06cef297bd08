"""A log through our navigators, and what came out, in numbers."""

from dataclasses import dataclass

import numpy as np

from .fitting import fit
from .log import Array, BadLog, Log
from .navigating import Track, filter_log, prepared, smooth_log
from .noise import Noise
from .reference import Reference, robust_optimum
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


def replay(log: Log, noise: Noise | None = None) -> Replay:
    """Return what our navigators make of a log, with noise that is given or fitted to the log.

    Raises:
        BadLog: when no start can be found.
    """
    placed, start = placed_log(log)
    chosen = fit(placed).noise if noise is None else noise
    if placed.start_found:
        chosen = chosen.with_start_found()
    if placed.has_ranges and chosen.range_sd <= 0.0:
        raise BadLog(f"{log.name}: usbl.travel_time_sd_s must be above 0 to weigh ranges")
    known = prepared(placed)
    track = filter_log(known, chosen)
    later, _ = smooth_log(known, chosen, track)
    return Replay(placed, start, chosen, track, later, robust_optimum(placed))


def placed_log(log: Log) -> tuple[Log, Start | None]:
    """Return a log in the frame of its beacons, and where it begins if that had to be found."""
    if log.placed:
        return log, None
    start = find_start(log)
    return log.begun_at(start.pose), start


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
