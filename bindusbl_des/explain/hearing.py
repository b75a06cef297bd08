"""Why an AUV pings when it does, and what each ASV makes of that ping: who hears it, who does not,
and by which rule.

With passive ranging an ASV pings, and AUVs make something of it (:mod:`.ping_and_fix`).
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..acoustics.loss import COMBINERS, FITTED_RANGE, loss_law, range_loss
from ..core.plugins import is_plugin
from ..core.wording import counted
from ..results.round_timeline import uplink_slots
from ..scenario.declared import channel_named
from .chain import Step, apart, compared, out_of_range, place, row_of, rows_where
from .losing import (
    burst_words,
    decided_by_channel,
    levels,
    loss_by_channel,
    ping_burst_words,
    sending_at_random,
)
from .ordering import by_reckoning, is_reckoned, slot_steps, why_now
from .overlapping import deafened, failed, failed_while, had_failed, on_its_way, sounds_beside

if TYPE_CHECKING:
    from ..results.result import Result


def sending(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the round, the call where there is one, and the ping."""
    if result.scenario.protocol.random_access:
        yield from sending_at_random(result, ping)
        return
    protocol = result.scenario.protocol
    row = row_of(result, "rounds", "round", ping["round"])
    yield Step(
        row.started_at_s,
        f"Round {ping['round']}",
        f"begins: {counted(row.colours, 'ping group')}, {counted(row.conflicts, 'conflict')} "
        f"({protocol.schedule.words})",
        facts={"round": ping["round"], "colours": row.colours, "conflicts": row.conflicts},
    )
    yield from _call(result, ping)
    if not is_sent(ping):
        return
    words, facts = why_now(result, ping)
    facts |= {"slot": ping.slot, "x_m": ping.x_m, "y_m": ping.y_m, "z_m": ping.z_m}
    if result.setup.tells_slots:
        yield from slot_steps(result, ping)
    if is_reckoned(result, ping):
        why = by_reckoning(result, ping)
    else:
        slot = uplink_slots(result, ping["round"])[ping.slot]
        lasts = f"slot {ping.slot} lasts from {slot.start:.4f} to {slot.end:.4f} s"
        why = "; ".join([lasts, *words, _companions(result, ping)])
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
        words = (
            f"the call is under way for {1e3 * facts['call_travel_time_s']:.1f} ms; "
            f"the answer follows {1e3 * delay:.1f} ms later, a ping and the turnaround"
        )
    else:
        words = why_unanswered(result, ping)
    yield Step(
        ping.called_at_s,
        ping.called_by,
        f"calls {ping.auv}",
        f"{_caller(result, ping)}; {words}",
        facts,
    )


def _caller(result: "Result", ping: Any) -> str:
    """Tell why it is this ASV that calls."""
    protocol = result.scenario.protocol
    ranging = str(protocol.ranging)
    if is_plugin(ranging):
        return f"{ranging}: the plug-in chose it"
    others = "no other ASV that works" if failed(result, ping.called_at_s) else "no other ASV"
    rule = protocol.schedule if result.setup.schedule.turn_by == "calls" else ranging
    return f"{rule}: {others} is nearer, as far as the fleet knows"


def why_unanswered(result: "Result", ping: Any) -> str:
    """Tell why an AUV has not answered a call."""
    vessel, hf = place(result, ping.called_by, ping.called_at_s), result.scenario.acoustics.hf
    away = apart(hf, vessel, (ping.x_m, ping.y_m, ping.z_m))
    ends = ping.called_at_s + hf.ping_s
    cut = failed_while(result, ping.called_by, ping.called_at_s, ends, "called")
    if ping.call == "lost" and cut:
        return cut
    lasts = burst_words(hf.channel)
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
    words = f"together with {', '.join(beside.auv)}" if len(beside) else "alone"
    hearers = _in_range(result, ping.ping)
    later = own[own.slot != ping.slot]
    mixed = {auv: hearers & _in_range(result, number)
             for auv, number in zip(later.auv, later.ping, strict=True)}  # fmt: skip
    shared = [f"{auv} ({', '.join(sorted(asvs))})" for auv, asvs in mixed.items() if asvs]
    return words + (f", apart from {', '.join(shared)}: heard by the same ASV" if shared else "")


def _in_range(result: "Result", ping: int) -> set[str]:
    met = rows_where(result.tables["receptions"], ping=ping)
    return set(met.asv[met.outcome != "out_of_range"])


