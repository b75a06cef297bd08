"""The keys of navigation: what is wrong with dead reckoning, and how fixes correct it."""

from typing import Literal

from ..key_types import PAPER, Part, Point, Real, key
from ..part_choice import SET, PartChoice


class Navigation(Part):
    """Dead reckoning of the AUVs and how a fix corrects it."""

    velocity_bias_m_per_s: Point = key((0.06, 0.06), "m/s", "velocity bias b_i", PAPER)
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
        "time constant with which that further bias wanders (Gauss-Markov); null = it is constant",
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
        0.0, "m", "standard deviation per axis of what an AUV takes its start for", ge=0, le=1e5
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
        "over_ground", "", "the velocity dead reckoning integrates; through water misses currents"
    )
    random_walk_m_per_sqrt_s: Real = key(
        0.027, "m/sqrt(s)", "random walk sigma", PAPER, ge=0, le=1e3
    )
    imu_rate_hz: Real = key(30.0, "Hz", "rate of the IMU samples", PAPER, ge=0.001, le=1e3)
    depth_sd_m: Real = key(0.05, "m", "pressure sensor noise sigma_z", PAPER, ge=0, le=1e3)
    filter: PartChoice = key("kalman", "", "how a fix corrects (the paper: fixed_gain)" + SET)
    gain: Real = key(0.9, "1", "gain gamma of eq. update (fixed_gain)", PAPER, gt=0, le=1)
    nis_gate: Real | None = key(
        9.210340372,
        "1",
        "normalised innovation squared above which a fix is refused (kalman); null = none",
        "chi-squared, 2 degrees of freedom, 99 %",
        gt=0,
        le=1e6,
    )
    delay_compensation: Literal["none", "shift"] = key(
        "shift", "", "innovation against the present estimate, or that remembered at ping time"
    )

    @property
    def weighs(self) -> bool:
        """Whether the filter weighs fixes by their covariances."""
        return self.filter in ("kalman", "smoother")
