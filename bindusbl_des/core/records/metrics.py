"""Metrics of a mission, for each AUV and as a whole, in the words of the result tables, and their
names for axes, menus and tables.

A mission is judged by its worst AUV: the largest of errors, ages, intervals, latencies and losses,
the smallest of coverage, fixes and rates (:class:`.metrics.AuvMetrics` says which).  An AUV without
a value, because it got no fix, is worse than any with one.  Among equals the first counts.
"""

from dataclasses import dataclass, fields

from .events import LARGEST, SMALLEST, column


@dataclass(slots=True)
class AuvMetrics:
    """One AUV over the whole mission; time means are over samples at record.metrics_hz."""

    auv: int = column("", "AUV")
    pings: int = column(
        "1", "pings sent, and turns whose call got no answer; passive: pings of all ASVs"
    )
    pings_in_range: int = column(
        "1", "pings within HF range of at least one ASV (passive: of the AUV)", worst=SMALLEST
    )
    pings_heard: int = column(
        "1", "pings decoded by at least one ASV (passive: by the AUV)", worst=SMALLEST
    )
    hf_coverage: float | None = column(
        "1", "pings in range / pings, without those still under way", worst=SMALLEST
    )
    fixes: int = column("1", "fixes made", worst=SMALLEST)
    fixes_delivered: int = column("1", "fixes that reached the AUV", worst=SMALLEST)
    fixes_out_of_range: int = column(
        "1", "fixes broadcast beyond MF range, or behind land", worst=LARGEST
    )
    fixes_lost: int = column(
        "1", "fixes broadcast that the AUV could have decoded, but did not", worst=LARGEST
    )
    fixes_in_flight: int = column(
        "1", "fixes not yet delivered when the mission ended", worst=LARGEST
    )
    receptions_lost: int = column(
        "1", "receptions in range lost to the channel, or their call", worst=LARGEST
    )
    collisions: int = column(
        "1",
        "receptions of its pings (passive: of pings at it) and of calls at it, on HF, that another "
        "ping or call destroyed",
        worst=LARGEST,
    )
    frame_collisions: int = column(
        "1",
        "receptions of frames at it, on MF, that another frame (protocol.duplex: or its ping) "
        "destroyed",
        worst=LARGEST,
    )
    fix_rate_hz: float = column("Hz", "fixes delivered / duration", worst=SMALLEST)
    interval_mean_s: float | None = column("s", "mean time between deliveries", worst=LARGEST)
    interval_p95_s: float | None = column(
        "s", "95 % quantile of the time between deliveries", worst=LARGEST
    )
    interval_max_s: float | None = column("s", "longest time between deliveries", worst=LARGEST)
    fix_age_mean_s: float = column(
        "s",
        "time mean of the time since the ping of the newest fix that the navigator has taken, or "
        "since the start",
        worst=LARGEST,
    )
    fix_age_p95_s: float = column("s", "95 % of the time that age is below this", worst=LARGEST)
    fix_age_max_s: float = column(
        "s", "largest age, the beginning and the end included", worst=LARGEST
    )
    latency_mean_s: float | None = column("s", "mean time from ping to delivery", worst=LARGEST)
    latency_p95_s: float | None = column("s", "95 % quantile of the latency", worst=LARGEST)
    latency_max_s: float | None = column("s", "largest latency", worst=LARGEST)
    latency_from_broadcast_s: float | None = column(
        "s", "mean time from broadcast to delivery; null where nothing is broadcast", worst=LARGEST
    )
    latency_from_slot_s: float | None = column(
        "s",
        "mean time from the end of the ping's slot to delivery; null where slots have no T_UL, "
        "pings do not begin with them (twtt, random access) or fixes do not wait for their end",
        worst=LARGEST,
    )
    fix_error_rms_m: float | None = column(
        "m", "RMS of the horizontal error of the fixes", worst=LARGEST
    )
    position_error_m: float = column(
        "m", "time mean of horizontal |estimate - truth|", worst=LARGEST
    )
    position_error_rms_m: float = column(
        "m", "time RMS of horizontal |estimate - truth|", worst=LARGEST
    )
    position_error_p95_m: float = column(
        "m", "95 % of the time the error is below this", worst=LARGEST
    )
    position_error_max_m: float = column(
        "m", "largest horizontal |estimate - truth|", worst=LARGEST
    )
    cross_track_error_m: float = column(
        "m", "time mean of |estimate - truth| across the heading", worst=LARGEST
    )
    path_error_m: float | None = column(
        "m", "time mean distance of the truth from the path", worst=LARGEST
    )
    imu_error_m: float = column(
        "m", "time mean error of dead reckoning without any fix", worst=LARGEST
    )
    fix_benefit_m: float = column(
        "m",
        "imu_error_m - position_error_m: what fixes are worth; negative: they do harm",
        worst=SMALLEST,
    )
    nees: float | None = column(
        "1",
        "time mean of the normalised estimation error squared, while the estimate is uncertain; 2 "
        "where covariances are right",
    )
    nis: float | None = column(
        "1", "mean normalised innovation squared of the fixes; 2 where covariances are right"
    )
    fixes_refused: int = column(
        "1", "fixes delivered that the navigator's gate refused", worst=LARGEST
    )
    energy_j: float | None = column(
        "J", "electrical energy of its modems (acoustics.hf and .mf powers); null without any"
    )
    energy_per_fix_j: float | None = column(
        "J", "that energy for each fix delivered; null without any"
    )
    distance_m: float = column("m", "distance travelled")
    speed_m_per_s: float = column("m/s", "mean speed over ground")
    saturated_share: float | None = column(
        "1",
        "share of control instants with an actuator at its limit (vehicles with dynamics)",
        worst=LARGEST,
    )
    lanes_flown_share: float | None = column(
        "1", "length of its lanes that the AUV has flown / their whole length", None
    )
    swept_m2: float | None = column(
        "m2", "area of the survey that the AUV was the first to sweep", None
    )
    least_altitude_m: float | None = column(
        "m",
        "least height above the bottom at the samples of metrics, 0 or less in the ground; null "
        "without environment.bathymetry",
        None,
        worst=SMALLEST,
    )
    lock_share: float | None = column(
        "1",
        "share of the samples of metrics at which its log saw the bottom; null without "
        "navigation.dvl_range_m",
        None,
        worst=SMALLEST,
    )
    slots_missed: int = column(
        "1",
        "slots of its own that it did not know as they began (knowledge: broadcast)",
        0,
        worst=LARGEST,
    )
    gnss_fixes: int = column(
        "1", "GNSS fixes at the surface that the navigator has taken (navigation.gnss_fix)", 0
    )


