"""The USBL of a vessel: its array, the noise of all that it measures, by a data sheet too, and what
the ASVs that heard a ping make of it together.
"""

import math
from dataclasses import dataclass, field
from math import hypot, nan, radians, sqrt
from typing import cast

import numpy as np

from ...support.arrays import Floats
from ...support.spreads import per_axis_sd
from ..records.rows import Rows
from ..scenario.families import INSTRUMENT
from ..scenario.part_choice import settings_of
from ..scenario.shipped_settings import Datasheet
from .array import Vector, scatter
from .measuring import (
    LEVELS,
    NO_SHEET,
    Instrument,
    PackedInstrument,
    Sheet,
    across_by_array,
    locate,
)


def sheet_of(model: str, calls: bool) -> Sheet | None:
    """Return what the data sheet of an instrument states; None if it has none.

    A stated range is that of who finds it by himself: of the path of a call and its answer he takes
    half, so that the path errs twice as much.
    """
    if not INSTRUMENT.declared(model).is_stated:
        return None
    stated = cast(Datasheet, settings_of(INSTRUMENT, model))
    if stated.bearing_sd_deg is None:
        return Sheet(
            spread_sd=per_axis_sd(stated.accuracy_m, stated.statistic),
            spread_share=per_axis_sd(stated.accuracy_percent / 100.0, stated.statistic),
        )
    bearing, elevation = stated.bearing_sd_deg, stated.elevation_sd_deg
    return Sheet(
        radians(bearing),
        radians(bearing if elevation is None else elevation),
        path_sd=(2.0 if calls else 1.0) * stated.range_sd_m,
        path_share=stated.range_sd_percent / 100.0,
        reference_snr_db=nan if stated.reference_snr_db is None else stated.reference_snr_db,
        angle_floor=radians(stated.angle_floor_deg),
    )


@dataclass(frozen=True)
class Usbl:
    """A USBL instrument: its array and the noise of everything it measures (SI, radians).

    Ranges and directions are computed with `sound_speed`; the true one is `true_sound_speed`, None
    if they are the same.  A `sheet` stands in the place of array, TDOAs and travel time.  Of the
    variance of each acoustic error `slow_share` is known to change slowly (:mod:`.slow_errors`).
    """

    array: Floats
    tdoa_sd: float
    travel_time_sd: float
    quantum: float
    attitude_sd: tuple[float, float, float]
    gnss_sd: float
    sound_speed: float
    true_sound_speed: float | None = None
    sheet: Sheet | None = None
    timing_sd: float = 0.0
    slow_share: float = 0.0
    metric: Floats = field(init=False, repr=False)
    levels: Rows = field(init=False, repr=False)  # (1,)

    def __post_init__(self) -> None:
        levels = np.zeros(1, dtype=LEVELS)
        levels[0] = (
            self.sound_speed,
            self.sound_speed if self.true_sound_speed is None else self.true_sound_speed,
            element_sd(self.tdoa_sd),
            stepped_sd(self.travel_time_sd, self.quantum),
            self.gnss_sd,
            self.attitude_sd,
            self.timing_sd,
            self.slow_share,
            *(NO_SHEET if self.sheet is None else self.sheet.levels),
        )
        metric = scatter(self.array)
        if self.sheet is not None:
            levels["travel_time_sd_s"] = self.sheet.path_sd / self.sound_speed
            metric = np.eye(3)  # a sound speed taken for another turns no direction
        object.__setattr__(self, "levels", levels)  # derived once, then frozen
        object.__setattr__(self, "metric", metric)

    @property
    def packed(self) -> PackedInstrument:
        """The instrument as compiled code is handed it once."""
        return PackedInstrument(np.ascontiguousarray(self.array), self.metric, self.levels)

    def locate(
        self,
        source: Floats,
        vessel: Floats,
        yaw: float,
        travel_time: float,
        noise: Floats,
        snr_db: float = math.nan,
    ) -> tuple[Floats, Floats]:
        """Measure one ping; see :func:`locate`."""
        instrument = Instrument(self.array, self.metric, self.levels[0])
        places: tuple[Vector, Vector] = tuple(source.tolist()), tuple(vessel.tolist())
        return locate(*places, yaw, travel_time, snr_db, noise, instrument)

    def level_sds(self) -> tuple[float, float]:
        """Return the noise (rad) of bearing and elevation of a level source, from where it is
        largest, without that of the AHRS; by a sheet as that states them (0: as an error of the
        place alone).

        >>> from bindusbl_des.core.usbl.array import ARRAYS
        >>> named = Usbl(ARRAYS["cross5"], 2.6e-7, 0.0, 0.0, (0.0, 0.0, 0.0), 0.0, 1500.0)
        >>> [round(math.degrees(sd), 3) for sd in named.level_sds()]
        [0.372, 0.372]
        """
        levels = self.levels[0]
        if self.sheet is not None:
            return float(levels["bearing_sd_rad"]), float(levels["elevation_sd_rad"])
        sd, worst = self.sound_speed * levels["element_sd_s"], np.zeros(2)
        for azimuth in np.radians(range(0, 360, 5)):
            source = math.cos(azimuth), math.sin(azimuth), 0.0
            across = across_by_array(source, np.eye(3), self.metric, sd)
            worst = np.maximum(worst, (across.scale * across.d, across.scale * across.a))
        return sqrt(worst[0]), sqrt(worst[1])

    def range_sd(self, ways: int) -> float:
        """Return the noise (m) of a short range from a travel time over one way, or there and back
        (2); by a sheet without what grows with the range.

        >>> round(Usbl(np.eye(3), 0.0, 6.66667e-6, 0.0, (0.0,) * 3, 0.0, 1500.0).range_sd(2), 6)
        0.005
        """
        if self.sheet is not None:
            return hypot(self.sheet.path_sd / ways, self.sheet.spread_sd)
        return self.sound_speed / ways * stepped_sd(self.travel_time_sd, self.quantum)


def element_sd(tdoa_sd: float) -> float:
    """Return the noise (s) of one element that has the effect of TDOA pair noise: of two elements,
    each by itself, it makes a pair.

    >>> round(element_sd(2.60296781e-7) * 1e6, 6)
    0.184058
    """
    return tdoa_sd / sqrt(2.0)


def stepped_sd(travel_time_sd: float, quantum: float) -> float:
    """Return the noise (s) of a travel time by a clock that goes on by a `quantum` (s) at a time.

    Where between two of its steps a ping arrives is anybody's guess, and another one each time, for
    nobody has set it by the pings: a step adds quantum^2 / 12 of variance, and no bias.  Source: B.
    Widrow, I. Kollar, Quantization Noise, 2008, sec. 4.
    """
    return hypot(travel_time_sd, quantum / sqrt(12.0))
