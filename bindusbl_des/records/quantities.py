"""What metrics are called where people read them: axes, menus, tables."""

from dataclasses import fields

from .metrics import AuvMetrics, Utilisation

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
    "slots_missed": "slots missed",
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
}

UNITS: dict[str, str] = {
    column.name: column.metadata["unit"]
    for it in (AuvMetrics, Utilisation)
    for column in fields(it)
}
# What has no unit is a count, but for these.
SHARES = (
    "hf_coverage", "saturated_share", "hf_utilisation", "mf_utilisation", "lanes_flown_share",
    "area_covered_share", "fairness",
)  # fmt: skip

WORST = "worst_"


def name_of(metric: str) -> str:
    """Return what a metric of an AUV or a mission is called, without its unit.

    >>> name_of("position_error_m"), name_of("worst_position_error_m")
    ('mean position error', "worst AUV's mean position error")
    """
    if metric.startswith(WORST):
        return f"worst AUV's {NAMES[metric.removeprefix(WORST)]}"
    return NAMES[metric]


def unit_of(metric: str) -> str:
    """Return the unit of a metric: of the SI, or what it counts in.

    >>> unit_of("worst_fix_age_max_s"), unit_of("fixes"), unit_of("hf_coverage")
    ('s', 'count', 'share')
    """
    own = metric.removeprefix(WORST)
    return ("share" if own in SHARES else "count") if UNITS[own] == "1" else UNITS[own]


def metrics() -> dict[str, tuple[str, str]]:
    """Return unit and meaning of each metric of an AUV or a mission, by its name."""
    columns = [column for it in (AuvMetrics, Utilisation) for column in fields(it)]
    names = [column for column in columns if column.name in NAMES]
    return {it.name: (unit_of(it.name), it.metadata["meaning"]) for it in names}


def quantity(metric: str) -> str:
    """Return name and unit of a metric, as an axis bears them.

    >>> quantity("position_error_p95_m"), quantity("fix_rate_hz")
    ('position error, 95 % of the time (m)', 'fix rate (Hz)')
    """
    return f"{name_of(metric)} ({unit_of(metric)})"
