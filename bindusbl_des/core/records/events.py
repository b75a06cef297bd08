"""Events of a mission, in the words of its result tables.

Each class is one kind of row: its fields are the columns of the table of the same name, with unit
and meaning.  An instant is in seconds of mission time, a position in the survey frame: x north, y
east, z down from the surface (metres).  A value is ``None`` if its event has not happened.
"""

from dataclasses import MISSING, dataclass, field
from typing import Any

# Stands for no vehicle, or no outcome: null in tables
NONE = -1

# Which of a fleet's values of a metric is the worst one
LARGEST, SMALLEST = "largest", "smallest"


def column(unit: str, meaning: str, default: Any = MISSING, worst: str = "", **more: Any) -> Any:
    """Describe one column: its unit ("" for names and labels) and its meaning.

    `worst` says which of a fleet's values of a metric is the worst, LARGEST or SMALLEST; empty
    where neither is good or bad; `more` is what a metric says beside.
    """
    told = {"unit": unit, "meaning": meaning, "worst": worst, **more}
    return field(default=default, metadata=told)


# Outcomes of receptions and fixes; a buffer stores the index of the word.
OUTCOMES = ("heard", "out_of_range", "lost", "collided", "in_flight", "delivered", "blocked")
HEARD, OUT_OF_RANGE, LOST, COLLIDED, IN_FLIGHT, DELIVERED, BLOCKED = range(7)

# Reasons why a signal was not decoded, beside out of range; indices go on behind the outcomes.
REASONS = (
    *("failed", "failed_meanwhile", "unanswered", "chance", "burst"),
    *("ping", "echo", "call", "frame", "own_frame", "own_ping", "signal", "own_signal"),
    *("auv_frame", "packet", "own_packet", "doppler"),
)
WORDS = (*OUTCOMES, *REASONS)
FAILED, FAILED_MEANWHILE, UNANSWERED, CHANCE, BURST = range(7, 12)
BY_PING, BY_ECHO, BY_CALL, BY_FRAME, BY_OWN_FRAME, BY_OWN_PING = range(12, 18)
BY_SIGNAL, BY_OWN_SIGNAL, BY_AUV_FRAME, BY_PACKET, BY_OWN_PACKET = range(18, 23)
DOPPLER = 23

# Columns with reasons, and columns of systematic errors of a measurement
TOLD_WHY = ("why", "overlapped_by", "loss_probability")
LASTING_ERRORS = (
    *("misalignment_deg", "gnss_error_x_m", "gnss_error_y_m"),
    *("slow_range_error_m", "clock_late_s"),
)

# Reference and sense of angles
NORTH, AHEAD, DOWN = "from north towards east", "from ahead towards starboard", "positive downwards"

# Columns that several tables have: unit and meaning
COMES_AT = "s", "instant at which it begins there; null if it did not by the end"
BECAME = (
    "",
    "heard, out_of_range (a sound, but not decoded), blocked (by land), lost, collided or "
    "in_flight",
)
LISTENER = "", "vehicle at which it arrives"
CHANCE_LOST = "1", "how likely it was lost, had nothing overlapped it"
INNOVATION = "m", "horizontal length of the innovation"
CORRECTION = "m", "how far the fix moved the estimate; null if the navigator refused it"
NIS = "1", "normalised innovation squared, 2 degrees of freedom"
SLOT = "1", "uplink slot (ping group) within the round"
AIRTIME = "s", "how long it lasts"
BEGAN = "s", "instant at which it began"
SIZE = "B", "size of what it says"


