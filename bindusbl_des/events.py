"""What can happen in a mission, in the words of its result tables.

Each class is one kind of row: its fields are the columns of the table of the same name, with unit
and meaning.  An instant is in seconds of mission time, a position in the survey frame: x along the
lanes, y across them, z down from the surface (metres).  What has not happened is ``None``.
"""

from dataclasses import MISSING, dataclass, field
from typing import Any


def column(unit: str, meaning: str, default: Any = MISSING) -> Any:
    """Describe one column: its unit ("" for names and labels) and its meaning."""
    return field(default=default, metadata={"unit": unit, "meaning": meaning})


@dataclass(slots=True)
class Round:
    """One round: every AUV has had its turn to ping, and the fixes have been broadcast."""

    round: int = column("1", "number of the round")
    started_at_s: float = column("s", "start of the first uplink slot")
    colours: int = column("1", "ping groups of the round")
    conflicts: int = column("1", "pairs of AUVs that some ASV hears both of")
    uplink_s: float | None = column("s", "duration of all uplink slots", None)
    downlink_s: float | None = column("s", "duration of the downlink slots", None)
    fixes: int = column("1", "fixes broadcast", 0)


@dataclass(slots=True)
class Ping:
    """One ping of one AUV on the HF uplink."""

    ping: int = column("1", "number of the ping")
    round: int = column("1", "round in which it was sent")
    slot: int = column("1", "uplink slot (ping group) within the round")
    auv: int = column("", "AUV that pinged")
    sent_at_s: float = column("s", "instant at which the ping began")
    x_m: float = column("m", "true position of the AUV at that instant, along the lanes")
    y_m: float = column("m", "true position of the AUV at that instant, across the lanes")
    z_m: float = column("m", "true depth of the AUV at that instant")
    in_range_of: int = column("1", "ASVs within HF range at that instant", 0)
    heard_by: int = column("1", "ASVs that decoded the ping", 0)


@dataclass(slots=True)
class Reception:
    """One ping at one ASV, whether it was decoded or not."""

    ping: int = column("1", "number of the ping")
    auv: int = column("", "AUV that pinged")
    asv: int = column("", "ASV at which it arrives")
    arrived_at_s: float = column("s", "instant at which the ping's front reaches the ASV")
    slant_range_m: float = column("m", "distance that the sound has travelled")
    travel_time_s: float = column("s", "one-way travel time")
    outcome: str = column("", "heard, out_of_range, lost, collided or in_flight", "in_flight")


@dataclass(slots=True)
class Broadcast:
    """One frame of fixes on the MF downlink."""

    round: int = column("1", "round whose fixes it carries")
    asv: int = column("", "ASV that broadcast")
    sent_at_s: float = column("s", "start of the frame")
    airtime_s: float = column("s", "duration of the frame")
    payload_bytes: int = column("B", "header and fix records")
    fixes: int = column("1", "fix records in the frame")


@dataclass(slots=True)
class Fix:
    """One position fix of one AUV, fused over the ASVs that heard the same ping."""

    fix: int = column("1", "number of the fix")
    ping: int = column("1", "ping that it locates")
    round: int = column("1", "round of that ping")
    auv: int = column("", "AUV that it locates")
    asvs: str = column("", "ASVs whose measurements were fused")
    pinged_at_s: float = column("s", "instant to which the fix belongs")
    x_m: float = column("m", "position along the lanes")
    y_m: float = column("m", "position across the lanes")
    z_m: float = column("m", "depth")
    sd_x_m: float = column("m", "standard deviation of x_m")
    sd_y_m: float = column("m", "standard deviation of y_m")
    sd_z_m: float = column("m", "standard deviation of z_m")
    cov_xy_m2: float = column("m2", "covariance of x_m and y_m")
    cov_xz_m2: float = column("m2", "covariance of x_m and z_m")
    cov_yz_m2: float = column("m2", "covariance of y_m and z_m")
    error_m: float = column("m", "horizontal distance to the AUV's true position at the ping")
    broadcast_at_s: float | None = column("s", "start of the frame that carries it", None)
    broadcast_by: int | None = column("", "ASV that broadcast it", None)
    delivered_at_s: float | None = column("s", "instant at which the AUV has it", None)
    latency_s: float | None = column("s", "from ping to delivery", None)
    innovation_m: float | None = column("m", "horizontal length of the innovation", None)
    outcome: str = column("", "delivered, out_of_range or in_flight", "in_flight")
