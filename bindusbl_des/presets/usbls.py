"""USBL systems as their sheets state them; figures are named as the keys of `usbl`, and as the
settings of its model `datasheet`.
"""

from .preset import Figure, Preset

OEM = "Nitsch 2024, USBL-Simulator, as set for the EvoLogics OEM USBL 120/180 kHz"
CERULEAN = "Cerulean Sonar's error budget of its ROVL: CEP = sqrt(5^2 + (sin(angle) R)^2) m"
MICRO_RANGER = "Sonardyne's figures as repeated by others"
SEATRAC = "Blueprint Subsea's figures as repeated by others"
TRACKLINK = "LinkQuest's figures as repeated by others"
UGPS = (
    "Water Linked, documentation of the Underwater GPS G2, system selector "
    "(github.com/waterlinked/docs)"
)
IN_EACH = "; taken for standard deviations of bearing and elevation"


def _cerulean(name: str, compass: str, angle_deg: float, percent: float) -> Preset:
    """Return the budget with one of the compasses; `percent` is 100 times the angle's sine."""
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