@dataclass(slots=True)
class Round:
    """One round: every AUV has had its turn to ping, and the fixes have been broadcast.

    With passive ranging every ASV has had its turn; with random access it is a downlink's cycle.
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
    """One ping of one AUV on the HF uplink; with calls its turn, even if no call reached it.

    A turn without an answer has all but a ping.  With passive ranging ASVs ping, and AUVs hear it.
    """

    ping: int = column("1", "number of the ping")
    round: int = column("1", "round in which it was sent")
    slot: int = column(*SLOT)
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
        "",
        "what became of the call: heard (it answers), out_of_range, blocked (by land), lost, "
        "collided, in_flight",
        None,
    )
    asv: int | None = column("", "ASV that pinged (passive)", None)
    waited_s: float | None = column("s", "how long its AUV held back, hearing pings (csma)", None)
    call_why: str | None = column(
        "",
        "why the AUV did not decode the call: out_of_range, blocked, chance, burst (lost with "
        "those before), doppler (the way changed too fast), failed_meanwhile (its ASV, as it "
        "called), call, ping, packet or signal (that overlapped it), own_ping, own_packet or "
        "own_signal (the AUV sent it meanwhile)",
        None,
    )


@dataclass(slots=True)
class Reception:
    """One ping at one ASV, or with passive ranging at one AUV, whether decoded or not."""

    ping: int = column("1", "number of the ping")
    auv: int = column("", "AUV that pinged (passive: at which it arrives)")
    asv: int = column("", "ASV at which it arrives (passive: that pinged)")
    arrived_at_s: float | None = column(
        "s", "instant at which the ping's front is heard there; null if no call made it ping"
    )
    slant_range_m: float = column("m", "distance of that way")
    travel_time_s: float = column("s", "one-way travel time")
    outcome: str = column(
        "",
        "heard, out_of_range (or its ASV had failed), blocked (land is between), lost (or it "
        "failed meanwhile), collided or in_flight; without a ping, its call's",
        "in_flight",
    )
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
    azimuth_deg: float | None = column(
        "deg", f"measured direction, in [0, 360): of the AUV (passive: of the ASV), {NORTH}", None
    )
    elevation_deg: float | None = column("deg", f"measured direction, {DOWN}", None)
    body_azimuth_deg: float | None = column(
        "deg", f"the same as the array sees it, {AHEAD}, in [0, 360)", None
    )
    body_elevation_deg: float | None = column("deg", f"the same as the array sees it, {DOWN}", None)
    range_rate_m_per_s: float | None = column(
        "m/s",
        "measured rate of that way, positive where it grows, of those heard; null without "
        "usbl.range_rate_sd_m_per_s",
        None,
    )
    why: str | None = column(
        "",
        "why it was not decoded: out_of_range, blocked, failed (its ASV, before it came), "
        "failed_meanwhile (passive: as it pinged), unanswered (no call made the AUV ping), chance, "
        "burst (lost with those before), doppler (the way changed faster than "
        "doppler_limit_m_per_s), or what overlapped it: ping, packet, echo, call, "
        "own_frame (that the ASV sent)",
        None,
    )
    overlapped_by: int | None = column(
        "1",
        "number of the ping that overlapped it (or whose echo did) or packet, the strongest of "
        "several; of the ASV that called; of the frame, row of broadcasts from 0",
        None,
    )
    loss_probability: float | None = column(
        "1", "how likely it was lost, had nothing overlapped it; null out of range, or failed", None
    )
    misalignment_deg: float | None = column(
        "deg",
        "constant error of the heading of who measured, an ASV (passive: an AUV; "
        "usbl.misalignment_sd_deg)",
        None,
    )
    gnss_error_x_m: float | None = column(
        "m",
        "slow error of where the ASV took itself for, north (usbl.gnss_correlated_sd_m; passive: "
        "as it pinged)",
        None,
    )
    gnss_error_y_m: float | None = column("m", "the same, east", None)
    slow_range_error_m: float | None = column(
        "m", "slow error of the range, of those heard (usbl.slow_share; not with calls)", None
    )
    clock_late_s: float | None = column(
        "s",
        "how late the AUV's clock was as it pinged (passive: heard; navigation.clock_*; not with "
        "calls)",
        None,
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

    With passive ranging the AUV has measured an ASV's ping itself: no ASV broadcasts the fix.
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
    innovation_m: float | None = column(*INNOVATION, None)
    correction_m: float | None = column(*CORRECTION, None)
    nis: float | None = column(*NIS, None)
    outcome: str = column(
        "",
        "delivered, out_of_range, blocked (land is between), lost (not decoded: "
        "acoustics.mf.channel; or its ASV failed as it broadcast it), collided (its frame, at the "
        "AUV) or in_flight",
        "in_flight",
    )
    azimuth_deg: float | None = column(
        "deg", f"measured direction as of receptions, {NORTH}; null for a fix of several ASVs", None
    )
    elevation_deg: float | None = column("deg", f"measured direction, {DOWN}; null as above", None)
    body_azimuth_deg: float | None = column(
        "deg", f"the same as the array sees it, {AHEAD}; null as above", None
    )
    body_elevation_deg: float | None = column(
        "deg", f"the same as the array sees it, {DOWN}; null as above", None
    )


@dataclass(slots=True)
class Packet:
    """One data packet of an AUV to the vessels, sent behind a ping (traffic)."""

    packet: int = column("1", "number of the packet")
    auv: int = column("", "AUV that has made it")
    made_at_s: float = column("s", "instant from which it waits for a ping of its AUV")
    size_bytes: int = column("B", "size of its data")
    sent_at_s: float | None = column("s", "instant at which it began; null if it did not", None)
    airtime_s: float | None = column("s", "how long it lasts", None)
    in_range_of: int = column("1", "ASVs that may decode it where nothing overlaps it", 0)
    heard_by: int = column("1", "ASVs that decoded it", 0)
    delivered_at_s: float | None = column(
        "s", "instant at which the first of them had it in full", None
    )
    delivered_to: int | None = column("", "that ASV", None)
    latency_s: float | None = column("s", "from when it was made to when it was delivered", None)
    outcome: str = column(
        "",
        "delivered; collided (at an ASV, and heard by none), lost, out_of_range, or in_flight: "
        "under way, or waiting, as the mission ended",
        "in_flight",
    )


@dataclass(slots=True)
class FixService:
    """Further columns of a fix, where AUVs acknowledge or relay frames, or ASVs repeat fixes."""

    hops: int | None = column(
        "1", "AUVs that forwarded the frame by which it came; null: it was not delivered"
    )
    relayed_by: str | None = column("", "AUV that forwarded it last; null: its ASV sent it")
    came_in: int | None = column(
        "1", "row of broadcasts, from 0, by which it came, or which was forwarded"
    )
    repeats: int = column("1", "further broadcasts that it was put into (protocol.repeat)")
    duplicates: int = column(
        "1", "copies that its AUV decoded once it had it, which correct nothing"
    )
    acknowledged_at_s: float | None = column(
        "s", "instant from which the fleet knows that its AUV has it; null: never"
    )


@dataclass(slots=True)
class AuvFrame:
    """One frame on MF that an AUV sent: a frame of fixes forwarded, or an acknowledgement."""

    auv_frame: int = column("1", "number of the frame among those of AUVs")
    kind: str = column("", "relay, or acknowledgement")
    auv: int = column("", "AUV that sent it")
    broadcast: int = column(
        "1", "row of broadcasts, from 0: the frame that it forwards, or was decoded by its sender"
    )
    hops: int = column(
        "1", "AUVs that have forwarded it, its sender among them; of an acknowledgement, how many "
        "had forwarded what it acknowledges",
    )  # fmt: skip
    sent_at_s: float = column(*BEGAN)
    airtime_s: float = column(*AIRTIME)
    payload_bytes: int = column(*SIZE)
    fixes: int = column("1", "fix records that it forwards, or fixes that it acknowledges")


@dataclass(slots=True)
class AuvFrameReception:
    """One frame of an AUV at one vehicle that it reaches."""

    auv_frame: int = column("1", "number of the frame among those of AUVs")
    listener: str = column(*LISTENER)
    arrived_at_s: float | None = column(*COMES_AT)
    outcome: str = column(*BECAME)
    why: str | None = column(
        "",
        "why it was not decoded: out_of_range, blocked, chance, doppler, failed_meanwhile (the "
        "ASV that listens), auv_frame or frame (that overlapped it), own_frame or own_ping (the "
        "listener sent it meanwhile)",
    )
    overlapped_by: int | None = column(
        "1", "number of the strongest that overlapped it; of a frame its row of broadcasts"
    )
    loss_probability: float | None = column(*CHANCE_LOST)


@dataclass(slots=True)
class Signal:
    """One signal on HF that a vehicle's program of access sent, beside pings."""

    signal: int = column("1", "number of the signal")
    kind: str = column("", "kind, as the program names it")
    sender: str = column("", "vehicle that sent it")
    to: str | None = column("", "vehicle that it is sent to; null: to all")
    sent_at_s: float = column(*BEGAN)
    lasts_s: float = column(*AIRTIME)
    size_bytes: int = column(*SIZE)
    level_db: float | None = column(
        "dB", "level at which it was sent, re 1 uPa at 1 m, where the program chose one"
    )
    ping: int | None = column(
        "1",
        "ping that it acknowledges; else the next of the AUV that sends it, or to which it is "
        "sent; null: there is none, or no program of access sent it",
        None,
    )


