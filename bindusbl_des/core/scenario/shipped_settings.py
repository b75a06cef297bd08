"""The settings of shipped parts, but for those of channels."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Literal, Self

from pydantic import model_validator

from ...support.spreads import Statistic
from .key_types import PAPER, Real, Text, key
from .part_choice import Settings

# Errors that a filter may leave out of its model
Untold = Literal[
    "misalignment", "gnss", "sound_speed", "clock", "slow",
    "velocity_bias", "scale_factor", "heading", "initial_position", "current",
]  # fmt: skip


class Kalman(Settings):
    """The settings of the filter `kalman`."""

    untold: tuple[Untold, ...] = key(
        (),
        "",
        "errors of instruments, clocks and AUVs' own sensors that the filter does not model; "
        "`current` is that which logs miss",
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
        "whether range rates (usbl.range_rate_sd_m_per_s) also correct velocity bias and current",
    )
    assumes: Mapping[str, Mapping[str, Any]] = key(
        {},
        "",
        "keys of errors (`navigation: {scale_factor_sd: 0}`) for which the filter assumes "
        "other values; for the others it assumes the true ones",
    )


class Smoothing(Kalman):
    """The settings of the filter `smoother`."""

    lag_s: Real | None = key(
        None,
        "s",
        "an estimate uses the fixes delivered up to this time later; null = all fixes of the "
        "mission",
        ge=0,
        le=1e7,
    )


class FixedGain(Settings):
    """The settings of the filter `fixed_gain`, the paper's."""

    gain: Real = key(0.9, "1", "gain gamma of eq. update", PAPER, gt=0, le=1)
    delay_compensation: Literal["none", "shift"] = key(
        "shift",
        "",
        "whether the innovation is against the present estimate, or against the one at ping time",
    )


class Kinematic(Settings):
    """The settings of the vehicle `kinematic`."""

    turning_radius_m: Real = key(5.0, "m", "smallest turning radius", ge=0.001, le=1e4)


class Sailboat(Settings):
    """The settings of the vessel `sailboat`."""

    polar: Text = key(
        "dinghy",
        "",
        "speed by the angle off the wind: dinghy, swarm, or a CSV with angle_deg, wind_m_per_s and "
        "speed_m_per_s",
        "assumed: sailing-robot (dinghy), SailSwarmSwIM (swarm)",
    )
    most_m_per_s: Real = key(
        1.5, "m/s", "speed that the hull does not exceed", "assumed: MaxiMOOP", gt=0, le=20
    )
    no_go_deg: Real = key(
        40.0,
        "deg",
        "angle off the wind within which sails do not draw",
        "assumed",
        ge=10,
        le=80,
    )
    leeway: Real = key(
        5.0, "deg", "leeway close-hauled; before the wind there is none", "assumed", ge=0, le=45
    )
    turn_deg_per_s: Real = key(
        30.0, "deg/s", "rate of turn at the hull's speed; in proportion below it, a quarter at "
        "least", "assumed", gt=0, le=180,
    )  # fmt: skip
    tack_keeps: Real = key(
        0.2, "1", "share of the speed that a tack leaves", "sailing-robot", ge=0, le=1
    )
    gybe_keeps: Real = key(0.6, "1", "share of the speed that a gybe leaves", "assumed", ge=0, le=1)
    recover_s: Real = key(
        3.0, "s", "time in which the speed comes back to within 5 %", "sailing-robot", gt=0, le=600
    )
    keeping: Literal["figure_of_eight", "beat", "hove_to"] = key(
        "figure_of_eight",
        "",
        "how it keeps station: to and fro across the wind, up and down it, or waiting hove-to "
        "until it has drifted off",
    )
    within_m: Real = key(
        10.0, "m", "radius about the station that it is to stay in", "assumed", ge=1, le=1e4
    )


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
        "standard deviation of the direction sideways: an angle across the line of sight, at "
        "any elevation",
        gt=0,
        le=45,
    )
    elevation_sd_deg: Real | None = key(
        None,
        "deg",
        "standard deviation of the direction upwards; null = as sideways",
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
        "cep", "", "meaning of the stated accuracy: the circle of 50 % or 95 % of all fixes, or RMS"
    )
    reference_snr_db: Real | None = key(
        None,
        "dB",
        "SNR at which the angles are stated; they change as 10^(-SNR / 20); null = they are "
        "constant",
        ge=-60,
        le=120,
    )
    angle_floor_deg: Real = key(
        0.0, "deg", "least standard deviation of bearing and elevation at high SNR", ge=0, le=45
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


class Shear(Settings):
    """Settings of the current `shear`."""

    depths_m: tuple[Real, ...] = key(
        ..., "m", "depths, rising; the current is linear between them, constant beyond"
    )
    speeds_m_per_s: tuple[Real, ...] = key(
        ..., "m/s", "speed of the current at each of these depths"
    )
    directions_deg: tuple[Real, ...] = key(
        (0.0,), "deg", "direction it flows to at each of them, from +x to +y; one for all of them"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        depths, count = self.depths_m, len(self.depths_m)
        if not depths or any(lower <= upper for upper, lower in pairwise(depths)):
            raise ValueError("depths_m must rise; list each depth once, from the surface down")
        for name, needed in (("speeds_m_per_s", (count,)), ("directions_deg", (1, count))):
            given = len(getattr(self, name))
            if given not in needed:
                raise ValueError(f"{name} needs one number per depth: {count}, not {given}")
        return self
