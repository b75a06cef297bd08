"""What can happen in a mission, in the words of its result tables.

Each class is one kind of row: its fields are the columns of the table of the same name, with unit
and meaning.  An instant is in seconds of mission time, a position in the survey frame: x north, y
east, z down from the surface (metres).  What has not happened is ``None``.
"""

from dataclasses import MISSING, dataclass, field
from typing import Any


def column(unit: str, meaning: str, default: Any = MISSING, worst: str = "") -> Any:
    """Describe one column: its unit ("" for names and labels) and its meaning.

    `worst` says of a metric which of a fleet's values is the worst one, LARGEST or SMALLEST; empty
    for what is neither good nor bad.
    """
    return field(default=default, metadata={"unit": unit, "meaning": meaning, "worst": worst})


LARGEST, SMALLEST = "largest", "smallest"


# What becomes of a ping at an ASV, and of a fix; a buffer holds the number of the word.
OUTCOMES = ("heard", "out_of_range", "lost", "collided", "in_flight", "delivered")
HEARD, OUT_OF_RANGE, LOST, COLLIDED, IN_FLIGHT, DELIVERED = range(6)


@dataclass(slots=True)
class Round:
    """One round: every AUV has had its turn to ping, and the fixes have been broadcast.

    With passive ranging every ASV has had its turn.  With random access it is a downlink's cycle.
    """

    round: int = column("1", "number of the round")
    started_at_s: float = column("s", "start of the first uplink slot (random access: MF is free)")
    colours: int = column("1", "ping groups of the round (passive: ASVs; random access: 0)")
    conflicts: int = column("1", "pairs of AUVs that some ASV hears both of; passive: 0")
    uplink_s: float | None = column("s", "duration of its uplink slots, or until it sends", None)
    downlink_s: float | None = column("s", "duration of the downlink slots", None)
    fixes: int = column("1", "fixes broadcast (passive: made of its pings)", 0)
    assigned: int | None = column(
        "1", "AUVs that have a slot of it; null where all know at once (knowledge: shared)", None
    )
    informed: int | None = column("1", "of these, AUVs that knew their slot as it began", None)


@dataclass(slots=True)
class Ping:
    """One ping of one AUV on the HF uplink; with calls its turn, be it that no call reached it.

    A turn without an answer has all but a ping.  With passive ranging ASVs ping, and AUVs hear it.
    """

    ping: int = column("1", "number of the ping")
    round: int = column("1", "round in which it was sent")
    slot: int = column("1", "uplink slot (ping group) within the round")
    auv: int | None = column("", "AUV that pinged; null where an ASV did (passive)")
    sent_at_s: float = column("s", "instant at which the ping began, or of a call without answer")
    x_m: float = column("m", "true position of who pinged at that instant, north")
    y_m: float = column("m", "true position of who pinged at that instant, east")
    z_m: float = column("m", "true depth of who pinged at that instant")
    in_range_of: int = column(
        "1", "ASVs that work (passive: AUVs) within HF range at that instant", 0
    )
    heard_by: int = column("1", "ASVs (passive: AUVs) that decoded the ping", 0)
    called_at_s: float | None = column("s", "instant at which it was called (twtt, polling)", None)
    called_by: int | None = column("", "ASV that called it (twtt, polling)", None)
    call: str | None = column(
        "", "what became of the call: heard (it answers), out_of_range, lost, collided, in_flight",
        None,
    )  # fmt: skip
    asv: int | None = column("", "ASV that pinged (passive)", None)
    waited_s: float | None = column("s", "how long its AUV held back, hearing pings (csma)", None)


@dataclass(slots=True)
class Reception:
    """One ping at one ASV, or with passive ranging at one AUV, whether it was decoded or not."""

    ping: int = column("1", "number of the ping")
    auv: int = column("", "AUV that pinged (passive: at which it arrives)")
    asv: int = column("", "ASV at which it arrives (passive: that pinged)")
    arrived_at_s: float | None = column(
        "s", "instant at which the ping's front is heard there; null if no call made it ping"
    )
    slant_range_m: float = column("m", "distance of that way")
    travel_time_s: float = column("s", "one-way travel time")
    outcome: str = column(
        "", "heard, out_of_range (or its ASV had failed), lost (or it failed meanwhile), collided "
        "or in_flight; without a ping, its call's",
        "in_flight",
    )  # fmt: skip
    snr_db: float | None = column(
        "dB",
        "signal-to-noise ratio in the band, with this ping's shadowing once it is decided; null "
        "with channels that know of none (disc, curve, one's own)",
        None,
    )
    level_db: float | None = column("dB re 1 uPa", "level of the ping there, of that SNR", None)
    margin_db: float | None = column(
        "dB", "snr_db less that at which half of all pings are decoded: heard from 0 on", None
    )


