"""What frames of the downlink came to at AUVs, and which slots they have told them.

Rows of tables, as those of :mod:`.events`.
"""

from dataclasses import dataclass

from .columns import column


@dataclass(slots=True)
class Assignment:
    """One slot of one AUV, of which a frame was to tell it; recorded as the slot begins.

    None where all know the schedule at once (protocol.knowledge shared).
    """

    round: int = column("1", "round of the slot")
    slot: int = column("1", "uplink slot (ping group) within the round")
    auv: int = column("", "AUV whose slot it is")
    starts_at_s: float = column("s", "start of the slot")
    told_at_s: float | None = column(
        "s", "start of the frame that names it; null where it was agreed at launch, or not told"
    )
    told_by: int | None = column("", "ASV that broadcast that frame")
    outcome: str = column("", "known, or missed: the AUV had not decoded that frame by then")


@dataclass(slots=True)
class FrameReception:
    """One frame of the MF downlink at one AUV, whether that decoded it or not."""

    broadcast: int = column("1", "row of broadcasts, from 0")
    auv: int = column("", "AUV at which it arrives")
    arrived_at_s: float | None = column(
        "s", "instant at which the frame's front is there; null if it was not by the end", None
    )
    outcome: str = column(
        "", "heard, out_of_range, lost (or its ASV failed), collided or in_flight", "in_flight"
    )
