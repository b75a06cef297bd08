"""Where vehicles are, in the words of the result table."""

from dataclasses import dataclass

from .columns import column


@dataclass(slots=True)
class TrackPoint:
    """One vehicle at one instant: where it is and, for an AUV, where it believes to be."""

    time_s: float = column("s", "instant")
    vehicle: str = column("", "vehicle")
    x_m: float = column("m", "true position, north")
    y_m: float = column("m", "true position, east")
    z_m: float = column("m", "true depth")
    yaw_rad: float = column("rad", "true heading from +x towards +y, in (-pi, pi]")
    estimate_x_m: float | None = column("m", "fused estimate, north", None)
    estimate_y_m: float | None = column("m", "fused estimate, east", None)
    estimate_z_m: float | None = column("m", "depth by the pressure sensor", None)
    imu_x_m: float | None = column("m", "dead reckoning without any fix, north", None)
    imu_y_m: float | None = column("m", "dead reckoning without any fix, east", None)
    position_error_m: float | None = column("m", "horizontal |estimate - truth|", None)
    cross_track_error_m: float | None = column(
        "m", "estimate - truth, perpendicular to the heading, positive to starboard", None
    )
    path_error_m: float | None = column(
        "m", "distance of the truth from the planned path, or from the station", None
    )
    estimate_sd_x_m: float | None = column("m", "standard deviation of estimate_x_m", None)
    estimate_sd_y_m: float | None = column("m", "standard deviation of estimate_y_m", None)
    estimate_cov_xy_m2: float | None = column("m2", "covariance of the two", None)
    swept_m2: float | None = column(
        "m2", "area of the survey that this AUV was the first to sweep until then", None
    )
