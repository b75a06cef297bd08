"""A column of water: the speed of sound at each depth, by a law or from a CTD profile.

A profile has conductivity, temperature and depth, or the speed of sound, read from CSV.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from ...support.tables import TableRow, because, left_out, of_file, ordered, read_table, sifted
from ...support.wording import refuse
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

# What instruments call these: Sea-Bird in a .cnv, SonTek's CastAway and others in headers.
ALSO = {
    "depth_m": r"dep[SF]M|depth\s*[\[(]\s*m(et(er|re)s?)?\s*[\])]",
    "temperature_c": r"t[nv]?\d*C|temp(erature)?\s*[\[(]\s*(deg\s*|°)?c(elsius)?\s*[\])]",
    "salinity_psu": r"sal\d\d|salinity(\s*[\[(].*[\])])?",
    SPEED: r"sv[CDW]M|sound\s*(velocity|speed)\s*[\[(]\s*(m/s|meters per second)\s*[\])]",
}

# So far (m) above the water a sample may be that was taken before the instrument went in.
ABOVE_M = 1.0


class Cast(NamedTuple):
    """Samples of a cast, by increasing depth (n,), m: temperature (n,), degC, salinity (n,), psu,
    speed of sound (n,), m/s; what was not measured is None.  `left_out` are sentences about rows
    that do not count.
    """

    depths_m: Floats
    temperatures_c: Floats | None
    salinities_psu: Floats | None
    speeds_m_per_s: Floats | None
    left_out: tuple[str, ...] = ()


@of_file(16)
def read_cast(path: str) -> Cast:
    """Return the samples of a cast.

    The file has a header line with the columns depth_m and sound_speed_m_per_s, or depth_m,
    temperature_c and salinity_psu, or all of them, in any order; further columns are ignored.  It
    may be a .cnv of Sea-Bird, or a CSV of a CastAway.  Samples above the water, and samples not
    deeper than one before them, are left out.

    Raises:
        ValueError: naming file, line and remedy, when the file is not such a cast.
    """
    table = read_table(path)
    columns = {name: there for name in LIMITS if (there := _called(name, table.names))}
    has_water = all(name in columns for name in WATER)
    if "depth_m" not in columns or not (has_water or SPEED in columns):
        pressure = any(name.lower().startswith("pr") for name in table.names)
        remedy = " (with SBE Data Processing, Derive, depths from pressures)" if pressure else ""
        raise ValueError(
            f"{path}:1: has the columns {', '.join(table.names)}; it needs {COLUMNS}{remedy}"
        )
    columns = {name: there for name, there in columns.items() if has_water or name not in WATER}
    read, unread = sifted(table.rows(), partial(_sample, columns))
    under = [(place, sample) for place, sample in read if sample[0] >= 0.0]
    dry = left_out([f"{where} is above the water" for where, (z, *_) in read if z < 0.0], len(read))
    if len(under) < 2:
        few = f"{path}: has {len(under)} samples; a CTD profile needs at least two"
        raise ValueError(few + because(unread + dry))
    places, depths = [where for where, _ in under], [sample[0] for _, sample in under]
    remedy = "; keep the way down, or the way up turned around"
    deeper, others = ordered(places, depths, "depth_m", "m", remedy)
    samples = np.array([under[n][1] for n in deeper])
    samples.setflags(write=False)
    known = dict(zip(columns, samples.T, strict=True))
    warm, salt, speed = (known.get(name) for name in (*WATER, SPEED))
    told = (*table.left_out, *unread, *dry, *others)
    return Cast(known["depth_m"], warm, salt, speed, told)


def _called(name: str, there: Sequence[str]) -> str:
    """Return the name, of the columns `there`, of the column that we call `name`; "" if there is
    none.
    """
    if name in there:
        return name
    return next((also for also in there if re.fullmatch(ALSO[name], also, re.IGNORECASE)), "")


def _sample(columns: Mapping[str, str], row: TableRow) -> tuple[str, list[float]]:
    return row.where, [
        row.number(there, LIMITS[name], name, slack=ABOVE_M if name == "depth_m" else 0.0)
        for name, there in columns.items()
    ]


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
    """Return the mean speed (m/s) of sound from the surface to a depth (m) on a straight path.

    That is the harmonic mean: depth over travel time, at any slope of the path, as time is the
    integral of 1 / c.  At no depth it is the speed at the surface.  Bending of rays is left out.

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
    """Return how long (s) sound takes through layers (m) of linear speed, `above` to `below`
    (m/s).
    """
    rise = (below - above) / above
    # log1p(x) / x, which is 1 for x = 0
    shorter = np.divide(np.log1p(rise), rise, out=np.ones_like(rise), where=rise != 0.0)
    return np.asarray(thickness_m / above * shorter)


def mean_over(depths_m: Floats, values: Floats, depth_m: float) -> float:
    """Return the mean from the surface to a depth (m) of `values` (n,) that are linear between
    depths (n,), m.
    """
    if not 0.0 <= depth_m < np.inf:
        refuse("depth (m)", depth_m, "be finite and not below 0", "count metres downwards")
    if depth_m < SHALLOWEST_M:
        return float(np.interp(0.0, depths_m, values))
    inner = depths_m[(depths_m > 0.0) & (depths_m < depth_m)]
    depths = np.concatenate(([0.0], inner, [depth_m]))
    return float(np.trapezoid(np.interp(depths, depths_m, values), depths) / depth_m)


def uniform_profile(speed_m_per_s: float) -> Profile:
    """Return the profile of water in which sound has one speed (m/s) at all depths."""
    return Profile(np.zeros(1), np.full(1, speed_m_per_s))


Law = Literal["mackenzie", "medwin", "teos10"]

# Depths (m) at which water of one temperature and salinity is sampled: between them speeds are
# linear within 2 mm/s (0.02 mm/s above 200 m).
DEPTHS_M = np.concatenate((np.arange(0.0, 200.0, 20.0), np.arange(200.0, 12_001.0, 200.0)))


@dataclass(frozen=True)
class Column:
    """Water down to a depth (m): of one temperature (degC) and salinity (psu), or of a cast.

    A law makes speeds of sound of these, `teos10` at a latitude and longitude (deg).
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
        """Return the mean temperature and salinity down to the depth (raises ValueError as
        :meth:`profile`).

        Of a cast that has speeds of sound alone, the usual water.
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
