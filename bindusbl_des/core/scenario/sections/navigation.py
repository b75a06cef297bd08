"""The keys of navigation: errors of dead reckoning, and how fixes correct it."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    AfterValidator,
    Field,
    ModelWrapValidatorHandler,
    Strict,
    WithJsonSchema,
    field_validator,
    model_validator,
)

from ....models.presets.catalogue import CATALOGUE, preset
from ....support.spreads import Statistic
from ..families import NAVIGATOR, PEERS, PeerTraits
from ..key_types import PAPER, Moved, Part, Point, Real, Section, key, known_preset
from ..part_choice import SET, PartChoice
from ..shipped_settings import FixedGain

SECONDS_PER_HOUR = 3600.0


INERTIALS = [entry.name for entry in CATALOGUE["inertial"]]


InertialName = Annotated[
    str,
    Strict(),
    AfterValidator(partial(known_preset, "inertial")),
    WithJsonSchema({"type": "string", "enum": INERTIALS}),
]


class Drift(Part):
    """The drift of dead reckoning as an inertial system's data sheet states it."""

    preset: InertialName | None = key(
        None,
        "",
        "inertial system whose data sheet (`bindusbl-des presets inertial`) sets the keys "
        "here that are not given",
    )
    percent_of_distance: Real | None = key(
        None,
        "%",
        "position error after a straight path without fixes, in percent of its length (the "
        "default bias and walk give 13.5 % RMS in 300 s)",
        gt=0,
        le=20,
    )
    m_per_hour: Real | None = key(
        None,
        "m/h",
        "position error per hour without fixes, instead",
        gt=0,
        le=1e5,
    )
    statistic: Statistic = key(
        "cep",
        "",
        "meaning of the stated error: the circle of 50 % or 95 % of all errors, or their RMS",
    )
    line_m: Real | None = key(
        1000.0,
        "m",
        "length of the straight path at whose end the error is met, and over which scale and "
        "heading errors decorrelate, so that a filter has to keep estimating them; null = "
        "constant for the mission",
        ge=1,
        le=1e7,
    )
    time_constant_s: Real | None = key(
        None,
        "s",
        "time constant of scale and heading errors (Gauss-Markov); null = the time of that path",
        ge=1,
        le=1e7,
    )

    @model_validator(mode="wrap")
    @classmethod
    def _as_its_sheet_says(cls, data: Any, validate: ModelWrapValidatorHandler["Drift"]) -> "Drift":
        """Let the preset's figures replace defaults; they do not count as given."""
        name = data.get("preset") if isinstance(data, dict) else None
        if name not in INERTIALS:
            return validate(data)
        drift = validate({**preset("inertial", name).values, **data})
        object.__setattr__(drift, "__pydantic_fields_set__", set(data))
        return drift

    @property
    def is_stated(self) -> bool:
        """Whether a data sheet is given."""
        return self.percent_of_distance is not None or self.m_per_hour is not None

    @property
    def words(self) -> str:
        """The statement of the sheet in words."""
        share, rate = self.percent_of_distance, self.m_per_hour
        what = f"{rate:g} m per hour" if share is None else f"{share:g} % of distance"
        return f"{what} ({self.statistic})"

    def off_m(self, way: float, time: float) -> float:
        """Return the stated error (m) after a distance `way` (m) that takes `time` (s)."""
        if self.percent_of_distance is not None:
            return self.percent_of_distance / 100.0 * way
        return (self.m_per_hour or 0.0) / SECONDS_PER_HOUR * time


class GnssFixSection(Part):
    """The GNSS receiver of each AUV, which gives fixes while the AUV is at the surface."""

    depth_m: Real = key(0.5, "m", "largest depth at which an AUV gets GNSS fixes", ge=0, le=100)
    sd_m: Real = key(2.0, "m", "standard deviation per axis of a fix, white noise", ge=0, le=1e3)
    every_s: Real = key(1.0, "s", "time between GNSS fixes at the surface", ge=0.01, le=1e6)


class PeersSection(Part):
    """AUVs that range each other by messages on HF, and correct their estimates by that."""

    every_s: Real = key(
        10.0, "s", "time between two messages of an AUV; AUVs take turns", ge=0.1, le=1e6
    )
    kind: Literal["owtt", "twtt", "angles"] = key(
        "owtt",
        "",
        "owtt: an AUV that decodes a message gets a range by both clocks; twtt: an AUV asks, "
        "and all answer in turn; angles: no range, but bearing, elevation and difference of "
        "depth",
    )
    bearing: Literal["none", "array"] = key(
        "none", "", "array: AUVs carry the array of usbl, and measure the direction as well"
    )
    message_bytes: int = key(
        32, "B", "size of a message: position, covariance, depth, instant", ge=1, le=65_535
    )
    share: Literal["estimate", "raw"] = key(
        "estimate",
        "",
        "content of messages: the sender's estimate and covariance; or all measurements that "
        "it knows of, from which each AUV estimates all others as well",
    )
    fusion: Literal["intersection", "centralised", "naive"] = key(
        "intersection",
        "",
        "intersection: covariance intersection, which counts no common information twice; "
        "centralised: one filter with all measurements at once, as a bound; naive: messages "
        "count as independent, for comparison",
    )

    @property
    def traits(self) -> PeerTraits:
        """What the kind of ranging between AUVs declares."""
        return PEERS[self.kind]