@dataclass(slots=True)
class SignalReception:
    """One signal, or ping of an AUV, at one vehicle that it reaches (protocol.access)."""

    signal: int | None = column("1", "signal that arrives; null: a ping")
    ping: int | None = column("1", "ping that arrives at another AUV; null: a signal")
    listener: str = column(*LISTENER)
    arrived_at_s: float | None = column(*COMES_AT)
    outcome: str = column(*BECAME)
    why: str | None = column(
        "",
        "why it was not decoded: out_of_range, blocked, chance, doppler, failed_meanwhile (one "
        "of both ASVs failed), ping, signal, call or own_frame (that overlapped it), own_ping or "
        "own_signal (it sent itself meanwhile)",
    )
    overlapped_by: int | None = column(
        "1", "number of the strongest that overlapped it; of a call the ASV's"
    )
    loss_probability: float | None = column(*CHANCE_LOST)


@dataclass(slots=True)
class PeerRange:
    """One AUV's measurement of another by that one's message (navigation.peers)."""

    peer_range: int = column("1", "number of the measurement")
    auv: int = column("", "AUV that measured")
    sender: str = column("", "AUV whose message it decoded")
    sent_at_s: float = column("s", "instant at which the message began to be sent")
    valid_at_s: float = column("s", "instant at which its front arrived, of which it tells")
    heard_at_s: float = column("s", "instant at which it was decoded")
    range_m: float | None = column("m", "measured slant range; null of angles alone")
    range_error_m: float | None = column(
        "m", "that less the true distance from where it was sent to where it arrived"
    )
    range_sd_m: float | None = column("m", "standard deviation of its white noise")
    azimuth_deg: float | None = column(
        "deg", f"measured direction of the sender, in [0, 360), {NORTH}; null without an array"
    )
    azimuth_error_deg: float | None = column("deg", "that less the true direction")
    azimuth_sd_deg: float | None = column("deg", "standard deviation of its white noise")
    elevation_deg: float | None = column(
        "deg", "measured direction of the sender, positive downwards; null without an array, or "
        "where a range says as much",
    )  # fmt: skip
    elevation_sd_deg: float | None = column("deg", "standard deviation of its white noise")
    depth_difference_m: float | None = column(
        "m", "how much deeper the sender is, by the pressure sensors of both"
    )
    innovation_m: float | None = column(
        "m", "how far it was off from what was believed; null if it came too late"
    )
    correction_m: float | None = column(
        "m", "how far it moved the estimate; null if the navigator refused it, or had no use for it"
    )
    nis: float | None = column(
        "1", "normalised innovation squared, a degree of freedom for each that was measured"
    )
    share: float | None = column(
        "1",
        "share w of covariance intersection: near 1 the AUV keeps what it knows; null elsewhere",
    )