def receptions(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield what each ASV makes of a ping, and by which rule; nothing of one that was not sent.

    With passive ranging it is each AUV that hears the ping of an ASV.
    """
    if not is_sent(ping):
        return
    hf = result.scenario.acoustics.hf
    met = rows_where(result.tables["receptions"], ping=ping.ping).sort_values("arrived_at_s")
    for reception in met.itertuples():
        depth = ping.z_m
        if result.scenario.protocol.asvs_ping:
            depth = place(result, str(reception.auv), float(reception.arrived_at_s))[2]
        what, why = _decided(result, reception, depth)
        if reception.outcome == "out_of_range":
            why += on_its_way(result, str(reception.asv), float(reception.arrived_at_s))
        way = f"{reception.slant_range_m:.1f} m, {1e3 * reception.travel_time_s:.1f} ms"
        probability = _loss(result, reception, depth)[0]
        facts = {
            "outcome": reception.outcome,
            "slant_range_m": reception.slant_range_m,
            "travel_time_s": reception.travel_time_s,
            "range_m": _counted_range(result, reception, depth),
            "limit_m": hf.range_m if channel_named(hf.channel).ends_at_range else None,
            "loss_probability": None if reception.outcome == "out_of_range" else probability,
            **levels(reception),
        }
        who = getattr(reception, result.scenario.protocol.listening)
        yield Step(reception.arrived_at_s, who, f"{what} ({way})", why, facts)


def _decided(result: "Result", reception: Any, depth: float) -> tuple[str, str]:
    hf, outcome = result.scenario.acoustics.hf, reception.outcome
    if words := _failed(result, reception):
        return "loses it" if outcome == "lost" else "hears nothing", words
    if words := deafened(result, reception):
        return "hears nothing", words
    others = sounds_beside(result, reception)
    if not channel_named(hf.channel).ends_at_range and not is_plugin(hf.channel):
        return decided_by_channel(result, reception, others, depth)
    away = _counted_range(result, reception, depth)
    # A vessel that moves may cross the limit while the ping is under way.
    is_beyond = outcome == "out_of_range"
    words = compared(away, hf.range_m) if (away > hf.range_m) == is_beyond else "at the edge of the"
    within = f"{hf.range_metric} range {words} HF range"
    if is_plugin(hf.channel):
        if is_beyond:
            return "hears nothing", f"it is {out_of_range(hf)}"
        within = f"{hf.channel.words}: the plug-in let some sound through"
    if is_beyond:
        return "is too far away", within
    if outcome == "in_flight":
        ends = reception.arrived_at_s + hf.ping_s
        return "would hear it, but the mission ends", (
            f"{within}; the ping ends at {ends:.4f} s, the mission at "
            f"{result.scenario.duration_s:g} s"
        )
    if outcome == "collided":
        return "hears pings mixed", f"{within}; overlaps {', '.join(others)}"
    probability, words = _loss(result, reception, depth)
    if outcome == "lost":
        return (
            "loses it",
            "; ".join(filter(None, [
                within, "no other ping overlaps",
                f"{words}, and the draw (not recorded) was below",
                ping_burst_words(result, reception, probability),
            ])),
        )  # fmt: skip
    return "decodes it", f"{within}; no other ping overlaps; {words}"


def _failed(result: "Result", reception: Any) -> str:
    """Tell that the ASV of a reception had failed, or failed meanwhile; "" if it worked."""
    arrives, lasts = float(reception.arrived_at_s), result.scenario.acoustics.hf.ping_s
    if result.scenario.protocol.asvs_ping:
        sent = arrives - float(reception.travel_time_s)
        return _meanwhile(result, reception, (sent, sent + lasts), "pinged")
    if reception.outcome == "out_of_range":
        return had_failed(result, reception.asv, arrives)
    return _meanwhile(result, reception, (arrives, arrives + lasts), "was hearing it")


def _meanwhile(result: "Result", reception: Any, span: tuple[float, float], doing: str) -> str:
    lost = reception.outcome == "lost"
    return failed_while(result, reception.asv, *span, doing) if lost else ""


def _counted_range(result: "Result", reception: Any, depth: float) -> float:
    """Return the range (m) that the rule compares; ASVs float at the surface."""
    slant = float(reception.slant_range_m)
    if result.scenario.acoustics.hf.range_metric == "slant":
        return slant
    return math.sqrt(max(slant**2 - depth**2, 0.0))


def _loss(result: "Result", reception: Any, depth: float) -> tuple[float | None, str]:
    """Return the probability of losing a ping, and how it comes about, of so deep an AUV (m)."""
    channel, slant_range = result.scenario.acoustics.hf.channel, float(reception.slant_range_m)
    if is_plugin(channel):
        return None, "the chance is the plug-in's (not recorded)"
    if not channel_named(channel).ends_at_range:
        return loss_by_channel(result.setup, slant_range, depth), ""
    loss, contention = result.scenario.acoustics.loss, result.setup.ping_loss.contention
    hf_range = result.scenario.acoustics.hf.range_m
    raw = range_loss(slant_range, loss_law(loss.law, hf_range))
    law = f"range law '{loss.law}'"
    if loss.law == "scaled" and hf_range > FITTED_RANGE:
        law += f" (the paper's at {slant_range * FITTED_RANGE / hf_range:.1f} m)"
    probability = COMBINERS[loss.combine](raw, contention, loss.cap)
    if loss.combine == "off":
        return probability, f"loss probability {probability:.3f} by {law}"
    return probability, (
        f"loss probability {probability:.3f} ({loss.combine} of {law} {raw:.3f} "
        f"and contention {contention:.3f})"
    )
