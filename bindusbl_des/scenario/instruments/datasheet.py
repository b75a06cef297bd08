"""The settings of the instruments that ship."""

from pydantic import model_validator

from ...core.spreads import Statistic
from ..key_types import Real, key
from ..part_settings import Settings


class Datasheet(Settings):
    """The settings of the instrument `datasheet`: the whole system as its sheet states it.

    Either bearing, elevation and range, or the accuracy of a horizontal position.
    """

    bearing_sd_deg: Real | None = key(
        None, "deg", "standard deviation of the bearing, in the array's frame", gt=0, le=45
    )
    elevation_sd_deg: Real | None = key(
        None, "deg", "standard deviation of the elevation; null = that of the bearing", gt=0, le=45
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
        """Refuse a sheet that says nothing, or the same twice."""
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
        """Whether it states the accuracy of a position, and no angles."""
        return self.accuracy_m > 0.0 or self.accuracy_percent > 0.0


OF_ACCURACY = ("statistic",)
OF_ANGLES = (
    *("elevation_sd_deg", "range_sd_m", "range_sd_percent", "reference_snr_db"),
    "angle_floor_deg",
)