class Navigation(Section):
    """Dead reckoning of the AUVs, and how a fix corrects it."""

    MOVED: ClassVar = (
        Moved("gain", "filter", "fixed_gain"),
        Moved("delay_compensation", "filter", "fixed_gain"),
    )

    gnss_fix: GnssFixSection | None = Field(
        default=None,
        description="a fix by GNSS while an AUV is at the surface; null, unless one of its keys is "
        "given = AUVs have no receiver",
    )
    drift: Drift = Field(
        default=Drift(), description="drift as an inertial system's data sheet has it"
    )
    velocity_bias_m_per_s: Point = key(
        (0.06, 0.06),
        "m/s",
        "velocity bias b_i; with the random walk it gives 13.5 % of the distance in the "
        "paper's 300 s at 0.627 m/s; DVL-aided inertial systems have 0.01 to 0.5 %: see drift",
        PAPER,
    )
    velocity_bias_sd_m_per_s: Real = key(
        0.0,
        "m/s",
        "standard deviation per axis of a further velocity bias, drawn for each AUV and seed",
        ge=0,
        le=20,
    )
    velocity_bias_time_constant_s: Real | None = key(
        None,
        "s",
        "time constant of that further bias (Gauss-Markov); null = constant",
        ge=1,
        le=1e7,
    )
    scale_factor_sd: Real = key(
        0.0,
        "1",
        "standard deviation of the scale factor of the velocity log less one, drawn for each AUV "
        "and seed",
        ge=0,
        le=0.5,
    )
    heading_sd_deg: Real = key(
        0.0,
        "deg",
        "standard deviation of the constant error of an AUV's heading, drawn for each AUV and seed",
        ge=0,
        le=45,
    )
    initial_position_sd_m: Real = key(
        0.0, "m", "standard deviation per axis of an AUV's estimate of its start", ge=0, le=1e5
    )
    clock_offset_sd_s: Real = key(
        0.0,
        "s",
        "standard deviation of how late an AUV's clock is at the start, drawn for each AUV and "
        "seed (owtt_sync, passive)",
        ge=0,
        le=1,
    )
    clock_drift_sd: Real = key(
        0.0,
        "1",
        "standard deviation of the drift of that clock, s per s, drawn for each AUV and seed",
        ge=0,
        le=1e-3,
    )
    bias_frame: Literal["body", "world"] = key(
        "body", "", "frame in which the bias is constant", "eq. dead_reckoning"
    )
    velocity: Literal["over_ground", "through_water"] = key(
        "over_ground", "", "velocity that dead reckoning integrates; through_water misses currents"
    )
    dvl_range_m: Real | None = key(
        None,
        "m",
        "height above the bottom (environment.bathymetry) up to which the log measures over "
        "ground (bottom lock); higher up, and where the bottom is not known, it measures through "
        "the water; null = no matter how high",
        ge=0.1,
        le=1e3,
    )
    random_walk_m_per_sqrt_s: Real = key(
        0.027, "m/sqrt(s)", "random walk sigma", PAPER, ge=0, le=1e3
    )
    imu_rate_hz: Real = key(30.0, "Hz", "rate of the IMU samples", PAPER, ge=0.001, le=1e3)
    depth_sd_m: Real = key(0.05, "m", "pressure sensor noise sigma_z", PAPER, ge=0, le=1e3)
    filter: PartChoice = key("kalman", "", "how a fix corrects (the paper: fixed_gain)" + SET)
    peers: PeersSection | None = Field(
        default=None,
        description="AUVs that range each other; null, unless one of its keys is given = they do "
        "not",
    )
    nis_gate: Real | None = key(
        9.210340372,
        "1",
        "normalised innovation squared above which kalman and smoother refuse a fix; null = none",
        "chi-squared, 2 degrees of freedom, 99 %",
        gt=0,
        le=1e6,
    )

    @field_validator("drift", mode="before")
    @classmethod
    def _no_sheet(cls, drift: Any) -> Any:
        """Read `drift: null` as no sheet."""
        return {} if drift is None else drift

    @model_validator(mode="after")
    def _as_its_sheet_says(self) -> "Navigation":
        """Let a data sheet replace the paper's bias and random walk, unless the user gave them."""
        if self.drift.is_stated:
            self.otherwise(velocity_bias_m_per_s=(0.0, 0.0), random_walk_m_per_sqrt_s=0.0)
        return self

    def changed(self, values: Mapping[str, Any]) -> "Navigation":
        """Return the section with other values of some keys."""
        given = {name: getattr(self, name) for name in self.model_fields_set}
        return type(self).model_validate({**given, **values})

    @property
    def fixed_gain(self) -> FixedGain:
        """The settings of a filter that `has_gain`: its gain, and how it compares delayed fixes."""
        return self.filter.settings_as(FixedGain, NAVIGATOR.declared(self.filter).settings)

    @property
    def weighs(self) -> bool:
        """Whether the filter weighs fixes by their covariances."""
        return NAVIGATOR.declared(self.filter).weighs
