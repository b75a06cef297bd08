"""The settings of shipped parts, but for those of channels."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import model_validator

from ...support.spreads import Statistic
from .key_types import PAPER, Real, key
from .part_choice import Settings

# Errors that a filter may leave out of its model
Untold = Literal[
    "misalignment", "gnss", "sound_speed", "clock", "slow",
    "velocity_bias", "scale_factor", "heading", "initial_position",
]  # fmt: skip


class Kalman(Settings):
    """The settings of the filter `kalman`."""

    untold: tuple[Untold, ...] = key(
        (), "", "errors of instruments, clocks and AUVs' own sensors that the filter does not model"
    )
    random_walk_m_per_sqrt_s: Real | None = key(
        None, "m/sqrt(s)", "process noise of the position; null = the scenario's", ge=0, le=1e3
    )
    velocity_bias_sd_m_per_s: Real | None = key(
        None,
        "m/s",
        "prior of the constant velocity bias along each axis; null = the scenario's, "
        "hypot(|velocity_bias_m_per_s|, velocity_bias_sd_m_per_s)",
        ge=0,
        le=20,
    )
    initial_position_sd_m: Real | None = key(
        None, "m", "prior of the start along each axis; null = the scenario's", ge=0, le=1e5
    )
    range_rate: bool = key(
        False,
        "",
        "whether range rates (usbl.range_rate_sd_m_per_s), which come with fixes, correct velocity "
        "bias and current as well",
    )
    assumes: Mapping[str, Mapping[str, Any]] = key(
        {},
        "",
        "keys of errors (`navigation: {scale_factor_sd: 0}`) that the filter takes for something "
        "else than they are; what is not named here it is told of as it is",
    )


class Smoothing(Kalman):
    """The settings of the filter `smoother`."""

    lag_s: Real | None = key(
        None,
        "s",
        "an estimate knows the fixes delivered up to so much later; null = all of the mission",
        ge=0,
        le=1e7,
    )


class FixedGain(Settings):
    """The settings of the filter `fixed_gain`, the paper's."""

    gain: Real = key(0.9, "1", "gain gamma of eq. update", PAPER, gt=0, le=1)
    delay_compensation: Literal["none", "shift"] = key(
        "shift", "", "innovation against the present estimate, or that remembered at ping time"
    )


class Kinematic(Settings):
    """The settings of the vehicle `kinematic`."""

    turning_radius_m: Real = key(5.0, "m", "smallest turning radius", ge=0.001, le=1e4)


# Keys that belong to one of a data sheet's two statements: accuracy of a position, or angles
OF_ACCURACY = ("statistic",)
OF_ANGLES = (
    *("elevation_sd_deg", "range_sd_m", "range_sd_percent", "reference_snr_db"),
    "angle_floor_deg",
)


class Datasheet(Settings):
    """The settings of the instrument `datasheet`: a whole USBL as its data sheet states it.

    The sheet states either bearing, elevation and range, or the accuracy of a horizontal position.
    """

    bearing_sd_deg: Real | None = key(
        None,
        "deg",
        "standard deviation of the direction, to either side: an angle across the way to the AUV, "
        "whatever its elevation",
        gt=0,
        le=45,
    )
    elevation_sd_deg: Real | None = key(
        None,
        "deg",
        "the same upwards and downwards; null = as to either side",
        gt=0,
        le=45,
    )
    range_sd_m: Real = key(0.0, "m", "standard deviation of the slant range", ge=0, le=1e3)
    range_sd_percent: Real = key(
        0.0, "%", "the same in percent of the slant range, added in squares", ge=0, le=20
    )
    accuracy_m: Real = key(
        0.0, "m", "accuracy of a horizontal position instead of bearing and range", ge=0, le=1e3
    )
    accuracy_percent: Real = key(
        0.0, "%", "the same in percent of the slant range, added in squares", ge=0, le=50
    )
    statistic: Statistic = key(
        "cep", "", "what is stated of accuracy: the circle of half, or 95 %, of all fixes, or RMS"
    )
    reference_snr_db: Real | None = key(
        None,
        "dB",
        "SNR at which the angles are stated; they change as 10^(-SNR / 20); null = they do not",
        ge=-60,
        le=120,
    )
    angle_floor_deg: Real = key(
        0.0, "deg", "what bearing and elevation never fall below, however high the SNR", ge=0, le=45
    )

    @model_validator(mode="after")
    def _one_statement(self) -> "Datasheet":
        """Refuse a sheet that states nothing, or both."""
        by_angles, by_place = self.bearing_sd_deg is not None, self.states_a_place
        if by_angles and by_place:
            raise ValueError(
                "is stated twice, by bearing_sd_deg and by accuracy_m or accuracy_percent, which "
                "is of the whole position; keep one of them"
            )
        if not by_angles and not by_place:
            raise ValueError("states no direction; add bearing_sd_deg, or accuracy_percent")
        belongs, others = (
            ("accuracy_m or accuracy_percent", OF_ACCURACY)
            if by_angles
            else ("bearing_sd_deg", OF_ANGLES)
        )
        for name in others:
            if name in self.model_fields_set:
                raise ValueError(f"{name} says more of {belongs}, which is not stated; remove it")
        if self.angle_floor_deg and self.reference_snr_db is None:
            raise ValueError("angle_floor_deg needs reference_snr_db; add it, or remove the floor")
        return self

    @property
    def states_a_place(self) -> bool:
        """Whether the sheet states the accuracy of a position instead of angles."""
        return self.accuracy_m > 0.0 or self.accuracy_percent > 0.0
