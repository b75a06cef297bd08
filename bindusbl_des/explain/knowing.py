"""How an AUV knows its slot (protocol.knowledge broadcast), and why it was silent before."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..core.wording import counted
from ..scenario.declared import channel_named
from .chain import Step, place, rows_where

if TYPE_CHECKING:
    from ..results.result import Result


def slot_told(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the slots that the AUV has missed since its last ping, and the frame that named it."""
    assigned = rows_where(result.tables["assignments"], auv=ping.auv)
    pings = rows_where(result.tables["pings"], auv=ping.auv)
    before = pings[pings.sent_at_s < ping.sent_at_s].sent_at_s.max()
    since = assigned[(assigned.starts_at_s < ping.sent_at_s) & ~(assigned.starts_at_s <= before)]
    missed = since[since.outcome == "missed"]
    if len(missed):
        last: Any = missed.iloc[-1]
        yield Step(
            last.starts_at_s,
            ping.auv,
            f"has missed {counted(len(missed), 'slot')} since its last ping, in round "
            f"{last['round']} the last",
            _why_missed(result, last),
            {"missed": len(missed), "round": int(last["round"])},
        )
    told = _assigned(result, ping)
    if len(told) and told.told_at_s.notna().all():
        frame: Any = told.iloc[0]
        yield Step(
            frame.told_at_s,
            frame.told_by,
            f"tells {ping.auv} that slot {frame.slot} of round {frame['round']} is its own",
            f"in a frame that {ping.auv} has decoded before it begins",
            {"round": int(frame["round"]), "slot": int(frame.slot)},
        )


def is_reckoned(result: "Result", ping: Any) -> bool:
    """Tell whether an AUV pinged without having been told of that slot."""
    protocol = result.scenario.protocol
    if not len(result.tables["assignments"]) or len(_assigned(result, ping)):
        return False
    return protocol.dissemination.missed in ("last_slot", "contention")


def by_reckoning(result: "Result", ping: Any) -> str:
    """Tell why an AUV pings that was not told to."""
    if result.scenario.protocol.dissemination.missed == "contention":
        return "it knows of no slot of its own, and tries its luck where it takes contention to be"
    return (
        f"it has heard of no slot since, and pings in the last it was told, {ping.slot}, when that "
        f"is by its reckoning{_turn_of_others(result, ping)}"
    )


def _turn_of_others(result: "Result", ping: Any) -> str:
    """Name the AUVs whose slot it is by now in which an AUV pings by reckoning; "" for none."""
    told = rows_where(result.tables["assignments"], outcome="known")
    begun = told[told.starts_at_s <= ping.sent_at_s]
    now = begun[(begun.starts_at_s == begun.starts_at_s.max()) & (begun.auv != ping.auv)]
    if not len(now):
        return ""
    slot: Any = now.iloc[0]
    return f"; that is slot {slot.slot} of round {slot['round']} by now, of {', '.join(now.auv)}"


def _assigned(result: "Result", ping: Any) -> Any:
    """Return the assignment (at most one row) by which an AUV pings."""
    return rows_where(
        result.tables["assignments"], round=ping["round"], slot=ping.slot, auv=ping.auv,
        starts_at_s=ping.sent_at_s, outcome="known",
    )  # fmt: skip


def _why_missed(result: "Result", slot: Any) -> str:
    """Tell why an AUV did not know a slot."""
    if slot.told_by is None or slot.told_at_s != slot.told_at_s:
        return "no frame had told of that round"
    auv, asv = (place(result, name, slot.told_at_s) for name in (slot.auv, slot.told_by))
    away, mf = math.hypot(*(auv - asv)[:2]), result.scenario.acoustics.mf
    frame = f"the frame of {slot.told_by} that began at {slot.told_at_s:.4f} s"
    if channel_named(mf.channel).ends_at_range and away > mf.range_m:
        return f"it was out of MF range of {frame}: {away:.1f} m > {mf.range_m:g} m"
    return f"it had not decoded {frame}, from {away:.1f} m away"
