"""Presets: named figures with sources; inertial systems and USBLs by their data sheets.

Figures of inertial systems are named as the keys of `navigation.drift`, those of USBLs as the keys
of `usbl` and the settings of its model `datasheet`.  Makers' pages that state a share of the
distance could not be read for most inertial systems on the market: these are left out, and a user
enters `percent_of_distance` from a data sheet.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

# Source of a figure: the maker's own page, the source code of a driver or simulator, second hand,
# or worked out here from other figures
Tag = Literal["M", "S", "2", "calc"]


@dataclass(frozen=True)
class Figure:
    """One number of a data sheet, or a word, in its unit ("" for none), with its source."""

    value: float | int | str
    unit: str
    tag: Tag
    source: str


@dataclass(frozen=True)
class Preset:
    """A named set of figures; each is named as the scenario's key, or setting, that it is for.

    Figures without a source are left out: keys that a preset does not name keep their defaults.
    Its `basis` is a statement of the maker or of a simulator's author, often a worst case, or a
    measurement in a trial.  `since` is the year, or year and month, of that; "" where no source
    states one.
    """

    name: str
    title: str
    figures: Mapping[str, Figure]
    basis: Literal["stated", "measured"] = "stated"
    since: str = ""
    covers: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float | int | str]:
        """The bare values by name."""
        return {name: figure.value for name, figure in self.figures.items()}


TANG = (
    "K. Tang, J. Wang, W. Li, W. Wu, A Novel INS and Doppler Sensors Calibration Method for Long "
    "Range Underwater Vehicle Navigation, Sensors 13 (2013), abstract: ring laser gyros of 0.03 "
    "deg/h, a DVL of 0.5 % and 0.5 cm/s"
)


def _measured(name: str, trial: str, percent: float) -> Preset:
    return Preset(
        name,
        f"ring laser gyro and DVL, calibrated, as measured in a {trial} trial",
        {
            "percent_of_distance": Figure(percent, "%", "2", f"{TANG}; {trial} trial"),
            "statistic": Figure("cep", "", "2", TANG),
        },
        "measured",
        "2013",
    )


INERTIALS: tuple[Preset, ...] = (
    _measured("rlg_dvl_sea", "sea", 0.2),
    _measured("rlg_dvl_river", "river", 0.1),
)


OEM = "Nitsch 2024, USBL-Simulator, as set for the EvoLogics OEM USBL 120/180 kHz"
CERULEAN = "Cerulean Sonar's error budget of its ROVL: CEP = sqrt(5^2 + (sin(angle) R)^2) m"
MICRO_RANGER = "Sonardyne's figures as repeated by others"
SEATRAC = "Blueprint Subsea's figures as repeated by others"
TRACKLINK = "LinkQuest's figures as repeated by others"
UGPS = (
    "Water Linked, documentation of the Underwater GPS G2, system selector "
    "(github.com/waterlinked/docs)"
)
IN_EACH = "; taken for the standard deviation of an angle across, in each direction"


def _cerulean(name: str, compass: str, angle_deg: float, percent: float) -> Preset:
    """Return the preset with one of the compasses; `percent` is 100 times the angle's sine."""
    return Preset(
        name,
        f"Cerulean ROVL / Omnitrack, with {compass}",
        {
            "accuracy_m": Figure(5.0, "m", "M", CERULEAN),
            "accuracy_percent": Figure(
                percent, "%", "calc", f"{CERULEAN}; 100 sin({angle_deg:g} deg)"
            ),
            "statistic": Figure("cep", "", "M", CERULEAN),
        },
        covers=("heading_sd_deg",),
    )


UGPS_FIGURES = {
    "bearing_sd_deg": Figure(1.0, "deg", "M", f"{UGPS}: below 1 deg{IN_EACH}"),
    "range_sd_percent": Figure(0.2, "%", "M", f"{UGPS}: below 0.2 %, at worst"),
}

USBLS = (
    Preset(
        "evologics_oem",
        "EvoLogics OEM USBL 120/180 kHz, by its array",
        {
            "array": Figure(
                "oem5", "", "S", f"{OEM}: four at +-22.275 mm, the apex 73.48 mm below"
            ),
            "tdoa_sd_s": Figure(2.60296781e-7, "s", "S", OEM),
            "travel_time_sd_s": Figure(6.66667e-6, "s", "S", OEM),
            "quantum_s": Figure(1.0e-6, "s", "S", OEM),
            "roll_sd_deg": Figure(0.2, "deg", "S", OEM),
            "pitch_sd_deg": Figure(0.2, "deg", "S", OEM),
            "heading_sd_deg": Figure(1.0, "deg", "S", OEM),
        },
        since="2024",
    ),
    _cerulean("cerulean_rovl", "its own compass", 5.2, 9.063258),
    _cerulean("cerulean_rovl_gnss", "a GNSS compass", 2.1, 3.664371),
    Preset(
        "micro_ranger_2",
        "Sonardyne Micro-Ranger 2",
        {
            "bearing_sd_deg": Figure(3.0, "deg", "2", f"{MICRO_RANGER}: about 3 deg{IN_EACH}"),
            "range_sd_m": Figure(0.015, "m", "2", MICRO_RANGER),
        },
    ),
    Preset(
        "seatrac_x150",
        "Blueprint Subsea SeaTrac X150",
        {
            "bearing_sd_deg": Figure(1.0, "deg", "2", f"{SEATRAC}: about 1 deg{IN_EACH}"),
            "range_sd_percent": Figure(2.0, "%", "2", f"{SEATRAC}: about 2 %"),
        },
    ),
    Preset(
        "ugps_g2",
        "Water Linked Underwater GPS G2, a short baseline, with position and heading from outside",
        UGPS_FIGURES,
    ),
    Preset(
        "ugps_g2_gnss",
        "Water Linked Underwater GPS G2, a short baseline, with its own GNSS",
        {
            **UGPS_FIGURES,
            "gnss_correlated_sd_m": Figure(
                2.123, "m", "calc", f"{UGPS}: 2.5 m (CEP) / 1.1774, taken to be slow"
            ),
        },
    ),
    Preset(
        "tracklink_1500",
        "LinkQuest TrackLink 1500",
        {"bearing_sd_deg": Figure(0.25, "deg", "2", f"{TRACKLINK}: 0.25 deg{IN_EACH}")},
    ),
)
