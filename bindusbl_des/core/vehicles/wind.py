"""The wind of a mission, and polars: what speed a sailing vessel makes of it.

The wind blows alike over the whole survey.  Its mean is constant, or linear between the samples of
a file; gusts and veering are added as Gauss-Markov processes of speed and direction.

A polar has the speed (m/s) through the water by the angle off the true wind and its speed, both
relative to the water.  No measured polar of a small sailing robot is public; the two that ship are
assumptions that others have worked with:

* `dinghy` (Maritime-Robotics-Student-Society/sailing-robot): 0.4 of the *apparent* wind times a
  dinghy's factor by the angle of the apparent wind.  :func:`by_true_wind` solves for the speed at
  which the apparent wind drives the hull as fast as it makes that wind.
* `swarm` (praked/SailSwarmSwIM, arXiv 2605.27422): factors by the angle off the true wind, taken as
  shares of 0.4 of its speed, as the other's.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.tables import of_file, ordered, read_table

# A polar has a row for each degree off the wind, from 0 to 180.
DEGREES = np.arange(181.0)

# Speed of hull by that of the wind, at a factor of 1: sailing-robot
OF_WIND = 0.4

# Factors by the angle off the bow (deg); within the first the sails do not draw
DINGHY = (
    (30.0, 42.0, 58.0, 90.0, 113.0, 140.0, 180.0),
    (0.37, 0.60, 0.81, 1.00, 0.96, 0.83, 0.69),
)
SWARM = ((27.5, 45.0, 90.0, 90.0, 135.0, 135.0, 180.0), (0.1, 0.8, 0.8, 1.0, 1.0, 0.9, 0.9))

# Fastest wind (m/s) of a file
STRONGEST = 60.0


class Polar(NamedTuple):
    """Speeds through the water (m/s), (181, k), by degrees off the wind and its speeds (k,), m/s,
    which rise from 0; linear between them, in stronger wind as in the last.
    """

    winds: Floats
    speeds: Floats


def polar_of(name: str, no_go: float) -> Polar:
    """Return a polar by its name or file; within `no_go` (deg) off the wind there is no speed.

    Raises:
        ValueError: naming file, line and remedy, when a file is no polar.
    """
    if name in ("dinghy", "swarm"):
        shares = by_true_wind(*DINGHY) if name == "dinghy" else OF_WIND * _factors(*SWARM, DEGREES)
        found = Polar(np.array((0.0, STRONGEST)), np.outer(shares, (0.0, STRONGEST)))
    else:
        found = read_polar(name)
    draws = DEGREES[:, np.newaxis] >= no_go
    return Polar(found.winds, np.where(draws, found.speeds, 0.0))


def _factors(angles: tuple[float, ...], factors: tuple[float, ...], off: Floats | float) -> Floats:
    """Return factors at angles off the bow (deg); 0 within the first angle."""
    found = np.interp(off, angles, factors)
    return np.where(np.asarray(off) < angles[0], 0.0, found)


@cache
def by_true_wind(angles: tuple[float, ...], factors: tuple[float, ...]) -> Floats:
    """Return speeds as shares of the true wind, at each degree off it, (181,), from factors by the
    angle of the apparent wind off the bow (deg): share = 0.4 factor(angle) apparent / true.

    By bisection between no speed and that of a factor of 1 on the fastest apparent wind.
    """
    cosine, sine = np.cos(np.radians(DEGREES)), np.sin(np.radians(DEGREES))
    low, high = np.zeros(len(DEGREES)), np.ones(len(DEGREES))
    for _ in range(60):
        share = 0.5 * (low + high)
        ahead = cosine + share  # the apparent wind against the bow, and across it
        off = np.degrees(np.arctan2(sine, ahead))
        is_faster = OF_WIND * _factors(angles, factors, off) * np.hypot(ahead, sine) > share
        low, high = np.where(is_faster, share, low), np.where(is_faster, high, share)
    return 0.5 * (low + high)


@of_file(16)
def read_polar(path: str) -> Polar:
    """Return the polar of a file: a CSV with angle_deg (0 to 180, off the wind), wind_m_per_s and
    speed_m_per_s, a row for each pair of an angle and a wind.

    Raises:
        ValueError: naming file, line and remedy, when it is none.
    """
    rows = _read(path, {"angle_deg": (0, 180), "wind_m_per_s": (0, 60), "speed_m_per_s": (0, 20)})
    known = {(angle, wind): speed for _, (angle, wind, speed) in rows}
    angles = sorted({angle for angle, _ in known})
    winds = sorted({wind for _, wind in known} | {0.0})
    missing = [
        (angle, wind) for angle in angles for wind in winds if wind and (angle, wind) not in known
    ]
    if missing:
        angle, wind = missing[0]
        raise ValueError(
            f"{path}: has no speed at {angle:g} deg in {wind:g} m/s of wind; a polar needs each of "
            "its angles at each of its winds"
        )
    if len(angles) < 2 or len(winds) < 2:
        raise ValueError(f"{path}: a polar needs two angles at least, and a wind above 0")
    grid = [[known.get((angle, wind), 0.0) for wind in winds] for angle in angles]
    speeds = [np.interp(DEGREES, angles, column) for column in np.array(grid).T]
    return Polar(np.array(winds), np.array(speeds).T)


class WindSamples(NamedTuple):
    """Instants (n,), s, that increase, and the wind then: its speed (m/s) and where from (deg)."""

    times: Floats
    speeds: Floats
    from_deg: Floats


@of_file(16)
def read_wind(path: str) -> WindSamples:
    """Return the samples of a file: a CSV with time_s (of the mission), speed_m_per_s and from_deg.

    Raises:
        ValueError: naming file, line and remedy, when it is none.
    """
    limits = {"time_s": (-1e9, 1e9), "speed_m_per_s": (0, 60), "from_deg": (-360, 360)}
    rows = _read(path, limits)
    places, values = [where for where, _ in rows], [sample for _, sample in rows]
    kept, others = ordered(
        places, [time for time, *_ in values], "time_s", "s", "; sort the rows by time"
    )
    if others or len(kept) < 1:
        raise ValueError(others[0] if others else f"{path}: has no sample of the wind")
    return WindSamples(*np.array(values).T)


def _read(path: str, limits: dict[str, tuple[float, float]]) -> list[tuple[str, list[float]]]:
    """Return the place and the numbers of each row of a file with such columns."""
    table = read_table(path)
    if lacking := [name for name in limits if name not in table.names]:
        raise ValueError(
            f"{path}:1: has the columns {', '.join(table.names)}, and lacks {', '.join(lacking)}; "
            f"it needs {', '.join(limits)}"
        )
    return [
        (row.where, [row.number(name, limit) for name, limit in limits.items()])
        for row in table.rows()
    ]


def mean_wind(
    speed: float, from_deg: float, samples: WindSamples | None, times: Floats
) -> tuple[Floats, Floats]:
    """Return the mean speed of the wind (m/s) at instants (s), (n,), and where from (rad).

    Between samples the wind is linear along x and along y; before the first and after the last it
    is as then.
    """
    if samples is None:
        return np.full(len(times), speed), np.full(len(times), math.radians(from_deg))
    towards = -np.exp(1j * np.radians(samples.from_deg)) * samples.speeds
    found = np.interp(times, samples.times, towards)
    return np.abs(found), np.angle(-found)