@dataclass(slots=True)
class Broadcast:
    """One frame of fixes on the MF downlink."""

    round: int = column("1", "round whose fixes it carries")
    asv: int = column("", "ASV that broadcast")
    sent_at_s: float = column("s", "start of the frame")
    airtime_s: float = column("s", "duration of the frame, or until its ASV failed")
    payload_bytes: int = column("B", "header, fix records and assignments of slots")
    fixes: int = column("1", "fix records in the frame")
    part: int = column("1", "number of the frame among those of one broadcast, from 0", 0)
    named: int = column("1", "AUVs that it tells their slot (knowledge: broadcast)", 0)


@dataclass(slots=True)
class Fix:
    """One position fix of one AUV, fused over the ASVs that heard the same ping.

    With passive ranging the AUV has measured the ping of an ASV itself: nobody broadcasts it.
    """

    fix: int = column("1", "number of the fix")
    ping: int = column("1", "ping that it locates")
    round: int = column("1", "round of that ping")
    auv: int = column("", "AUV that it locates")
    asvs: str = column("", "ASVs whose measurements were fused (passive: that pinged)")
    pinged_at_s: float = column("s", "instant at which that ping was sent")
    valid_at_s: float = column("s", "instant at which the fix holds")
    x_m: float = column("m", "position, north")
    y_m: float = column("m", "position, east")
    z_m: float = column("m", "depth")
    sd_x_m: float = column("m", "standard deviation of x_m")
    sd_y_m: float = column("m", "standard deviation of y_m")
    sd_z_m: float = column("m", "standard deviation of z_m")
    cov_xy_m2: float = column("m2", "covariance of x_m and y_m")
    cov_xz_m2: float = column("m2", "covariance of x_m and z_m")
    cov_yz_m2: float = column("m2", "covariance of y_m and z_m")
    error_m: float = column("m", "horizontal distance to the AUV's true position at valid_at_s")
    broadcast_at_s: float | None = column("s", "start of the frame that carries it", None)
    broadcast_by: int | None = column("", "ASV that broadcast it", None)
    delivered_at_s: float | None = column("s", "instant at which the AUV has it", None)
    latency_s: float | None = column("s", "from ping to delivery", None)
    innovation_m: float | None = column("m", "horizontal length of the innovation", None)
    correction_m: float | None = column(
        "m", "how far the fix moved the estimate; null if the navigator refused it", None
    )
    nis: float | None = column("1", "normalised innovation squared, 2 degrees of freedom", None)
    outcome: str = column(
        "",
        "delivered, out_of_range, lost (not decoded: acoustics.mf.channel; or its ASV failed as it "
        "broadcast it), collided (its frame, at the AUV) or in_flight",
        "in_flight",
    )


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
    fixes_out_of_range: int = column("1", "fixes broadcast beyond MF range", worst=LARGEST)
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
        "1", "receptions destroyed by an overlapping ping or call, or their call", worst=LARGEST
    )
    fix_rate_hz: float = column("Hz", "fixes delivered / duration", worst=SMALLEST)
    interval_mean_s: float | None = column("s", "mean time between deliveries", worst=LARGEST)
    interval_p95_s: float | None = column(
        "s", "95 % quantile of the time between deliveries", worst=LARGEST
    )
    interval_max_s: float | None = column("s", "longest time between deliveries", worst=LARGEST)
    fix_age_mean_s: float = column(
        "s",
        "time mean of the time since the last fix took effect, or since the start",
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
    slots_missed: int = column(
        "1",
        "slots of its own that it did not know as they began (knowledge: broadcast)",
        0,
        worst=LARGEST,
    )


@dataclass(slots=True)
class Utilisation:
    """What only the mission as a whole has.

    Its other columns are the fleet means of AuvMetrics and, for each metric that can be bad, the
    worst AUV's value, `worst_<metric>`, with that AUV's name, `worst_<metric>_auv`.
    """

    rounds: int = column("1", "rounds begun")
    collisions: int = column(
        "1", "receptions destroyed by an overlapping ping or call, or their call, all AUVs"
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