@dataclass(slots=True)
class ModemLine:
    """One line between a modem and its host (modems)."""

    time_s: float = column("s", "instant at which it was said")
    vehicle: str = column("", "vehicle whose modem it is")
    said_by: str = column("", "host, or modem")
    line: str = column("", "the line without its end; bytes that are no ASCII text as \\xff")


@dataclass(slots=True)
class GnssFix:
    """One GNSS fix of an AUV at the surface (navigation.gnss_fix), which it has at once."""

    gnss_fix: int = column("1", "number of the fix")
    auv: int = column("", "AUV that made it")
    fixed_at_s: float = column("s", "instant at which it was made, and holds")
    x_m: float = column("m", "position, north")
    y_m: float = column("m", "position, east")
    sd_m: float = column("m", "standard deviation of each")
    error_m: float = column("m", "horizontal distance to the AUV's true position")
    innovation_m: float | None = column(*INNOVATION, None)
    correction_m: float | None = column(*CORRECTION, None)
    nis: float | None = column(*NIS, None)


@dataclass(slots=True)
class Assignment:
    """One slot of one AUV, which a frame should announce; recorded as the slot begins.

    There are none where all know the schedule at once (protocol.knowledge shared).
    """

    round: int = column("1", "round of the slot")
    slot: int = column(*SLOT)
    auv: int = column("", "AUV whose slot it is")
    starts_at_s: float = column("s", "start of the slot")
    told_at_s: float | None = column(
        "s", "start of the frame that names it; null where it was agreed at launch, or not received"
    )
    told_by: int | None = column("", "ASV that broadcast that frame")
    outcome: str = column("", "known, or missed: the AUV had not decoded that frame by then")


@dataclass(slots=True)
class FrameReception:
    """One frame of the MF downlink at one AUV, whether decoded or not."""

    broadcast: int = column("1", "row of broadcasts, from 0")
    auv: int = column("", "AUV at which it arrives")
    arrived_at_s: float | None = column(
        "s", "instant at which the frame's front is there; null if it was not by the end", None
    )
    outcome: str = column(
        "",
        "heard, out_of_range, blocked (land is between), lost (or its ASV failed), collided or "
        "in_flight",
        "in_flight",
    )
    why: str | None = column(
        "",
        "why it was not decoded: out_of_range, blocked, failed (its ASV, before), "
        "failed_meanwhile, chance, burst (lost with those before), doppler (the way changed too "
        "fast), frame or auv_frame (of an ASV or AUV, overlapped it), own_ping or own_frame "
        "(the AUV sent meanwhile)",
        None,
    )
    overlapped_by: int | None = column(
        "1",
        "row of broadcasts of the strongest frame that overlapped it, or number of the ping, or "
        "AUV's frame",
        None,
    )  # fmt: skip
    loss_probability: float | None = column(
        "1", "how likely it was lost, had nothing overlapped it; null on the disc", None
    )


@dataclass(slots=True)
class TrackPoint:
    """One vehicle at one instant: its true pose and, for an AUV, its estimate."""

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
    altitude_m: float | None = column(
        "m", "height of an AUV above the bottom (environment.bathymetry); null where unknown", None
    )
    swept_m2: float | None = column(
        "m2", "area of the survey that this AUV was the first to sweep until then", None
    )
