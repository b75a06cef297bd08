"""Why an AUV pings when it does: its round, its slot, and the call that it answers."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..core.plugins import is_plugin
from ..core.wording import counted
from ..results.round_timeline import uplink_slots
from ..scenario.declared import schedule_of
from ..scenario.families import is_random
from ..scenario.telling import tells_slots
from .at_random import sending_at_random
from .chain import Step
from .failing import failed, failed_while
from .knowing import by_reckoning, is_reckoned, slot_told
from .lasting import lasting
from .numbers import apart, out_of_range, place, row_of, rows_where
from .ordering import why_now

if TYPE_CHECKING:
    from ..results.result import Result


def sending(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the round, the call where there is one, and the ping."""
    if is_random(result.scenario):
        yield from sending_at_random(result, ping)
        return
    protocol = result.scenario.protocol
    row = row_of(result, "rounds", "round", ping["round"])
    yield Step(
        row.started_at_s,
        f"Round {ping['round']}",
        f"begins: {counted(row.colours, 'ping group')}, {counted(row.conflicts, 'conflict')} "
        f"({protocol.schedule.told})",
        facts={"round": ping["round"], "colours": row.colours, "conflicts": row.conflicts},
    )
    yield from _call(result, ping)
    if not is_sent(ping):
        return
    told, facts = why_now(result, ping)
    facts |= {"slot": ping.slot, "x_m": ping.x_m, "y_m": ping.y_m, "z_m": ping.z_m}
    if tells_slots(result.scenario):
        yield from slot_told(result, ping)
    if is_reckoned(result, ping):
        why = by_reckoning(result, ping)
    else:
        slot = uplink_slots(result, ping["round"])[ping.slot]
        lasts = f"slot {ping.slot} lasts from {slot.start:.4f} to {slot.end:.4f} s"
        why = "; ".join([lasts, *told, _companions(result, ping)])
        facts |= {"slot_started_at_s": slot.start, "slot_ended_at_s": slot.end}
    yield Step(
        ping.sent_at_s,
        ping.auv,
        f"pings at x {ping.x_m:.1f}, y {ping.y_m:.1f}, depth {ping.z_m:.1f} m",
        why,
        facts,
    )


def is_sent(ping: Any) -> bool:
    """Tell whether an AUV pinged in its turn: always, but where no call reached it (twtt)."""
    return ping.get("call") in (None, "heard")


def _call(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the call that the ping answers, or should have (ranging twtt)."""
    if ping.get("call") is None:
        return
    protocol, outcome = result.scenario.protocol, ping.call
    delay = result.scenario.acoustics.hf.ping_s + protocol.turnaround_s
    facts = {"outcome": outcome, "reply_delay_s": delay}
    if outcome == "heard":
        facts["call_travel_time_s"] = ping.sent_at_s - ping.called_at_s - delay
        told = (
            f"the call is under way for {1e3 * facts['call_travel_time_s']:.1f} ms; "
            f"the answer follows {1e3 * delay:.1f} ms later, a ping and the turnaround"
        )
    else:
        told = why_unanswered(result, ping)
    yield Step(
        ping.called_at_s,
        ping.called_by,
        f"calls {ping.auv}",
        f"{_caller(result, ping)}; {told}",
        facts,
    )


def _caller(result: "Result", ping: Any) -> str:
    """Tell why it is this ASV that calls."""
    protocol = result.scenario.protocol
    ranging = str(protocol.ranging)
    if is_plugin(ranging):
        return f"{ranging}: the plug-in chose it"
    others = "no other ASV that works" if failed(result, ping.called_at_s) else "no other ASV"
    rule = protocol.schedule if schedule_of(result.scenario).turn_by == "calls" else ranging
    return f"{rule}: {others} is nearer, as far as the fleet knows"


def why_unanswered(result: "Result", ping: Any) -> str:
    """Tell why an AUV has not answered a call."""
    vessel, hf = place(result, ping.called_by, ping.called_at_s), result.scenario.acoustics.hf
    away = apart(hf, vessel, (ping.x_m, ping.y_m, ping.z_m))
    ends = ping.called_at_s + hf.ping_s
    cut = failed_while(result, ping.called_by, ping.called_at_s, ends, "called")
    if ping.call == "lost" and cut:
        return cut
    lasts = lasting(hf.channel)
    return {
        "out_of_range": f"{ping.auv} is {away:.1f} m away, {out_of_range(hf)}",
        "lost": f"{ping.auv}, {away:.1f} m away, loses the call by chance"
        + (f"; {lasts}" if lasts else ""),
        "collided": f"another ASV's call overlaps it at {ping.auv}",
        "in_flight": f"the mission ends before {ping.auv} answers",
    }[ping.call]


def _companions(result: "Result", ping: Any) -> str:
    """Tell who pings in the same slot, and with whom an ASV would have mixed it up."""
    pings = result.tables["pings"]
    own = rows_where(pings, round=ping["round"])
    beside = own[(own.slot == ping.slot) & (own.auv != ping.auv)]
    told = f"together with {', '.join(beside.auv)}" if len(beside) else "alone"
    hearers = _in_range(result, ping.ping)
    later = own[own.slot != ping.slot]
    mixed = {auv: hearers & _in_range(result, number)
             for auv, number in zip(later.auv, later.ping, strict=True)}  # fmt: skip
    shared = [f"{auv} ({', '.join(sorted(asvs))})" for auv, asvs in mixed.items() if asvs]
    return told + (f", apart from {', '.join(shared)}: heard by the same ASV" if shared else "")


def _in_range(result: "Result", ping: int) -> set[str]:
    met = rows_where(result.tables["receptions"], ping=ping)
    return set(met.asv[met.outcome != "out_of_range"])
