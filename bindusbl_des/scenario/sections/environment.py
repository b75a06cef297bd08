"""The keys of the water: sound in it, its currents, its place on Earth."""

from typing import Any, Literal

from pydantic import Field, field_validator

from ..key_types import PAPER, Part, Real, Text, key


class Origin(Part):
    """Where on Earth x = y = 0 (WGS-84); +x is north there, +y east."""

    lat_deg: Real | None = key(
        None,
        "deg",
        "latitude where x = y = 0, for places in degrees and exports; null = nowhere",
        ge=-90,
        le=90,
    )
    lon_deg: Real | None = key(
        None, "deg", "longitude where x = y = 0, positive to the east", ge=-180, le=180
    )

    @property
    def coordinates(self) -> tuple[float, float] | None:
        """Latitude and longitude (deg), None for a survey that is nowhere in particular."""
        if self.lat_deg is None or self.lon_deg is None:
            return None
        return self.lat_deg, self.lon_deg


class Environment(Part):
    """The water: how fast sound travels in it, how it moves, and where it is."""

    sound_speed_m_per_s: Real = key(1500.0, "m/s", "speed of sound c", PAPER, ge=1300, le=1700)
    temperature_c: Real | None = key(
        None,
        "degC",
        "temperature of the water, from which the speed of sound follows; null = that is given",
        ge=-10,
        le=50,
    )
    salinity_psu: Real = key(35.0, "psu", "salinity of the water, with temperature_c", ge=0, le=60)
    ctd: Text | None = key(
        None,
        "",
        "CSV of a CTD profile, from which the speed of sound follows: depth_m with temperature_c "
        "and salinity_psu, or with sound_speed_m_per_s",
    )
    sound_speed_law: Literal["mackenzie", "medwin", "teos10"] = key(
        "mackenzie",
        "",
        "law by which it follows; teos10 needs origin, and the package gsw",
        "Mackenzie 1981, Medwin 1975, TEOS-10",
    )
    assumed_sound_speed_m_per_s: Real | None = key(
        None,
        "m/s",
        "speed of sound that ranges, directions and slots are worked out with; null = the true one",
        ge=1300,
        le=1700,
    )
    current_m_per_s: Real = key(0.0, "m/s", "speed of the uniform current", ge=0, le=10)
    current_variation_m_per_s: Real = key(
        0.0, "m/s", "standard deviation of the current's slow variation per axis", ge=0, le=10
    )
    current_variation_time_s: Real = key(
        600.0, "s", "time constant of that variation (Gauss-Markov)", ge=1, le=1e6
    )
    current_direction_deg: Real = key(
        0.0, "deg", "direction the current flows to, from +x to +y", ge=-360, le=360
    )
    origin: Origin = Field(default=Origin(), description="the survey's place on Earth")

    @field_validator("origin", mode="before")
    @classmethod
    def _nowhere(cls, origin: Any) -> Any:
        """Read `origin: null` as no origin."""
        return {} if origin is None else origin
