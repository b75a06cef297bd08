"""The rows of a replay's tables: what each column is."""

from dataclasses import dataclass

from ..records.events import column


@dataclass
class LogRow:
    """One log."""

    log: str = column("", "name of the log")
    rows: int = column("1", "instants of the odometry")
    distance_m: float = column("m", "way gone by the odometry")
    duration_s: float = column("s", "time from the first to the last instant")
    has_clock: bool = column("", "false where time is the distance at a nominal speed")
    ranges: int = column("1", "ranges")
    fixes: int = column("1", "fixes")
    receptions: int = column("1", "receptions of which it is known whether they were lost")
    lost_share: float = column("1", "share of these that were lost")
    burst_s: float = column("s", "mean time that losses last; null where they come one by one")
    longest_outage_s: float = column("s", "longest time in which receptions of a pair were lost")
    outage_chance: float = column("1", "how likely one as long is, were there but that mean")
    start_x_m: float = column("m", "x of the start")
    start_y_m: float = column("m", "y of the start")
    start_heading_deg: float = column("deg", "heading at the start, from x towards y")
    start_loss: float = column("1", "mean loss of a range with the start that was found")
    rival_loss: float = column("1", "the same with the best start elsewhere")
    range_sd_m: float = column("m", "standard deviation of a range that is no outlier")
    outlier_share: float = column("1", "share of outliers by the noise told")
    outlier_sd_m: float = column("m", "standard deviation of their further error")
    random_walk_m_per_sqrt_s: float = column("m/sqrt(s)", "random walk of dead reckoning")
    filter_nis: float = column("1", "mean normalised innovation squared of what is no outlier")
    filter_outlier_share: float = column("1", "share of sights that the filter takes for outliers")
    smoother_outlier_share: float = column("1", "share that the smoother takes for outliers")
    filter_to_smoother_m: float = column("m", "RMS distance of the filter from the smoother")
    reckoned_to_reference_m: float = column(
        "m", "RMS distance of dead reckoning, from the same start, from GTSAM's robust optimum"
    )
    filter_to_reference_m: float = column("m", "RMS distance of the filter from it")
    smoother_to_reference_m: float = column("m", "RMS distance of the smoother from it")


@dataclass
class TrackRow:
    """One instant of a log."""

    log: str = column("", "name of the log")
    time_s: float = column("s", "time since the first instant")
    reckoned_x_m: float = column("m", "x by odometry alone, from the start")
    reckoned_y_m: float = column("m", "y by odometry alone")
    filter_x_m: float = column("m", "x by the filter, from the sights so far")
    filter_y_m: float = column("m", "y by the filter")
    filter_sd_x_m: float = column("m", "standard deviation of x")
    filter_sd_y_m: float = column("m", "standard deviation of y")
    filter_cov_xy_m2: float = column("m2", "covariance of the two")
    smoother_x_m: float = column("m", "x by the smoother, from all sights")
    smoother_y_m: float = column("m", "y by the smoother")
    smoother_sd_x_m: float = column("m", "standard deviation of x")
    smoother_sd_y_m: float = column("m", "standard deviation of y")
    smoother_cov_xy_m2: float = column("m2", "covariance of the two")
    reference_x_m: float = column("m", "x of GTSAM's robust optimum; no truth")
    reference_y_m: float = column("m", "y of it")
    reference_sd_m: float = column("m", "root of the trace of its covariance, by the log's noise")


@dataclass
class SightRow:
    """One range or fix of a log."""

    log: str = column("", "name of the log")
    time_s: float = column("s", "instant at which it holds")
    beacon: str = column("", "the beacon of a range; null for a fix")
    range_m: float = column("m", "the range measured; null for a fix")
    innovation_m: float = column("m", "how much longer it was than the filter expected")
    nis: float = column("1", "its normalised square, if it is no outlier")
    inlier: float = column("1", "probability by the filter that it is no outlier")
    taken: bool = column("", "whether the filter took it in")
    residual_m: float = column("m", "how much longer it was than it is from where the smoother is")
    residual_inlier: float = column("1", "probability by the smoother that it is no outlier")


@dataclass
class BeaconRow:
    """One beacon of a log."""

    log: str = column("", "name of the log")
    beacon: str = column("", "name of the beacon")
    x_m: float = column("m", "surveyed x")
    y_m: float = column("m", "surveyed y")
    z_m: float = column("m", "surveyed depth")
    ranges: int = column("1", "ranges to it")
    residual_median_m: float = column("m", "median of their residuals by the smoother")
    residual_spread_m: float = column("m", "their spread: 1.4826 x the median deviation from that")


ROWS = {"logs": LogRow, "tracks": TrackRow, "sights": SightRow, "beacons": BeaconRow}
