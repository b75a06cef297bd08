"""The USBL instrument of a vessel: its array, and the noise of everything that it measures."""

import math
from dataclasses import dataclass, field

import numpy as np

from ..records.rows import Rows
from ..vehicles.motion import Floats
from .array import scatter
from .instrument import LEVELS, HandedInstrument, Instrument, locate
from .sheet import NO_SHEET, Sheet
from .vectors import Vector


@dataclass(frozen=True)
class Usbl:
    """A USBL instrument: its array and the noise of everything it measures (SI, radians).

    Ranges and directions are computed with `sound_speed`; the true one is `true_sound_speed`, None
    if they are the same.  A `sheet` stands in the place of array, TDOAs and travel time.
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
    metric: Floats = field(init=False, repr=False)
    levels: Rows = field(init=False, repr=False)  # (1,)

    def __post_init__(self) -> None:
        levels = np.zeros(1, dtype=LEVELS)
        levels[0] = (
            self.sound_speed,
            self.sound_speed if self.true_sound_speed is None else self.true_sound_speed,
            element_sd(self.tdoa_sd),
            element_sd(self.tdoa_sd, self.quantum),
            self.travel_time_sd,
            self.quantum,
            range_sd(self.travel_time_sd, self.quantum, self.sound_speed, ways=1),
            self.gnss_sd,
            self.attitude_sd,
            self.timing_sd,
            *(NO_SHEET if self.sheet is None else self.sheet.levels),
        )
        metric = scatter(self.array)
        if self.sheet is not None:
            timing_sd = self.sheet.path_sd / self.sound_speed
            known = {"travel_time_sd_s": timing_sd, "range_sd_m": self.sheet.path_sd}
            for name, value in {"quantum_s": 0.0, **known}.items():
                levels[name] = value
            metric = np.eye(3)  # a sound speed taken for another turns no direction
        object.__setattr__(self, "levels", levels)  # derived once, then frozen
        object.__setattr__(self, "metric", metric)

    @property
    def handed(self) -> HandedInstrument:
        """The instrument as compiled code is handed it once."""
        return HandedInstrument(np.ascontiguousarray(self.array), self.metric, self.levels)

    @property
    def has_sheet(self) -> bool | None:
        """Whether there is a data sheet, as of :class:`Instrument`."""
        return None if self.sheet is None else True

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
        instrument = Instrument(self.array, self.metric, self.levels[0], self.has_sheet)
        places: tuple[Vector, Vector] = tuple(source.tolist()), tuple(vessel.tolist())
        return locate(*places, yaw, travel_time, snr_db, noise, instrument)


def element_sd(tdoa_sd: float, quantum: float = 0.0, elements: int = 5) -> float:
    """Return the noise (s) of one element that has the effect of TDOA pair noise and quantisation.

    Independent element noise sigma_t gives pairs sqrt(2) sigma_t; the rounding errors of the
    n (n - 1) / 2 pairs average out over n pairs per element (physics: T^T T = n M).

    >>> round(element_sd(2.60296781e-7) * 1e6, 6)
    0.184058
    """
    return math.sqrt(tdoa_sd**2 / 2 + quantum**2 / 12 / elements)


def range_sd(travel_time_sd: float, quantum: float, sound_speed: float, ways: int) -> float:
    """Return the noise (m) of a range from a travel time over one way or there and back (2).

    >>> round(range_sd(6.66667e-6, 0.0, 1500.0, ways=2), 6)
    0.005
    """
    return sound_speed / ways * math.sqrt(travel_time_sd**2 + quantum**2 / 12)
