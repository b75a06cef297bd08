"""The way up with random access: why an AUV pings when it does, and who else is on the air."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..core.wording import counted
from ..protocol.slots import slots_of
from ..scenario.declared import schedule_of
from .chain import Step
from .numbers import row_of

if TYPE_CHECKING:
    from ..results.result import Result

# Instants (s) that differ by less are one.
SAME = 1e-9


def sending_at_random(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the cycle of the downlink that a ping falls into, and the ping."""
    protocol = result.scenario.protocol
    row = row_of(result, "rounds", "round", ping["round"])
    yield Step(
        row.started_at_s,
        f"Round {ping['round']}",
        f"begins: {_why_round(protocol.replies)} ({protocol.schedule.told})",
        f"AUVs ping as they like; {counted(row.conflicts, 'pair')} of them could collide at an ASV",
        {"round": ping["round"], "conflicts": row.conflicts},
    )
    waited = ping.get("waited_s")
    yield Step(
        ping.sent_at_s,
        ping.auv,
        f"pings at x {ping.x_m:.1f}, y {ping.y_m:.1f}, depth {ping.z_m:.1f} m",
        f"{_why_now(result, ping)}; {_others_on_air(result, ping)}",
        {
            "x_m": ping.x_m, "y_m": ping.y_m, "z_m": ping.z_m,
            **({} if waited is None else {"held_back_s": waited}),
        },
    )  # fmt: skip


def _why_round(replies: bool) -> str:
    if replies:
        return "it lasts as long as the mission, since each ping is answered by itself"
    return "MF is free"


def why_broadcast(result: "Result", fix: Any, frame: Any, known_at_s: float) -> str:
    """Tell what a fix has waited for, which the fleet has known since an instant (s)."""
    policy, slots = result.scenario.protocol.downlink, slots_of(result.scenario)
    waited, begun = fix.broadcast_at_s - known_at_s, frame.sent_at_s
    started = row_of(result, "rounds", "round", int(frame["round"])).started_at_s
    if begun <= slots.clock.after(known_at_s, 0.0) + SAME:
        return f"{policy}: MF was free, so that it is broadcast at once"
    if frame.get("part"):
        return f"{policy}: it is in message {frame.part + 1} of its broadcast"
    if started < known_at_s:
        return f"{policy}: no ASV worked for {waited:.4f} s"
    return f"{policy}: frames before it held the band until now, for {waited:.4f} s"


def _why_now(result: "Result", ping: Any) -> str:
    """Tell by which rule an AUV pings at this instant."""
    protocol = result.scenario.protocol
    access = schedule_of(result.scenario).access
    if access == "poisson":
        return (
            f"{protocol.schedule}: an instant of its own Poisson process, on average every "
            f"{protocol.frame_s:g} s; it asks nobody"
        )
    if access == "slotted":
        slots = slots_of(result.scenario)
        length = slots.clock.after(0.0, slots.uplink_slot)
        return (
            f"{protocol.schedule}: slot {round(ping.sent_at_s / length)} of {length:.4f} s begins, "
            "and in the one before it has had something to send"
        )
    waited = float(ping.waited_s)
    if waited <= 0.0:
        return (
            f"{protocol.schedule}: it hears no other AUV, so that it pings as soon as it has "
            "something to send"
        )
    return (
        f"{protocol.schedule}: it has had something to send since {ping.sent_at_s - waited:.4f} s, "
        f"but heard a ping then, or sent one; it held back for {waited:.4f} s, until its backoff "
        "was counted down in quiet"
    )


def _others_on_air(result: "Result", ping: Any) -> str:
    """Tell which AUVs ping while this one does."""
    lasts, pings = result.scenario.acoustics.hf.ping_s, result.tables["pings"]
    beside = pings[(pings.sent_at_s - ping.sent_at_s).abs() < lasts]
    others = beside[beside.ping != ping.ping]
    if not len(others):
        return "nobody else pings meanwhile"
    told = [f"{it.auv} since {it.sent_at_s:.4f} s (ping {it.ping})" for it in others.itertuples()]
    return f"others ping meanwhile: {', '.join(told)}"
