"""Metrics of a mission, for each AUV and as a whole, in the words of the result tables, and their
names for axes, menus and tables.

A mission is judged by its worst AUV: the largest of errors, ages, intervals, latencies and losses,
the smallest of coverage, fixes and rates (:class:`.metrics.AuvMetrics` says which).  An AUV without
a value, because it got no fix, is worse than any with one.  Among equals the first counts.
"""

from dataclasses import MISSING, dataclass, fields
from typing import Any

from .events import LARGEST, SMALLEST, column


def metric(
    unit: str,
    name: str,
    meaning: str,
    default: Any = MISSING,
    *,
    worst: str = "",
    less: bool | None = None,
) -> Any:
    """Describe a metric: its unit, its name on axes and in menus, its meaning.

    A number without a unit is a `share`, or else a count or a ratio ("1").  `worst` is as of
    :func:`.events.column`; of a metric without, `less` says whether a goal of a plan asks for less
    of it, None where it may ask for either.
    """
    counted = {"1": "count"}.get(unit, unit)
    less = worst == LARGEST if worst else less
    told = {"name": name, "counted": counted, "less": less}
    return column("1" if unit == "share" else unit, meaning, default, worst, **told)


@dataclass(slots=True)
class AuvMetrics:
    """One AUV over the whole mission; time means are over samples at record.metrics_hz."""

    auv: int = column("", "AUV")
    pings: int = metric(
        "1",
        "pings sent",
        "pings sent, and turns whose call got no answer; passive: pings of all ASVs",
    )
    pings_in_range: int = metric(
        "1",
        "pings in HF range",
        "pings within HF range of at least one ASV (passive: of the AUV)",
        worst=SMALLEST,
    )
    pings_heard: int = metric(
        "1",
        "pings decoded",
        "pings decoded by at least one ASV (passive: by the AUV)",
        worst=SMALLEST,
    )
    hf_coverage: float | None = metric(
        "share",
        "pings in HF range",
        "pings in range / pings, without those still under way",
        worst=SMALLEST,
    )
    fixes: int = metric("1", "fixes made", "fixes made", worst=SMALLEST)
    fixes_delivered: int = metric(
        "1", "fixes delivered", "fixes that reached the AUV", worst=SMALLEST
    )
    fixes_out_of_range: int = metric(
        "1",
        "fixes beyond MF range",
        "fixes broadcast beyond MF range, or behind land",
        worst=LARGEST,
    )
    fixes_lost: int = metric(
        "1",
        "fixes not decoded on MF",
        "fixes broadcast that the AUV could have decoded, but did not",
        worst=LARGEST,
    )
    fixes_in_flight: int = metric(
        "1",
        "fixes in flight at the end",
        "fixes not yet delivered when the mission ended",
        worst=LARGEST,
    )
    receptions_lost: int = metric(
        "1",
        "receptions lost",
        "receptions in range lost to the channel, or their call",
        worst=LARGEST,
    )
    collisions: int = metric(
        "1",
        "collisions on HF",
        "receptions of its pings (passive: of pings at it) and of calls at it, on HF, that another "
        "ping or call destroyed",
        worst=LARGEST,
    )
    frame_collisions: int = metric(
        "1",
        "collisions on MF",
        "receptions of frames at it, on MF, that another frame (protocol.duplex: or its ping) "
        "destroyed",
        worst=LARGEST,
    )
    fix_rate_hz: float = metric("Hz", "fix rate", "fixes delivered / duration", worst=SMALLEST)
    interval_mean_s: float | None = metric(
        "s", "mean interval between fixes", "mean time between deliveries", worst=LARGEST
    )
    interval_p95_s: float | None = metric(
        "s",
        "interval between fixes, 95 % below",
        "95 % quantile of the time between deliveries",
        worst=LARGEST,
    )
    interval_max_s: float | None = metric(
        "s", "longest interval between fixes", "longest time between deliveries", worst=LARGEST
    )
    fix_age_mean_s: float = metric(
        "s",
        "mean age of the last fix",
        "time mean of the time since the ping of the newest fix that the navigator has taken, or "
        "since the start",
        worst=LARGEST,
    )
    fix_age_p95_s: float = metric(
        "s",
        "age of the last fix, 95 % of the time",
        "95 % of the time that age is below this",
        worst=LARGEST,
    )
    fix_age_max_s: float = metric(
        "s",
        "largest age of the last fix",
        "largest age, the beginning and the end included",
        worst=LARGEST,
    )
    latency_mean_s: float | None = metric(
        "s", "mean latency", "mean time from ping to delivery", worst=LARGEST
    )
    latency_p95_s: float | None = metric(
        "s", "latency, 95 % below", "95 % quantile of the latency", worst=LARGEST
    )
    latency_max_s: float | None = metric("s", "largest latency", "largest latency", worst=LARGEST)
    latency_from_broadcast_s: float | None = metric(
        "s",
        "mean latency from the broadcast",
        "mean time from broadcast to delivery; null where nothing is broadcast",
        worst=LARGEST,
    )
    latency_from_slot_s: float | None = metric(
        "s",
        "mean latency from the slot's end",
        "mean time from the end of the ping's slot to delivery; null where slots have no T_UL, "
        "pings do not begin with them (twtt, random access) or fixes do not wait for their end",
        worst=LARGEST,
    )
    fix_error_rms_m: float | None = metric(
        "m", "RMS error of fixes", "RMS of the horizontal error of the fixes", worst=LARGEST
    )
    position_error_m: float = metric(
        "m", "mean position error", "time mean of horizontal |estimate - truth|", worst=LARGEST
    )
    position_error_rms_m: float = metric(
        "m", "RMS position error", "time RMS of horizontal |estimate - truth|", worst=LARGEST
    )
    position_error_p95_m: float = metric(
        "m",
        "position error, 95 % of the time",
        "95 % of the time the error is below this",
        worst=LARGEST,
    )
    position_error_max_m: float = metric(
        "m", "largest position error", "largest horizontal |estimate - truth|", worst=LARGEST
    )
    cross_track_error_m: float = metric(
        "m",
        "mean cross-track error",
        "time mean of |estimate - truth| across the heading",
        worst=LARGEST,
    )
    path_error_m: float | None = metric(
        "m", "mean path error", "time mean distance of the truth from the path", worst=LARGEST
    )
    imu_error_m: float = metric(
        "m",
        "mean error without fixes",
        "time mean error of dead reckoning without any fix",
        worst=LARGEST,
    )
    fix_benefit_m: float = metric(
        "m",
        "error that fixes save",
        "imu_error_m - position_error_m: what fixes are worth; negative: they do harm",
        worst=SMALLEST,
    )
    nees: float | None = metric(
        "1",
        "normalised estimation error squared",
        "time mean of the normalised estimation error squared, while the estimate is uncertain; 2 "
        "where covariances are right",
    )
    nis: float | None = metric(
        "1",
        "normalised innovation squared",
        "mean normalised innovation squared of the fixes; 2 where covariances are right",
    )
    fixes_refused: int = metric(
        "1",
        "fixes refused by the gate",
        "fixes delivered that the navigator's gate refused",
        worst=LARGEST,
    )
    energy_j: float | None = metric(
        "J",
        "acoustic energy",
        "electrical energy of its modems (acoustics.hf and .mf powers); null without any",
        less=True,
    )
    energy_per_fix_j: float | None = metric(
        "J",
        "acoustic energy per fix",
        "that energy for each fix delivered; null without any",
        less=True,
    )
    distance_m: float = metric("m", "distance travelled", "distance travelled")
    speed_m_per_s: float = metric("m/s", "mean speed over ground", "mean speed over ground")
    saturated_share: float | None = metric(
        "share",
        "time at an actuator's limit",
        "share of control instants with an actuator at its limit (vehicles with dynamics)",
        worst=LARGEST,
    )
    lanes_flown_share: float | None = metric(
        "share",
        "lanes flown",
        "length of its lanes that the AUV has flown / their whole length",
        None,
    )
    swept_m2: float | None = metric(
        "m2", "area swept first", "area of the survey that the AUV was the first to sweep", None
    )
    least_altitude_m: float | None = metric(
        "m",
        "least altitude",
        "least height above the bottom at the samples of metrics, 0 or less in the ground; null "
        "without environment.bathymetry",
        None,
        worst=SMALLEST,
    )
    lock_share: float | None = metric(
        "share",
        "share with bottom lock",
        "share of the samples of metrics at which its log saw the bottom; null without "
        "navigation.dvl_range_m",
        None,
        worst=SMALLEST,
    )
    slots_missed: int = metric(
        "1",
        "slots missed",
        "slots of its own that it did not know as they began (knowledge: broadcast)",
        0,
        worst=LARGEST,
    )
    gnss_fixes: int = metric(
        "1",
        "GNSS fixes",
        "GNSS fixes at the surface that the navigator has taken (navigation.gnss_fix)",
        0,
    )


