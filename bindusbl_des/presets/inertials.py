"""Inertial systems as their sheets state them; figures are named as the keys of `navigation.drift`.

Makers' pages that state a share of the distance could not be read for most systems that are sold:
these are left out, and `percent_of_distance` is typed from one's own sheet.
"""

from .preset import Figure, Preset

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
    )


INERTIALS: tuple[Preset, ...] = (
    _measured("rlg_dvl_sea", "sea", 0.2),
    _measured("rlg_dvl_river", "river", 0.1),
)
