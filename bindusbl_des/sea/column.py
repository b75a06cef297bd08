"""The water down to a depth as it is known: the same all the way, or as a cast found it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .cast import Cast, read_cast
from .profile import Profile, mean_over
from .teos10 import sound_speed_teos10
from .water import USUAL_WATER, Water, sound_speed, sound_speed_medwin

Floats = NDArray[np.float64]
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