@dataclass(slots=True)
class Utilisation:
    """Metrics that only the mission as a whole has.

    Its other columns are the fleet means of AuvMetrics and, for each metric that can be bad, the
    worst AUV's value, `worst_<metric>`, with that AUV's name, `worst_<metric>_auv`.
    """

    rounds: int = metric("1", "rounds", "rounds begun")
    collisions: int = metric(
        "1",
        "collisions on HF",
        "receptions of pings and calls, on HF, that another one destroyed, of all AUVs in all of "
        "the mission",
        less=True,
    )
    frame_collisions: int = metric(
        "1",
        "collisions on MF",
        "receptions of frames, on MF, that another frame or ping destroyed, at all AUVs in all of "
        "the mission",
        less=True,
    )
    hf_utilisation: float = metric(
        "share", "HF in use", "share of the time in which some ping or call is being sent"
    )
    mf_utilisation: float = metric(
        "share", "MF in use", "share of the time in which a broadcast is on the air"
    )
    energy_j: float | None = metric(
        "J",
        "acoustic energy",
        "electrical energy of the modems of all AUVs and ASVs; null without powers",
        less=True,
    )
    energy_per_fix_j: float | None = metric(
        "J",
        "acoustic energy per fix",
        "that energy for each fix delivered to an AUV; null without any",
        less=True,
    )
    duration_s: float = metric("s", "length of the mission", "length of the mission")
    area_covered_m2: float | None = metric(
        "m2",
        "area covered",
        "area of the survey within half a swath of the way of some AUV",
        None,
        less=False,
    )
    area_covered_share: float | None = metric(
        "share", "survey covered", "that area / the area of the survey", None, less=False
    )
    survey_finished_at_s: float | None = metric(
        "s",
        "survey finished at",
        "instant at which the last AUV had flown all its lanes; null if one has not",
        None,
        less=True,
    )
    fairness: float | None = metric(
        "share",
        "fairness of fix rates",
        "Jain's index of the AUVs' fix rates: 1 where all are equal, 1 / number of AUVs where one "
        "has all; null without any fix",
        None,
        less=False,
    )
    throughput_bps: float | None = metric(
        "bit/s",
        "throughput of fixes",
        "8 x acoustics.mf.fix_bytes x fixes delivered / duration; null where no frame carries them",
        None,
        less=False,
    )
    fix_latency_p50_s: float | None = metric(
        "s",
        "median latency of all fixes",
        "median time from ping to delivery of all fixes delivered",
        None,
        less=True,
    )
    fix_latency_p95_s: float | None = metric(
        "s",
        "latency of all fixes, 95 % below",
        "95 % quantile of the time from ping to delivery of all fixes delivered",
        None,
        less=True,
    )
    packet_delivery_ratio: float | None = metric(
        "share",
        "data delivered",
        "data packets that an ASV decoded / made, those that wait at the end among them; null "
        "without any (traffic)",
        None,
    )
    goodput_bps: float | None = metric(
        "bit/s",
        "goodput of data",
        "bits of data packets delivered / duration; null without traffic",
        None,
    )
    packet_latency_s: float | None = metric(
        "s",
        "mean latency of data",
        "mean time from when a data packet is made to its delivery; null without any",
        None,
    )
    packet_fairness: float | None = metric(
        "share",
        "fairness of data",
        "Jain's index of the AUVs' data packets delivered; null without any",
        None,
    )


