"""A column of water: how fast sound travels at each depth, by a law or as a CTD profile found it.

A profile has conductivity, temperature and depth, or the speed of sound, read from CSV.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.arrays import Floats
from ..core.files import cells_of
from ..core.wording import refuse
from .water import USUAL_WATER, Water, sound_speed, sound_speed_medwin, sound_speed_teos10

WATER = ("temperature_c", "salinity_psu")
SPEED = "sound_speed_m_per_s"
COLUMNS = f"depth_m and {SPEED}, or depth_m, {' and '.join(WATER)}"

# What such a column can hold: anything else is another quantity or unit.
LIMITS = {
    "depth_m": (0.0, 12_000.0),
    "temperature_c": (-10.0, 50.0),
    "salinity_psu": (0.0, 60.0),
    SPEED: (1300.0, 1700.0),
}


class Cast(NamedTuple):
    """Samples of a cast, by increasing depth (n,), m: temperature (n,), degC, salinity (n,), psu,
    speed of sound (n,), m/s; what was not measured is None.
    """

    depths_m: Floats
    temperatures_c: Floats | None
    salinities_psu: Floats | None
    speeds_m_per_s: Floats | None


def read_cast(path: str | Path) -> Cast:
    """Return the samples of a cast.

    The file has a header line with the columns depth_m and sound_speed_m_per_s, or depth_m,
    temperature_c and salinity_psu, or all of them, in any order; further columns are ignored.

    Raises:
        ValueError: naming file, line and remedy, when the file is not such a cast.
    """
    return _read_cast(str(path), cells_of(path))


@lru_cache(maxsize=16)
def _read_cast(path: str, rows: tuple[tuple[str, ...], ...]) -> Cast:
    header = [name.strip() for name in rows[0]] if rows else []
    names = [name for name in LIMITS if name in header]
    has_water = all(name in names for name in WATER)
    if "depth_m" not in names or not (has_water or SPEED in names):
        raise ValueError(f"{path}:1: has the columns {', '.join(header)}; it needs {COLUMNS}")
    names = [name for name in names if has_water or name not in WATER]
    places = {name: header.index(name) for name in names}
    lines = [number for number, row in enumerate(rows[1:], 2) if row]
    if len(lines) < 2:
        raise ValueError(f"{path}: has {len(lines)} samples; a CTD profile needs at least two")
    samples = np.array([_sample(path, line, rows[line - 1], places) for line in lines])
    stuck = np.flatnonzero(np.diff(samples[:, 0]) <= 0.0)
    if len(stuck):
        above, below = samples[stuck[0], 0], samples[stuck[0] + 1, 0]
        raise ValueError(
            f"{path}:{lines[stuck[0] + 1]}: depth_m must increase, but {below:g} m follows "
            f"{above:g} m; keep the way down, or the way up turned around"
        )
    samples.setflags(write=False)
    columns = dict(zip(names, samples.T, strict=True))
    return Cast(columns["depth_m"], *(columns.get(name) for name in (*WATER, SPEED)))


def _sample(path: str, line: int, row: tuple[str, ...], places: dict[str, int]) -> list[float]:
    sample = []
    for name, place in places.items():
        text = row[place].strip() if place < len(row) else ""
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        least, most = LIMITS[name]
        if not least <= value <= most:
            raise ValueError(
                f"{path}:{line}: {name} must be a number from {least:g} to {most:g}; got {text!r}"
            )
        sample.append(value)
    return sample


# Less deep (m) it is the surface: means over so little are lost in rounding.
SHALLOWEST_M = 1e-6


class Profile(NamedTuple):
    """Depths (n,), m, that increase, and the speed of sound there (n,), m/s.

    Speeds are linear between depths, and stay what they are above the first and below the last.
    """

    depths_m: Floats
    speeds_m_per_s: Floats

    def at(self, depth_m: ArrayLike) -> Floats:
        """Return the speed of sound (m/s) at depths (m)."""
        depths = np.asarray(depth_m, dtype=float)
        return np.asarray(np.interp(depths, self.depths_m, self.speeds_m_per_s))


def mean_speed(profile: Profile, depth_m: float) -> float:
    """Return the speed (m/s) at which sound gets from the surface to a depth (m) on a straight way.

    That is the harmonic mean: depth over the time taken, with any slope of the way, as time is the
    integral of 1 / c.  At no depth it is the speed at the surface.  What bending does to ways is
    not in it.

    >>> warm_above = Profile(np.array([0.0, 10.0, 20.0]), np.array([1510.0, 1500.0, 1480.0]))
    >>> round(mean_speed(warm_above, 20.0), 3)
    1497.448
    """
    if not 0.0 <= depth_m < np.inf:
        refuse("depth (m)", depth_m, "be finite and not below 0", "count metres downwards")
    if depth_m < SHALLOWEST_M:
        return float(profile.at(0.0))
    return float(depth_m / cumulated_slowness(profile, depth_m))


def cumulated_slowness(profile: Profile, depth_m: ArrayLike) -> Floats:
    """Return how long (s) sound takes straight down from the surface to depths (m): 1 / c, summed.

    Exact for speeds that are linear between the profile's depths.
    """
    depths = np.asarray(depth_m, dtype=float)
    tops = np.unique(np.concatenate(([0.0], profile.depths_m)))
    speeds = profile.at(tops)
    whole = np.cumsum(np.concatenate(([0.0], _layer_s(np.diff(tops), speeds[:-1], speeds[1:]))))
    layer = np.clip(np.searchsorted(tops, depths, side="right") - 1, 0, None)
    return whole[layer] + _layer_s(depths - tops[layer], speeds[layer], profile.at(depths))


def _layer_s(thickness_m: Floats, above: Floats, below: Floats) -> Floats:
    """Return how long (s) sound takes through layers (m) of linear speed (m/s)."""
    rise = (below - above) / above
    # log1p(x) / x, which is 1 for x = 0
    shorter = np.divide(np.log1p(rise), rise, out=np.ones_like(rise), where=rise != 0.0)
    return np.asarray(thickness_m / above * shorter)


def mean_over(depths_m: Floats, values: Floats, depth_m: float) -> float:
    """Return the mean down to a depth (m) of what is linear between depths (n,), m."""
    if not 0.0 <= depth_m < np.inf:
        refuse("depth (m)", depth_m, "be finite and not below 0", "count metres downwards")
    if depth_m < SHALLOWEST_M:
        return float(np.interp(0.0, depths_m, values))
    inner = depths_m[(depths_m > 0.0) & (depths_m < depth_m)]
    depths = np.concatenate(([0.0], inner, [depth_m]))
    return float(np.trapezoid(np.interp(depths, depths_m, values), depths) / depth_m)


def uniform_profile(speed_m_per_s: float) -> Profile:
    """Return water in which sound is as fast at all depths."""
    return Profile(np.zeros(1), np.full(1, speed_m_per_s))


Law = Literal["mackenzie", "medwin", "teos10"]

# Depths (m) at which water that is the same all the way is looked at: speeds are so nearly linear
# in depth that these tell them to 2 mm/s (0.02 mm/s above 200 m).
DEPTHS_M = np.concatenate((np.arange(0.0, 200.0, 20.0), np.arange(200.0, 12_001.0, 200.0)))


@dataclass(frozen=True)
class Column:
    """Water down to a depth (m): of one temperature (degC) and salinity (psu), or that of a cast.

    A law makes speeds of sound of them, `teos10` at a latitude and longitude (deg).
    """

    deepest_m: float
    temperature_c: float | None = None
    salinity_psu: float = USUAL_WATER.salinity_psu
    cast_file: str | None = None
    law: Law = "mackenzie"
    place_deg: tuple[float, float] | None = None

    def profile(self) -> Profile:
        """Return the speed of sound over depth.

        Raises:
            ValueError: when the cast cannot be read or ends above the depth, naming the file.
            ImportError: without gsw, for the law teos10.
        """
        if self.temperature_c is not None:
            same = np.ones_like(DEPTHS_M)
            warm, salt = self.temperature_c * same, self.salinity_psu * same
            return Profile(DEPTHS_M, self._speeds(warm, salt, DEPTHS_M))
        cast = self._cast()
        if cast.speeds_m_per_s is not None:
            return Profile(cast.depths_m, cast.speeds_m_per_s)
        assert cast.temperatures_c is not None
        assert cast.salinities_psu is not None
        speeds = self._speeds(cast.temperatures_c, cast.salinities_psu, cast.depths_m)
        return Profile(cast.depths_m, speeds)

    def water(self) -> Water:
        """Return the water on the way down (raises ValueError as :meth:`profile`).

        Of a cast, the means; of one that holds speeds of sound alone, the usual water.
        """
        if self.temperature_c is not None:
            return Water(self.temperature_c, self.salinity_psu, self.deepest_m)
        cast = self._cast()
        if cast.temperatures_c is None or cast.salinities_psu is None:
            return USUAL_WATER
        warm = mean_over(cast.depths_m, cast.temperatures_c, self.deepest_m)
        salt = mean_over(cast.depths_m, cast.salinities_psu, self.deepest_m)
        return Water(warm, salt, self.deepest_m)

    def _cast(self) -> Cast:
        assert self.cast_file is not None
        cast = read_cast(self.cast_file)
        end = float(cast.depths_m[-1])
        if end < self.deepest_m:
            raise ValueError(
                f"{self.cast_file}: ends at {end:g} m, above the survey at {self.deepest_m:g} m; "
                "add samples down to it"
            )
        return cast

    def _speeds(self, warm: Floats, salt: Floats, deep: Floats) -> Floats:
        if self.law == "teos10":
            assert self.place_deg is not None
            return sound_speed_teos10(warm, salt, deep, self.place_deg)
        law = sound_speed if self.law == "mackenzie" else sound_speed_medwin
        return law(warm, salt, deep)
