"""Recorded missions that tests make up, so that what is true of them is known."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bindusbl_des.apps.recorded.log import (
    Log,
    LoggedFixes,
    LoggedPose,
    Ranges,
    SurveyedBeacons,
    rotated,
)

BEACONS = SurveyedBeacons(
    ("L0", "L1", "L2"), np.array([[0.0, 250.0, 0], [300.0, -50.0, 0], [50.0, -80.0, 0]])
)
NO_FIXES = LoggedFixes(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3)))
NO_RANGES = Ranges(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0))


class Sea(NamedTuple):
    """What a log was made of: ranges' standard deviation (m), share of outliers and their further
    error (m); random walk (m/sqrt(s)) and velocity bias (m/s) of dead reckoning.
    """

    range_sd: float = 1.5
    share: float = 0.1
    outlier_sd: float = 25.0
    walk: float = 0.05
    bias: tuple[float, float] = (0.02, -0.03)


def way(count: int, every: float = 2.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return instants (s), true places (n, 2), m, and headings (rad) of a way at 1.5 m/s."""
    times = np.arange(count) * every
    yaws = 0.4 + 1.6 * np.sin(times / 60.0) + times / 300.0
    middles = 0.5 * (yaws[1:] + yaws[:-1])
    steps = 1.5 * every * np.column_stack((np.cos(middles), np.sin(middles)))
    return times, np.cumsum(np.vstack(([40.0, 30.0], steps)), axis=0), yaws


def made_up(sea: Sea, count: int = 400, seed: int = 0) -> tuple[Log, np.ndarray]:
    """Return a log with a range at each instant, in the frame of its beacons, and the truth."""
    rng = np.random.default_rng(seed)
    times, truth, yaws = way(count)
    step = times[1]
    c, s = np.cos(yaws[:-1]), np.sin(yaws[:-1])
    ahead, aside = sea.bias
    pushed = np.column_stack((c * ahead - s * aside, s * ahead + c * aside)) * step
    walked = sea.walk * np.sqrt(step) * rng.standard_normal((count - 1, 2))
    drift = np.vstack((np.zeros(2), np.cumsum(pushed + walked, axis=0)))
    whom = rng.integers(0, 3, count)
    metres = np.hypot(*(truth - BEACONS.places[whom, :2]).T)
    metres = metres + sea.range_sd * rng.standard_normal(count)
    metres += (rng.random(count) < sea.share) * sea.outlier_sd * rng.standard_normal(count)
    ranges = Ranges(times, whom, np.abs(metres))
    log = Log("made_up", times, truth + drift, yaws, np.zeros(count), BEACONS, ranges, NO_FIXES)
    return log, truth


def still(
    walk: float = 0.3, share: float = 0.0, outlier_sd: float = 20.0, *, seed: int = 0,
    speed: tuple[float, float] = (0.0, 0.0), begin: tuple[float, float] = (0.0, 0.0),
) -> tuple[Log, np.ndarray]:  # fmt: skip
    """Return a log of fixes (0.5 m) as of USBL without a velocity log, and the truth: odometry
    stands still, the vehicle walks at random (m/sqrt(s)) beside a speed (m/s), from where it began.
    """
    rng, count, every, sd = np.random.default_rng(seed), 300, 2.0, 0.5
    times = np.arange(count) * every
    walked = walk * np.sqrt(every) * rng.standard_normal((count - 1, 2))
    truth = np.cumsum(np.vstack((begin, walked + np.multiply(speed, every))), axis=0)
    measured = truth + sd * rng.standard_normal((count, 2))
    wrong = (rng.random(count) < share)[:, None]
    measured += wrong * outlier_sd * rng.standard_normal((count, 2))
    fixes = LoggedFixes(times, measured, np.tile((sd**2, sd**2, 0.0), (count, 1)))
    nothing, nobody = np.zeros(count), SurveyedBeacons((), np.zeros((0, 3)))
    places = np.zeros((count, 2))
    return Log("still", times, places, nothing, nothing, nobody, NO_RANGES, fixes), truth


def lost(log: Log, turn: float = 2.0) -> tuple[Log, LoggedPose]:
    """Return a log whose odometry is in a frame of its own, and where it truly begins."""
    start = LoggedPose(*log.places[0].tolist(), float(log.yaws[0]))
    places = rotated(log.places - log.places[0], turn)
    return replace(log, places=places, yaws=log.yaws + turn, placed=False), start


def write_pyfg(path: Path, edit: tuple[str, str] = ("", "")) -> Path:
    """Write a short run as PyFG, with one text in place of another."""
    lines = [
        "VERTEX_XY L0 50 0", "VERTEX_XY L1 0 40", "VERTEX_SE2 0 A0 0 0 0",
        "EDGE_SE2 1 A0 A1 2 0 0 0.0004 0 0 0.0004 0 0.000004",
        "EDGE_SE2 2 A1 A2 2 0 1.5707963267948966 0.0004 0 0 0.0004 0 0.000004",
        "EDGE_SE2 4 A2 A3 3 0 0 0.0004 0 0 0.0004 0 0.000004",
        "EDGE_RANGE 1 A1 L0 48 0.5625", "EDGE_RANGE 2 A2 L1 40.2 0.5625",
        "EDGE_RANGE 4 A3 L0 46.1 0.5625",
    ]  # fmt: skip
    path.write_text("\n".join(lines).replace(*edit) + "\n")
    return path
