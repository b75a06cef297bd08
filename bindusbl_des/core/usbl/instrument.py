"""The USBL of a vessel: its array and all its noise, or a data sheet's."""

import math
from collections.abc import Sequence
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
    """Return the figures of an instrument's data sheet; None if it has none.

    The error of a stated range is that of one ASV by itself.  If an ASV `calls`, its range is half
    the path of call and answer, so the path's error is twice as large.
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
    """A USBL instrument: its array and the noise of all that it measures (SI, radians).

    It assumes `sound_speed`; the true one is `true_sound_speed`, None if they are the same.  A
    `sheet` replaces array, TDOAs and travel time.  Of the variance of each acoustic error a share
    `slow_share` is slow (:mod:`.slow_errors`).
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
            metric = np.eye(3)  # a wrong sound speed does not rotate a stated direction
        object.__setattr__(self, "levels", levels)  # derived once, then frozen
        object.__setattr__(self, "metric", metric)

    @property
    def packed(self) -> PackedInstrument:
        """The instrument in its packed form for compiled code."""
        return packed([self])

    def locate(
        self,
        source: Floats,
        vessel: Floats,
        yaw: float,
        travel_time: float,
        noise: Floats,
        snr_db: float = math.nan,
    ) -> tuple[Floats, Floats]:
        """Return the fix (3,), m, of one ping and its covariance (3, 3), m2; see :func:`locate`."""
        instrument = Instrument(self.array, self.metric, self.levels[0])
        places: tuple[Vector, Vector] = tuple(source.tolist()), tuple(vessel.tolist())
        return locate(*places, yaw, travel_time, snr_db, noise, instrument)

    def level_sds(self) -> tuple[float, float]:
        """Return the noise (rad) of bearing and elevation of a source at the array's depth, at its
        worst azimuth, without that of the AHRS; of a sheet the stated noise (0 if it states
        positions).

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
        """Return the noise (m) of a short range by a travel time there (`ways` 1) or there and back
        (2); of a sheet without the part that grows with range.

        >>> round(Usbl(np.eye(3), 0.0, 6.66667e-6, 0.0, (0.0,) * 3, 0.0, 1500.0).range_sd(2), 6)
        0.005
        """
        if self.sheet is not None:
            return hypot(self.sheet.path_sd / ways, self.sheet.spread_sd)
        return self.sound_speed / ways * stepped_sd(self.travel_time_sd, self.quantum)


def packed(usbls: Sequence[Usbl]) -> PackedInstrument:
    """Return instruments, one for each carrier, in their packed form for compiled code.

    Arrays have as many elements each; those of data sheets are not used.
    """
    elements = next((usbl.array for usbl in usbls if usbl.sheet is None), usbls[0].array)
    arrays = [elements if usbl.sheet is not None else usbl.array for usbl in usbls]
    return PackedInstrument(
        np.stack(arrays),
        np.stack([usbl.metric for usbl in usbls]),
        np.concatenate([usbl.levels for usbl in usbls]),
    )


def element_sd(tdoa_sd: float) -> float:
    """Return the noise (s) of one element from the noise of the TDOA of a pair, which has two
    independent elements.

    >>> round(element_sd(2.60296781e-7) * 1e6, 6)
    0.184058
    """
    return tdoa_sd / sqrt(2.0)


def stepped_sd(travel_time_sd: float, quantum: float) -> float:
    """Return the noise (s) of a travel time by a clock with steps of a `quantum` (s).

    The arrival within a step is random, since clocks are not synchronised with pings: a step adds
    quantum^2 / 12 of variance, and no bias.  Source: B. Widrow, I. Kollar, Quantization Noise,
    2008, sec. 4.
    """
    return hypot(travel_time_sd, quantum / sqrt(12.0))
