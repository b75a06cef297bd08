"""The keys of the USBL: what ASVs measure with, and all that is wrong with it.

With passive ranging AUVs measure with it.
"""

from typing import Literal

from ..key_types import PAPER, THESIS, Part, Real, key
from ..part_choice import SET, PartChoice


class Usbl(Part):
    """The hydrophone array and the errors of what it measures."""

    model: PartChoice = key("array", "", "what an arrival measures, and how surely" + SET)
    array: Literal["oem5", "cross5"] = key("oem5", "", "hydrophone array", THESIS)
    tdoa_sd_s: Real = key(2.60296781e-7, "s", "noise of one TDOA pair", THESIS, ge=0, le=1)
    travel_time_sd_s: Real = key(6.66667e-6, "s", "noise of a travel time", THESIS, ge=0, le=1)
    quantum_s: Real = key(1.0e-6, "s", "quantum of travel times and TDOAs", THESIS, ge=0, le=1)
    roll_sd_deg: Real = key(0.2, "deg", "AHRS roll noise", THESIS, ge=0, le=45)
    pitch_sd_deg: Real = key(0.2, "deg", "AHRS pitch noise", THESIS, ge=0, le=45)
    heading_sd_deg: Real = key(1.0, "deg", "AHRS heading noise", THESIS, ge=0, le=45)
    gnss_sd_m: Real = key(0.0, "m", "GNSS noise per axis", PAPER, ge=0, le=1e3)
    misalignment_sd_deg: Real = key(
        0.0,
        "deg",
        "standard deviation of a constant heading error, drawn for each ASV (passive: AUV) and "
        "seed",
        ge=0,
        le=45,
    )
    gnss_correlated_sd_m: Real = key(
        0.0, "m", "standard deviation per axis of each ASV's slow GNSS error", ge=0, le=1e3
    )
    gnss_time_constant_s: Real = key(
        300.0, "s", "time constant of that error (Gauss-Markov)", ge=1, le=1e6
    )
    outlier_share: Real = key(
        0.0, "1", "share of the measurements of single arrays that are outliers", ge=0, le=0.5
    )
    outlier_sd_m: Real = key(
        10.0, "m", "standard deviation per horizontal axis of what outliers are off", gt=0, le=1e4
    )
