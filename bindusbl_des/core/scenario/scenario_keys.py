"""All keys of a scenario, section by section.

A mission as its planner describes it: frozen and validated, with units in the names of the keys. It
is plain data and knows nothing of files, clocks or random numbers: the same scenario with the same
seed is the same mission.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from ...support.plain_data import LONGEST_NAME
from .families import CURRENT
from .key_types import (
    PAPER,
    Part,
    Real,
    Text,
    Whole,
    angle_of,
    key,
    or_text,
)
from .part_choice import SET, PartChoice
from .sections.acoustics import Acoustics
from .sections.navigation import Navigation
from .sections.protocol import Protocol
from .sections.survey import Duration, Survey
from .sections.usbl import UsblSection
from .sections.vehicles import Asvs, Auvs


class Origin(Part):
    """Where on Earth x = y = 0 is (WGS-84); there +x is north and +y east."""

    lat_deg: Annotated[Real | None, angle_of("NS"), or_text(90, "null")] = key(
        None,
        "deg",
        "latitude where x = y = 0, for positions in degrees and exports; null = not on Earth",
        ge=-90,
        le=90,
    )
    lon_deg: Annotated[Real | None, angle_of("EW"), or_text(180, "null")] = key(
        None, "deg", "longitude where x = y = 0, positive to the east", ge=-180, le=180
    )

    @property
    def coordinates(self) -> tuple[float, float] | None:
        """Latitude and longitude (deg); None without a position on Earth."""
        if self.lat_deg is None or self.lon_deg is None:
            return None
        return self.lat_deg, self.lon_deg


class Wind(Part):
    """The wind over the survey, at the height of the sails; it moves vessels that sail."""

    speed_m_per_s: Real = key(0.0, "m/s", "mean speed of the wind", ge=0, le=60)
    from_deg: Real = key(
        0.0, "deg", "direction it blows from on average, from +x to +y", ge=-360, le=360
    )
    gust_sd_m_per_s: Real = key(
        0.0, "m/s", "standard deviation of its speed (Gauss-Markov)", ge=0, le=30
    )
    veer_sd_deg: Real = key(
        0.0, "deg", "standard deviation of its direction (Gauss-Markov)", ge=0, le=90
    )
    gust_time_s: Real = key(30.0, "s", "time constant of gusts and veering", ge=1, le=1e6)
    file: Text | None = key(
        None,
        "",
        "CSV of the mean wind, linear between samples: time_s, speed_m_per_s, from_deg; null = "
        "that is constant",
    )


class Bathymetry(Part):
    """The bottom: a plane by depth and slope, or a chart of depths or heights in a file.

    In a file of a scenario it may also be a number, which is `depth_m`, or a text, which is `file`.
    """

    depth_m: Real | None = key(
        None, "m", "depth of the bottom at x = y = 0; null = as the file says", ge=0.1, le=12_000
    )
    slope_deg: Real = key(0.0, "deg", "angle at which that bottom falls away", ge=0, le=60)
    slope_towards_deg: Real = key(
        0.0, "deg", "direction in which it gets deeper, from +x to +y", ge=-360, le=360
    )
    file: Text | None = key(
        None,
        "",
        "chart of the bottom: GeoTIFF or another grid that GDAL reads, NetCDF (GEBCO, EMODnet), or "
        "text with a position and a depth or height a line (.xyz, .csv, .txt); relative to the "
        "scenario file",
    )
    crs: Text | None = key(
        None,
        "",
        "code of the grid of the file, such as EPSG:32760, EPSG:4326 for degrees, or `local` for "
        "metres east and north of x = y = 0; null = as the file says",
    )
    positive: Literal["down", "up"] | None = key(
        None,
        "",
        "down: the file has depths; up: heights, with the zero of surface_m; null = as the file "
        "says, or as its numbers show, if all have one sign",
    )


class Environment(Part):
    """The water: speed of sound, current, bottom, surface height, position on Earth; the wind."""

    sound_speed_m_per_s: Real = key(1500.0, "m/s", "speed of sound c", PAPER, ge=1300, le=1700)
    temperature_c: Real | None = key(
        None,
        "degC",
        "temperature of the water, which gives the speed of sound; null = sound_speed_m_per_s",
        ge=-10,
        le=50,
    )
    salinity_psu: Real = key(35.0, "psu", "salinity of the water, with temperature_c", ge=0, le=60)
    ctd: Text | None = key(
        None,
        "",
        "CSV of a CTD profile, which gives the speed of sound: depth_m with temperature_c and "
        "salinity_psu, or with sound_speed_m_per_s",
    )
    sound_speed_law: Literal["mackenzie", "medwin", "teos10"] = key(
        "mackenzie",
        "",
        "law of the speed of sound; teos10 needs origin, and the package gsw",
        "Mackenzie 1981, Medwin 1975, TEOS-10",
    )
    assumed_sound_speed_m_per_s: Real | None = key(
        None,
        "m/s",
        "speed of sound assumed for ranges, directions and slots; null = the true one",
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
    current: PartChoice = key(
        "uniform",
        "",
        "what is added to that current and differs from place to place or with time" + SET,
    )
    bathymetry: Bathymetry | None = Field(
        default=None,
        description="the bottom, for altitudes, bottom lock, and ways that must not meet it; a "
        "number is its depth, a text its file; null, unless one of its keys is given = it is "
        "nowhere near",
    )
    wind: Wind | None = Field(
        default=None,
        description="the wind, which moves vessels that sail; null, unless one of its keys is "
        "given = it is calm",
    )
    surface_m: Real = key(
        0.0,
        "m",
        "height of the water's surface, as of a lake: depths are below it; heights in tracks, "
        "poses and exports have the same zero (the ellipsoid, or the sea)",
        ge=-500,
        le=9000,
    )
    origin: Origin = Field(default=Origin(), description="the survey's place on Earth")

    @property
    def has_field(self) -> bool:
        """Whether the current differs from place to place, or with time as a tide does."""
        return not CURRENT.declared(self.current).is_uniform

    @field_validator("current", mode="before")
    @classmethod
    def _of_a_file(cls, current: Any) -> Any:
        """Read `current: {file: ...}` as the part that reads files."""
        if isinstance(current, Mapping) and "file" in current and "model" not in current:
            return {"model": next(iter(CURRENT.having(lambda kind: kind.of_a_file))), **current}
        return current

    @field_validator("bathymetry", mode="before")
    @classmethod
    def _in_short(cls, given: Any) -> Any:
        """Read a number as the depth of a flat bottom, and a text as its file."""
        if isinstance(given, str):
            return {"file": given}
        is_number = isinstance(given, int | float) and not isinstance(given, bool)
        return {"depth_m": given} if is_number else given

    @field_validator("origin", mode="before")
    @classmethod
    def _nowhere(cls, origin: Any) -> Any:
        """Read `origin: null` as no origin."""
        return {} if origin is None else origin


class Traffic(Part):
    """Data packets that AUVs send to the ASVs behind their pings."""

    bytes: Whole = key(64, "B", "size of a packet", ge=1, le=65_535)
    every_s: Real = key(
        20.0, "s", "time, or mean time, between packets of an AUV", ge=0.001, le=1e6
    )
    arrivals: Literal["periodic", "poisson"] = key(
        "periodic", "", "packets are made at multiples of every_s from 0 on, or at Poisson instants"
    )


class Modems(Part):
    """Modems of all vehicles, whose host computers say what they send (`live --to seatrac:...`)."""

    make: Literal["seatrac", "evologics"] = key("seatrac", "", "manufacturer of the modems")
    lines: Text | None = key(
        None, "",
        "file of the hosts' lines: a result's table `modem_lines` (.parquet), or CSV with "
        "time_s, vehicle, line; null = only those of a live session",
    )  # fmt: skip


class Record(Part):
    """What a mission records, at which rates."""

    tracks_hz: Real = key(2.0, "Hz", "rate of the rows in `tracks`", ge=1e-6, le=1e3)
    metrics_hz: Real = key(
        6.0, "Hz", "rate at which time means are sampled (the paper: 30)", ge=1e-6, le=1e3
    )
    metrics_from_s: Real = key(
        0.0, "s", "instant from which metrics of errors, pings and fixes are taken", ge=0
    )
    detail: Literal["full", "summary"] = key("full", "", "record every event, or metrics only")


class ScenarioKeys(Part):
    """All keys of a scenario, each within its range; :class:`.scenario.Scenario` adds agreement."""

    name: Text = Field(min_length=1, max_length=LONGEST_NAME, description="name of the scenario")
    duration_s: Duration = key(
        300.0, "s", "length of the mission; `survey`: until all AUVs have flown their lanes", PAPER
    )
    survey: Survey = Field(default=Survey(), description="the survey area")
    auvs: Auvs = Field(default=Auvs(), description="underwater vehicles")
    asvs: Asvs = Field(default=Asvs(), description="surface vessels")
    environment: Environment = Field(default=Environment(), description="the water")
    acoustics: Acoustics = Field(default=Acoustics(), description="acoustic bands")
    protocol: Protocol = Field(default=Protocol(), description="medium access")
    usbl: UsblSection = Field(default=UsblSection(), description="USBL measurement")
    navigation: Navigation = Field(default=Navigation(), description="AUV navigation")
    traffic: Traffic | None = Field(
        default=None,
        description="data packets of AUVs, each behind a ping; null, unless one of its keys is "
        "given = AUVs have none",
    )
    modems: Modems | None = Field(
        default=None,
        description="modems on a wire; null, unless one of its keys is given = vehicles have none",
    )
    record: Record = Field(default=Record(), description="what is recorded")