# What is said of each metric of an AUV or a mission.
_TOLD = {
    told.name: told.metadata
    for kind in (AuvMetrics, Utilisation)
    for told in fields(kind)
    if "name" in told.metadata
}
LESS_IS_BETTER = {name: told["less"] for name, told in _TOLD.items() if told["less"] is not None}

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
        return f"worst AUV's {_TOLD[of_an_auv(metric)]['name']}"
    return str(_TOLD[metric]["name"])


def unit_of(metric: str) -> str:
    """Return the unit of a metric: an SI unit, or what it counts.

    >>> unit_of("worst_fix_age_max_s"), unit_of("fixes"), unit_of("hf_coverage")
    ('s', 'count', 'share')
    """
    return str(_TOLD[of_an_auv(metric)]["counted"])


def metrics() -> dict[str, tuple[str, str]]:
    """Return unit and meaning of each metric of an AUV or a mission, by its name."""
    return {name: (unit_of(name), told["meaning"]) for name, told in _TOLD.items()}


def quantity(metric: str) -> str:
    """Return name and unit of a metric, for an axis.

    >>> quantity("position_error_p95_m"), quantity("fix_rate_hz")
    ('position error, 95 % of the time (m)', 'fix rate (Hz)')
    """
    return f"{name_of(metric)} ({unit_of(metric)})"
