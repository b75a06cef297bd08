"""Settings of the channels with levels, `sonar` and `table`."""

from typing import Annotated, Any, Literal, Self

from pydantic import (
    Field,
    PlainSerializer,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)

from ..scenario.families import Lossy
from ..scenario.key_types import Real, Text, key


class Sound(Lossy):
    """Settings of channels with levels: a band's sound, its absorption, noise and decoding.

    Levels are in dB re 1 uPa, those of sources at 1 m.
    """

    frequency_khz: Real = key(25.0, "kHz", "centre frequency of the band", ge=0.1, le=1000)
    bandwidth_khz: Real = key(10.0, "kHz", "bandwidth B of the band", ge=1e-3, le=1000)
    source_level_db: Real = key(180.0, "dB", "source level SL re 1 uPa at 1 m", ge=0, le=250)
    directivity_index_db: Real = key(0.0, "dB", "directivity index DI of receivers", ge=0, le=60)
    absorption: Literal["francois_garrison", "ainslie_mccolm", "thorp"] = key(
        "francois_garrison", "", "law of absorption; thorp depends on neither water nor pH"
    )
    ph: Real = key(8.1, "1", "acidity of the water, for absorption", ge=7, le=9)
    wind_m_per_s: Real = key(5.0, "m/s", "wind speed, for the noise of waves", ge=0, le=50)
    shipping: Real = key(0.5, "1", "noise of distant ships, none to heavy", ge=0, le=1)
    own_noise_db: Real | None = key(
        None, "dB", "noise of a receiver's own vehicle re 1 uPa2/Hz; null = none", ge=-50, le=200
    )
    decoding: Literal[
        "threshold", "non_coherent", "coherent", "rayleigh", "bpsk", "dpsk", "nc_fsk"
    ] = key(
        "threshold",
        "",
        "what decodes: a threshold of SNR; a matched filter (coherent or not, or in a Rayleigh "
        "channel); the bits of a frame, which must all be right",
    )
    snr_threshold_db: Real | None = key(
        None,
        "dB",
        "SNR at which the decoding `threshold` succeeds; null = that at the band's range",
        ge=-60,
        le=120,
    )
    false_alarm: Real = key(
        1e-4, "1", "false-alarm probability of a matched filter", ge=1e-15, le=0.5
    )
    shadowing_sd_db: Real = key(
        3.0, "dB", "standard deviation of the SNR (log-normal shadowing)", ge=0, le=40
    )
    interference_db: Real = key(
        10.0,
        "dB",
        "interference also counts from signals this far below the SNR at which half of all "
        "signals are decoded",
        ge=0,
        le=120,
    )
    capture_db: Real | None = key(
        None,
        "dB",
        "ratio of a signal to noise and overlapping signals above which it is decoded; null = "
        "never",
        ge=-30,
        le=60,
    )

    @model_validator(mode="after")
    def _one_way_of_decoding(self) -> Self:
        """Refuse settings that do not fit the chosen decoding, and a band below 0 Hz."""
        if self.snr_threshold_db is not None and self.decoding != "threshold":
            raise ValueError(
                f"snr_threshold_db belongs to decoding threshold, not {self.decoding}; remove one"
            )
        if self.bandwidth_khz > 2.0 * self.frequency_khz:
            raise ValueError(
                f"bandwidth_khz {self.bandwidth_khz:g} reaches below 0 Hz around frequency_khz "
                f"{self.frequency_khz:g}; make it at most twice the frequency"
            )
        return self


class Sonar(Sound):
    """Settings of the channel `sonar`: sound spreads by a law."""

    spreading: Real = key(
        2.0, "1", "spreading k of 10 k lg r: 2 spherical, 1.5 practical, 1 cylindrical", ge=1, le=3
    )


class OfPings(Sound):
    """Settings of sound that carries no bits."""

    decoding: Literal["threshold", "non_coherent", "coherent", "rayleigh"] = key(
        "threshold",
        "",
        "what decodes: a threshold of SNR; a matched filter, coherent or not, or in a Rayleigh "
        "channel",
    )
    timing: Literal["constant", "envelope", "carrier"] = key(
        "constant",
        "",
        "accuracy of an array's time differences at low SNR: constant, or that of timing by "
        "the envelope, or by the carrier as well",
    )


BATHYMETRY = "bathymetry"


class OfBathymetry(float):
    """The depth (m) of a sea whose bottom is that of the scenario; NaN, in a file `bathymetry`."""


def _read_bottom(value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
    if isinstance(value, OfBathymetry) or value == BATHYMETRY:
        return OfBathymetry("nan")
    return validate(value)


Deep = Annotated[
    Real | None,
    Field(ge=1, le=12_000),
    WrapValidator(_read_bottom),
    PlainSerializer(lambda value: BATHYMETRY if isinstance(value, OfBathymetry) else value),
    WithJsonSchema(
        {"anyOf": [{"type": "number", "minimum": 1, "maximum": 12_000}, {"type": "null"},
                   {"const": BATHYMETRY}]}
    ),
]  # fmt: skip


class PingSonar(OfPings, Sonar):
    """Settings of the channel `sonar` of pings."""

    bottom_m: Deep = key(
        None,
        "m",
        "depth of a flat sea that echoes pings; `bathymetry`: for each ping that of "
        "environment.bathymetry at the middle of its way; null = no echoes",
    )
    surface_sd_m: Real = key(
        0.0, "m", "standard deviation of the surface's height, for its echoes", ge=0, le=20
    )
    transducer_m: Real = key(
        0.5, "m", "depth at which ASVs carry their transducers, for echoes", ge=0.01, le=100
    )

    @model_validator(mode="after")
    def _echoes_of_a_bottom(self) -> Self:
        """Refuse settings of echoes without a bottom, and transducers below it."""
        given = self.model_fields_set & {"surface_sd_m", "transducer_m"}
        if self.bottom_m is None and given:
            raise ValueError(
                f"{' and '.join(sorted(given))} matter for echoes; add bottom_m, or remove them"
            )
        if self.bottom_m is not None and self.transducer_m >= self.bottom_m:
            raise ValueError(
                f"transducer_m {self.transducer_m:g} lies on the bottom at {self.bottom_m:g} m or "
                "below it; make it less"
            )
        return self


class Table(Sound):
    """Settings of the channel `table`: sound takes bent rays, whose loss is in a table."""

    rays: Text | None = key(
        None,
        "",
        "CSV or Parquet of range_m, source_depth_m, receiver_depth_m, travel_time_s, loss_db; null "
        "= traced by BELLHOP (package pelagic)",
    )
    bottom_m: Real = key(30.0, "m", "depth of the sea in which rays are traced", ge=1, le=12_000)

    @model_validator(mode="after")
    def _traced_once(self) -> Self:
        """Refuse a depth to trace rays in where rays are given."""
        if self.rays is not None and "bottom_m" in self.model_fields_set:
            raise ValueError("bottom_m is for rays that are traced; remove it, or rays")
        return self


class PingTable(OfPings, Table):
    """Settings of the channel `table` of pings."""
