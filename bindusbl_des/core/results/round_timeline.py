"""The timeline of one round: its uplink and downlink slots."""

from dataclasses import dataclass
from math import isnan
from typing import TYPE_CHECKING, Any

from ..setup import Setup

if TYPE_CHECKING:
    from .result import Result


@dataclass(frozen=True)
class Span:
    """An interval of mission time (s)."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """Duration (s)."""
        return self.end - self.start


def uplink_slots(result: "Result", number: int) -> list[Span]:
    """Return the uplink slots of a round, one for each of its ping groups.

    A slot begins with its first ping, or call (twtt, polling); a slot without pings begins as the
    one before it ends.  With random access AUVs ping at any time, so there is one slot: the whole
    cycle.
    """
    rounds = result.tables["rounds"]
    row: Any = rounds[rounds["round"] == number].iloc[0]
    if result.scenario.protocol.random_access:
        return [_cycle(result, row)]
    slots, starts = result.setup.slots, _first_pings(result, number)
    length = slots.uplink_slot
    if result.scenario.protocol.pings_by_steps:  # only it knew, and it is not asked here
        starts, length = {}, (row.uplink_s or 0.0) / max(row.colours, 1)
    spans: list[Span] = []
    ends = float(row.started_at_s)
    last = ends + (row.uplink_s or 0.0)
    unequal = _are_unequal(result.setup)
    for slot in range(int(row.colours)):
        start = starts.get(slot, ends)
        ends = slots.clock.after(start, length)
        if unequal and starts.get(slot + 1, last) > start:  # else the mission has ended in it
            ends = starts.get(slot + 1, last)
        spans.append(Span(start, ends))
    return spans


def _cycle(result: "Result", row: Any) -> Span:
    """Return the cycle of a round with random access; the last cycle ends with the mission."""
    begins, ends = float(row.started_at_s), float(result.scenario.duration_s)
    if isnan(row.uplink_s) or isnan(row.downlink_s):
        return Span(begins, ends)
    return Span(begins, min(begins + float(row.uplink_s + row.downlink_s), ends))


def _are_unequal(setup: Setup) -> bool:
    """Return whether slots may differ in length from T_UL, and follow each other without pause."""
    protocol = setup.scenario.protocol
    follow = not (protocol.downlink.is_own or setup.downlink.by_group)
    return setup.schedule.pace != "" or (protocol.schedule.is_own and follow)


def _first_pings(result: "Result", number: int) -> dict[int, float]:
    """Return the instant (s) of the first ping, or call, of each slot of a round, by slot.

    Where AUVs received their slots, these are the assigned starts: an AUV without a slot may ping
    at any instant.
    """
    assigned = result.tables.get("assignments")
    if assigned is not None and len(assigned):
        starts: Any = assigned[assigned["round"] == number].groupby("slot").starts_at_s.min()
        return dict(zip(starts.index, starts, strict=True))
    pings = result.tables["pings"]
    sent = "called_at_s" if result.scenario.protocol.calls else "sent_at_s"
    if sent not in pings:  # of an older version
        return {}
    first: Any = pings[pings["round"] == number].groupby("slot")[sent].min()
    return dict(zip(first.index, first, strict=True))


def downlink_slots(result: "Result", number: int) -> list[Span]:
    """Return the downlink slots of a round, one for each broadcast; with `parallel` broadcasts, one
    for each part of a broadcast at which other ASVs send, too.
    """
    slots, frames = result.setup.slots, broadcasts_of(result, number)
    frames = frames[frames.airtime_s > 0.0]  # an instant reply takes no slot
    broadcast = frames.index
    if "part" in frames:  # no older version
        broadcast = (frames.part == 0).groupby(frames.asv).cumsum()
    sent = frames.groupby(["asv", broadcast]).agg(
        begins=("sent_at_s", "min"), fixes=("fixes", "sum"), named=("named", "sum")
    )
    protocol = result.scenario.protocol
    shares = result.setup.broadcaster.at_once or protocol.replies
    lasts = slots.frame_slot if shares else slots.downlink_slot
    longest: dict[float, float] = {}
    for slot in sent.sort_values("begins").itertuples():
        longest[slot.begins] = max(longest.get(slot.begins, 0.0), lasts(slot.fixes, slot.named))
    return [Span(begins, slots.clock.after(begins, length)) for begins, length in longest.items()]


def pings_sent(result: "Result") -> Any:
    """Return the pings that were sent: all rows, but for slots whose call got no answer (twtt)."""
    pings = result.tables["pings"]
    if "call" not in pings:  # of an older version
        return pings
    return pings[pings.call.isna() | (pings.call == "heard")]


def broadcasts_of(result: "Result", number: int) -> Any:
    """Return the frames of a round, in order."""
    frames = result.tables["broadcasts"]
    return frames[frames["round"] == number]