@dataclass(slots=True)
class Utilisation:
    """Metrics that only the mission as a whole has.

    Its other columns are the fleet means of AuvMetrics and, for each metric that can be bad, the
    worst AUV's value, `worst_<metric>`, with that AUV's name, `worst_<metric>_auv`.
    """

    rounds: int = column("1", "rounds begun")
    collisions: int = column(
        "1",
        "receptions of pings and calls, on HF, that another one destroyed, of all AUVs in all of "
        "the mission",
    )
    frame_collisions: int = column(
        "1",
        "receptions of frames, on MF, that another frame or ping destroyed, at all AUVs in all of "
        "the mission",
    )
    hf_utilisation: float = column(
        "1", "share of the time in which some ping or call is being sent"
    )
    mf_utilisation: float = column("1", "share of the time in which a broadcast is on the air")
    energy_j: float | None = column(
        "J", "electrical energy of the modems of all AUVs and ASVs; null without powers"
    )
    energy_per_fix_j: float | None = column(
        "J", "that energy for each fix delivered to an AUV; null without any"
    )
    duration_s: float = column("s", "length of the mission")
    area_covered_m2: float | None = column(
        "m2", "area of the survey within half a swath of the way of some AUV", None
    )
    area_covered_share: float | None = column("1", "that area / the area of the survey", None)
    survey_finished_at_s: float | None = column(
        "s", "instant at which the last AUV had flown all its lanes; null if one has not", None
    )
    fairness: float | None = column(
        "1",
        "Jain's index of the AUVs' fix rates: 1 where all are equal, 1 / number of AUVs where one "
        "has all; null without any fix",
        None,
    )
    throughput_bps: float | None = column(
        "bit/s",
        "8 x acoustics.mf.fix_bytes x fixes delivered / duration; null where no frame carries them",
        None,
    )
    fix_latency_p50_s: float | None = column(
        "s", "median time from ping to delivery of all fixes delivered", None
    )
    fix_latency_p95_s: float | None = column(
        "s", "95 % quantile of the time from ping to delivery of all fixes delivered", None
    )
    packet_delivery_ratio: float | None = column(
        "1",
        "data packets that an ASV decoded / made, those that wait at the end among them; null "
        "without any (traffic)",
        None,
    )
    goodput_bps: float | None = column(
        "bit/s", "bits of data packets delivered / duration; null without traffic", None
    )
    packet_latency_s: float | None = column(
        "s", "mean time from when a data packet is made to its delivery; null without any", None
    )
    packet_fairness: float | None = column(
        "1", "Jain's index of the AUVs' data packets delivered; null without any", None
    )


