"""The timeline of one round: its slots, its frames, and what each of their parts is for."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..protocol.slots import slots_of

if TYPE_CHECKING:
    from .result import Result


@dataclass(frozen=True)
class Span:
    """A stretch of mission time (s)."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """Duration (s)."""
        return self.end - self.start


def uplink_slots(result: "Result", number: int) -> list[Span]:
    """Return the uplink slots of a round, one for each of its ping groups."""
    rounds = result.tables["rounds"]
    row: Any = rounds[rounds["round"] == number].iloc[0]
    slots, frames = slots_of(result.scenario), broadcasts_of(result, number)
    spans: list[Span] = []
    start = float(row.started_at_s)
    for slot in range(int(row.colours)):
        spans.append(Span(start, slots.clock.after(start, slots.uplink_slot)))
        waits = result.scenario.protocol.downlink == "pipelined_group" and slot < len(frames)
        # A group that waits for the frame before begins with the broadcast of its own fixes.
        start = float(frames.sent_at_s.iloc[slot]) if waits else spans[-1].end
    return spans


def downlink_slots(result: "Result", number: int) -> list[Span]:
    """Return the downlink slots of a round, one for each of its frames."""
    slots, frames = slots_of(result.scenario), broadcasts_of(result, number)
    return [
        Span(frame.sent_at_s, slots.clock.after(frame.sent_at_s, slots.downlink_slot(frame.fixes)))
        for frame in frames.itertuples()
        if frame.airtime_s > 0.0  # a direct reply takes no slot
    ]


def pings_sent(result: "Result") -> Any:
    """Return the pings that were sent: all, but for turns whose call got no answer (twtt)."""
    pings = result.tables["pings"]
    if "call" not in pings:  # of an older version
        return pings
    return pings[pings.call.isna() | (pings.call == "heard")]


def broadcasts_of(result: "Result", number: int) -> Any:
    """Return the frames of a round, in order."""
    frames = result.tables["broadcasts"]
    return frames[frames["round"] == number]