NAMES = {
    "pings": "pings sent",
    "pings_in_range": "pings in HF range",
    "pings_heard": "pings decoded",
    "hf_coverage": "pings in HF range",
    "fixes": "fixes made",
    "fixes_delivered": "fixes delivered",
    "fixes_out_of_range": "fixes beyond MF range",
    "fixes_lost": "fixes not decoded on MF",
    "fixes_in_flight": "fixes in flight at the end",
    "receptions_lost": "receptions lost",
    "collisions": "collisions on HF",
    "frame_collisions": "collisions on MF",
    "fix_rate_hz": "fix rate",
    "interval_mean_s": "mean interval between fixes",
    "interval_p95_s": "interval between fixes, 95 % below",
    "interval_max_s": "longest interval between fixes",
    "fix_age_mean_s": "mean age of the last fix",
    "fix_age_p95_s": "age of the last fix, 95 % of the time",
    "fix_age_max_s": "largest age of the last fix",
    "latency_mean_s": "mean latency",
    "latency_p95_s": "latency, 95 % below",
    "latency_max_s": "largest latency",
    "latency_from_broadcast_s": "mean latency from the broadcast",
    "latency_from_slot_s": "mean latency from the slot's end",
    "fix_error_rms_m": "RMS error of fixes",
    "position_error_m": "mean position error",
    "position_error_rms_m": "RMS position error",
    "position_error_p95_m": "position error, 95 % of the time",
    "position_error_max_m": "largest position error",
    "cross_track_error_m": "mean cross-track error",
    "path_error_m": "mean path error",
    "imu_error_m": "mean error without fixes",
    "fix_benefit_m": "error that fixes save",
    "nees": "normalised estimation error squared",
    "nis": "normalised innovation squared",
    "fixes_refused": "fixes refused by the gate",
    "energy_j": "acoustic energy",
    "energy_per_fix_j": "acoustic energy per fix",
    "distance_m": "distance travelled",
    "speed_m_per_s": "mean speed over ground",
    "saturated_share": "time at an actuator's limit",
    "lanes_flown_share": "lanes flown",
    "swept_m2": "area swept first",
    "least_altitude_m": "least altitude",
    "lock_share": "share with bottom lock",
    "slots_missed": "slots missed",
    "gnss_fixes": "GNSS fixes",
    "rounds": "rounds",
    "hf_utilisation": "HF in use",
    "mf_utilisation": "MF in use",
    "duration_s": "length of the mission",
    "area_covered_m2": "area covered",
    "area_covered_share": "survey covered",
    "survey_finished_at_s": "survey finished at",
    "fairness": "fairness of fix rates",
    "throughput_bps": "throughput of fixes",
    "fix_latency_p50_s": "median latency of all fixes",
    "fix_latency_p95_s": "latency of all fixes, 95 % below",
    "packet_delivery_ratio": "data delivered",
    "goodput_bps": "goodput of data",
    "packet_latency_s": "mean latency of data",
    "packet_fairness": "fairness of data",
}

UNITS: dict[str, str] = {
    column.name: column.metadata["unit"]
    for kind in (AuvMetrics, Utilisation)
    for column in fields(kind)
}
# What has no unit is a count, but for these.
SHARES = (
    "hf_coverage", "saturated_share", "hf_utilisation", "mf_utilisation", "lanes_flown_share",
    "area_covered_share", "fairness", "packet_delivery_ratio", "packet_fairness",
)  # fmt: skip

WORST = "worst_"

# End of messages about an unknown metric
METRICS_ARE = "; metrics are columns of the tables auvs and mission (docs/reference.md)"

# For each metric that can be bad: whether the largest value is the worst.
WORST_IS_LARGEST = {
    field.name: field.metadata["worst"] == LARGEST
    for field in fields(AuvMetrics)
    if field.metadata["worst"]
}


def of_an_auv(metric: str) -> str:
    """Return the AUV metric from which a mission's metric is made.

    >>> of_an_auv("worst_latency_mean_s"), of_an_auv("rounds")
    ('latency_mean_s', 'rounds')
    """
    return metric.removeprefix(WORST)


def lower_is_better(metric: str) -> bool | None:
    """Return whether lower values are better, None where neither is.

    >>> [lower_is_better(name) for name in ("worst_fix_age_max_s", "fix_rate_hz", "rounds")]
    [True, False, None]
    """
    return WORST_IS_LARGEST.get(of_an_auv(metric))


def name_of(metric: str) -> str:
    """Return the name of a metric of an AUV or a mission, without its unit.

    >>> name_of("position_error_m"), name_of("worst_position_error_m")
    ('mean position error', "worst AUV's mean position error")
    """
    if metric.startswith(WORST):
        return f"worst AUV's {NAMES[of_an_auv(metric)]}"
    return NAMES[metric]


def unit_of(metric: str) -> str:
    """Return the unit of a metric: an SI unit, or what it counts.

    >>> unit_of("worst_fix_age_max_s"), unit_of("fixes"), unit_of("hf_coverage")
    ('s', 'count', 'share')
    """
    own = of_an_auv(metric)
    return ("share" if own in SHARES else "count") if UNITS[own] == "1" else UNITS[own]


def metrics() -> dict[str, tuple[str, str]]:
    """Return unit and meaning of each metric of an AUV or a mission, by its name."""
    columns = [column for kind in (AuvMetrics, Utilisation) for column in fields(kind)]
    named = [column for column in columns if column.name in NAMES]
    return {column.name: (unit_of(column.name), column.metadata["meaning"]) for column in named}


def quantity(metric: str) -> str:
    """Return name and unit of a metric, for an axis.

    >>> quantity("position_error_p95_m"), quantity("fix_rate_hz")
    ('position error, 95 % of the time (m)', 'fix rate (Hz)')
    """
    return f"{name_of(metric)} ({unit_of(metric)})"
