"""Why an AUV pings at an instant: its round, a call that it answers, its slot, or random access."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ...core.results.round_timeline import uplink_slots
from ...support.wording import counted
from .chain import (
    UNREACHED,
    Step,
    Why,
    apart,
    failed_asvs,
    known,
    lines,
    position_at,
    row_of,
    rows_where,
)
from .hearing import is_sent, why_unanswered

if TYPE_CHECKING:
    from ...core.results.result import Result


# The kind of signal that acknowledges a ping, in programs with `acknowledgement_bytes`.
ACKNOWLEDGEMENT = "acknowledgement"


def sending(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the steps of the round, of the call if there is one, and of the ping."""
    protocol, row = result.scenario.protocol, row_of(result, "rounds", "round", ping["round"])
    facts = {"round": ping["round"], "conflicts": row.conflicts}
    begins, why = f"begins: {_round(result, row)} ({protocol.rule.words})", ""
    if protocol.random_access:
        pairs = counted(row.conflicts, "pair")
        why = f"AUVs ping as they like; {pairs} of them could collide at an ASV"
    else:
        facts = {"round": ping["round"], "colours": row.colours, "conflicts": row.conflicts}
    yield Step(row.started_at_s, f"Round {ping['round']}", begins, why, facts)
    yield from _call(result, ping)
    if not is_sent(ping):
        return
    if result.setup.tells_slots:
        yield from _told_slots(result, ping)
    words, facts = _why_now(result, ping)
    facts |= {"x_m": ping.x_m, "y_m": ping.y_m, "z_m": ping.z_m}
    what = f"pings at x {ping.x_m:.1f}, y {ping.y_m:.1f}, depth {ping.z_m:.1f} m"
    if result.setup.bottom.is_known:
        above, more = _above(result, ping)
        what, facts = what + above, facts | more
    yield Step(ping.sent_at_s, ping.auv, what, lines(*words), facts)


def _above(result: "Result", ping: Any) -> tuple[str, dict[str, Any]]:
    """Tell how far above the bottom an AUV pings, and whether its log sees that; with facts."""
    import numpy as np

    setup, place = result.setup, np.array([[ping.x_m, ping.y_m, ping.z_m]])
    bottom = float(setup.bottom.below(place)[0])
    if math.isnan(bottom):
        return ", where the depth of the bottom is not known", {}
    altitude = bottom - ping.z_m
    words = f", {altitude:.1f} m above the bottom"
    facts = {"bottom_m": bottom, "altitude_m": altitude}
    if not math.isinf(setup.log_sees_m):
        facts["bottom_lock"] = not setup.blind(place)[0]
        words += ", which its log sees" if facts["bottom_lock"] else ", too far for its log to see"
    return words, facts


def beaconing(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the steps of the round and of an ASV's ping (passive ranging)."""
    row = row_of(result, "rounds", "round", ping["round"])
    begins = f"begins: {counted(row.colours, 'ASV')} in turn (passive)"
    facts = {"round": ping["round"], "colours": row.colours}
    yield Step(row.started_at_s, f"Round {ping['round']}", begins, facts=facts)
    slot = uplink_slots(result, ping["round"])[ping.slot]
    yield Step(
        ping.sent_at_s,
        ping.asv,
        f"pings at x {ping.x_m:.1f}, y {ping.y_m:.1f} m",
        f"slot {ping.slot} is its own, from {slot.start:.4f} to {slot.end:.4f} s, with room for "
        "the longest way to anybody in range",
        {
            "slot": ping.slot, "slot_started_at_s": slot.start, "slot_ended_at_s": slot.end,
            "x_m": ping.x_m, "y_m": ping.y_m, "z_m": ping.z_m,
        },
    )  # fmt: skip


def _round(result: "Result", row: Any) -> str:
    """Tell what a round consists of, or what begins it with random access."""
    protocol = result.scenario.protocol
    if not protocol.random_access:
        return f"{counted(row.colours, 'ping group')}, {counted(row.conflicts, 'conflict')}"
    if protocol.replies:
        return "it lasts as long as the mission, since each ping is answered by itself"
    return "MF is free"


def _call(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the step of the call that the AUV answered, or did not."""
    if ping.get("call") is None:
        return
    delay = result.scenario.acoustics.hf.ping_s + result.scenario.protocol.turnaround_s
    facts = {"outcome": ping.call, "reply_delay_s": delay}
    if ping.call == "heard":
        facts["call_travel_time_s"] = travel = ping.sent_at_s - ping.called_at_s - delay
        words = (
            f"the call is under way for {1e3 * travel:.1f} ms; "
            f"the answer follows {1e3 * delay:.1f} ms later, a ping and the turnaround"
        )
    else:
        words = why_unanswered(result, ping)
    caller = lines(_caller(result, ping), words)
    yield Step(ping.called_at_s, ping.called_by, f"calls {ping.auv}", caller, facts)


def _caller(result: "Result", ping: Any) -> str:
    """Tell why this ASV calls."""
    protocol = result.scenario.protocol
    if protocol.pings_by_steps:
        whose = "the plug-in" if protocol.ranging.is_own else "a rule of its own"
        return f"{protocol.ranging}: {whose} chose it"
    others = "no other ASV that works" if failed_asvs(result, ping.called_at_s) else "no other ASV"
    polled = result.setup.schedule.turn_by == "calls"
    rule = protocol.schedule if polled else protocol.ranging
    return f"{rule}: {others} is nearer, as far as the fleet knows"


def _why_now(result: "Result", ping: Any) -> Why:
    """Return why an AUV pings at this instant, in words and as facts."""
    protocol = result.scenario.protocol
    if protocol.random_access:
        waited = ping.get("waited_s")
        facts = {} if waited is None else {"held_back_s": waited}
        return [
            _at_random(result, ping),
            *_signals(result, ping),
            _others_on_air(result, ping),
        ], facts
    facts = {"slot": ping.slot}
    if _is_reckoned(result, ping):
        return [_by_reckoning(result, ping)], facts
    slot = uplink_slots(result, ping["round"])[ping.slot]
    facts |= {"slot_started_at_s": slot.start, "slot_ended_at_s": slot.end}
    words = [f"slot {ping.slot} lasts from {slot.start:.4f} to {slot.end:.4f} s"]
    if rule := RULES.get(result.setup.schedule.turn_by):
        because, numbers = rule(result, ping)
        words.append(f"{protocol.schedule}: {because}")
        facts |= numbers
    return [*words, _companions(result, ping)], facts


def _companions(result: "Result", ping: Any) -> str:
    """Tell which AUVs ping in the same slot, and which in later ones because an ASV hears both."""
    own = rows_where(result.tables["pings"], round=ping["round"])
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
    return set(met.asv[~met.outcome.isin(UNREACHED)])


# Reasons of schedules that use more than the conflict graph


def _by_expected_error(result: "Result", ping: Any) -> tuple[str, dict[str, Any]]:
    """Tell the age of the AUV's last fix when the round began, and how many rounds it waited."""
    begins = float(row_of(result, "rounds", "round", ping["round"]).started_at_s)
    fixes = rows_where(result.tables["fixes"], auv=ping.auv)
    last = fixes[fixes.broadcast_at_s <= begins].ping.max()
    before = rows_where(result.tables["pings"], auv=ping.auv)
    before = before[before["round"] < ping["round"]]
    pinged = before.sent_at_s[before.ping == last].max() if last == last else 0.0
    since, tried = begins - float(pinged), int((~(before.ping <= last)).sum())
    latest = before["round"].max() if len(before) else -1
    passed = int(ping["round"]) - 1 - int(latest)
    age = f"its last fix is {since:.1f} s old" if last == last else "it has had no fix yet"
    words = age + (f", {counted(tried, 'ping')} since then made none" if tried else "")
    words += f", passed over for {counted(passed, 'round')}" if passed else ""
    return words, {"since_s": since, "pings_since": tried, "rounds_passed_over": passed}


def _by_calls(result: "Result", ping: Any) -> tuple[str, dict[str, Any]]:
    """Tell for which answer the call waited."""
    pings = rows_where(result.tables["pings"], round=ping["round"])
    before = pings[pings.slot == ping.slot - 1]
    if not len(before):
        return "it is the first to be called in this round", {}
    unheard = []
    for earlier in before.itertuples():
        met = rows_where(result.tables["receptions"], ping=earlier.ping, asv=earlier.called_by)
        if earlier.call != "heard" or "heard" not in set(met.outcome):
            unheard.append(earlier.auv)
    if unheard:
        return f"it was called when the wait for {', '.join(unheard)} was over, unanswered", {}
    return f"it was called when the answer of {', '.join(before.auv)} had been decoded", {}


def _by_arrivals(result: "Result", ping: Any) -> tuple[str, dict[str, Any]]:
    """Tell behind which other ping this one arrives most closely, and at which ASV."""
    lasts = result.scenario.acoustics.hf.ping_s
    pings, met = (
        rows_where(result.tables["pings"], round=ping["round"]),
        result.tables["receptions"],
    )
    met = met[met.ping.isin(pings.ping) & ~met.outcome.isin(UNREACHED)]
    gaps = []
    for own in met[met.ping == ping.ping].itertuples():
        others = met[(met.asv == own.asv) & (met.arrived_at_s < own.arrived_at_s)]
        if len(others):
            other = others.loc[others.arrived_at_s.idxmax()]
            gaps.append((own.arrived_at_s - other.arrived_at_s - lasts, own.asv, other.auv))
    begins = row_of(result, "rounds", "round", ping["round"]).started_at_s
    departs = f"it sets out {1e3 * (ping.sent_at_s - begins):.1f} ms after the round began"
    if not gaps:
        return f"{departs}, as the first to arrive wherever it is heard", {}
    gap, asv, other = min(gaps)
    side = "after" if gap >= 0.0 else "before"
    how = f"{1e3 * abs(gap):.1f} ms {side} that of {other} is over"
    return f"{departs}, so that its ping comes in at {asv} {how}", {"gap_s": float(gap)}


RULES = {"expected_error": _by_expected_error, "calls": _by_calls, "arrivals": _by_arrivals}


# Random access


def _at_random(result: "Result", ping: Any) -> str:
    """Tell by which rule an AUV pings at this instant with random access."""
    protocol, access = result.scenario.protocol, result.setup.schedule.access
    if access == "poisson":
        return (
            f"{protocol.program}: an instant of its own Poisson process, on average every "
            f"{protocol.frame_s:g} s; it asks nobody"
        )
    if access == "slotted":
        slots = result.setup.slots
        length = slots.clock.after(0.0, slots.uplink_slot)
        return (
            f"{protocol.program}: slot {round(ping.sent_at_s / length)} of {length:.4f} s begins, "
            "and in the one before it has had something to send"
        )
    waited = float(known(ping.waited_s) or 0.0)
    if access == "program":
        held = f", {waited:.4f} s after it had something to send" if waited > 0.0 else ""
        return f"{protocol.program}: its program lets it ping{held}"
    if waited <= 0.0:
        return (
            f"{protocol.program}: it hears no other AUV, so that it pings as soon as it has "
            "something to send"
        )
    return (
        f"{protocol.program}: it has had something to send since {ping.sent_at_s - waited:.4f} s, "
        f"but heard a ping then, or sent one; it held back for {waited:.4f} s, until its backoff "
        "was counted down in quiet"
    )


def _signals(result: "Result", ping: Any) -> Iterator[str]:
    """Yield the signals from and to an AUV while it waited to ping."""
    if "signals" not in result.tables:
        return
    signals, since = result.tables["signals"], ping.sent_at_s - float(known(ping.waited_s) or 0.0)
    meant = (signals.sender == ping.auv) | (signals.to == ping.auv)
    begun = (signals.sent_at_s >= since) & (signals.sent_at_s < ping.sent_at_s)
    for signal in signals[begun & meant].itertuples():
        to, lasts = f" to {signal.to}" if known(signal.to) else "", 1e3 * signal.lasts_s
        yield (
            f"{signal.sent_at_s:.4f} s: {signal.sender} sends {signal.kind!r}{to}, {lasts:.1f} ms"
        )


def acknowledged(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the acknowledgements of a ping, with their outcomes at its AUV."""
    if "signals" not in result.tables:
        return
    told = rows_where(result.tables["signals"], kind=ACKNOWLEDGEMENT, ping=ping.ping)
    for signal in told.itertuples():
        met = rows_where(
            result.tables["signal_receptions"], signal=signal.signal, listener=ping.auv
        )
        outcome = met.outcome.iloc[0] if len(met) else "out_of_range"
        became = f"{ping.auv} does not decode it: {outcome.replace('_', ' ')}"
        if outcome == "heard":
            ends = float(met.arrived_at_s.iloc[0]) + signal.lasts_s
            became = f"{ping.auv} decodes it by {ends:.4f} s"
        what = f"sends {ACKNOWLEDGEMENT!r} to {ping.auv}, {1e3 * signal.lasts_s:.1f} ms"
        yield Step(signal.sent_at_s, str(signal.sender), what, became, {"outcome": outcome})


def _others_on_air(result: "Result", ping: Any) -> str:
    """Tell which AUVs ping at the same time."""
    lasts, pings = result.scenario.acoustics.hf.ping_s, result.tables["pings"]
    beside = pings[(pings.sent_at_s - ping.sent_at_s).abs() < lasts]
    others = beside[beside.ping != ping.ping]
    if not len(others):
        return "nobody else pings meanwhile"
    text = [
        f"{row.auv} since {row.sent_at_s:.4f} s (ping {row.ping})" for row in others.itertuples()
    ]
    return f"others ping meanwhile: {', '.join(text)}"


# Slots that AUVs learn from frames (knowledge broadcast)


def _told_slots(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the slots that the AUV missed since its last ping, and the frame that named its own."""
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
    assigned = _assigned(result, ping)
    if len(assigned) and assigned.told_at_s.notna().all():
        frame: Any = assigned.iloc[0]
        yield Step(
            frame.told_at_s,
            frame.told_by,
            f"tells {ping.auv} that slot {frame.slot} of round {frame['round']} is its own",
            f"in a frame that {ping.auv} has decoded before it begins",
            {"round": int(frame["round"]), "slot": int(frame.slot)},
        )


def _is_reckoned(result: "Result", ping: Any) -> bool:
    """Tell whether an AUV pinged in a slot that no frame had assigned to it."""
    if not len(result.tables["assignments"]) or len(_assigned(result, ping)):
        return False
    return result.scenario.protocol.dissemination.missed in ("last_slot", "contention")


def _by_reckoning(result: "Result", ping: Any) -> str:
    """Tell why an AUV pings without an assigned slot, and to which AUV the slot belongs."""
    if result.scenario.protocol.dissemination.missed == "contention":
        return "it knows of no slot of its own, and tries its luck where it takes contention to be"
    words = (
        f"it has received no slot since, and pings in the last that it received, {ping.slot}, "
        "when that is by its reckoning"
    )
    assigned = result.tables["assignments"]
    begun = assigned[assigned.starts_at_s <= ping.sent_at_s]
    now = begun[(begun.starts_at_s == begun.starts_at_s.max()) & (begun.auv != ping.auv)]
    if not len(now):
        return words
    slot: Any = now.iloc[0]
    whose = f"that is slot {slot.slot} of round {slot['round']} by now, of {', '.join(now.auv)}"
    return f"{words}; {whose}"


def _assigned(result: "Result", ping: Any) -> Any:
    """Return the assignment (at most one row) by which an AUV pings."""
    return rows_where(
        result.tables["assignments"], round=ping["round"], slot=ping.slot, auv=ping.auv,
        starts_at_s=ping.sent_at_s, outcome="known",
    )  # fmt: skip


def _why_missed(result: "Result", slot: Any) -> str:
    """Tell why an AUV did not learn its slot."""
    if slot.told_by is None or slot.told_at_s != slot.told_at_s:
        return "no frame had named the slots of that round"
    auv, asv = (position_at(result, name, slot.told_at_s) for name in (slot.auv, slot.told_by))
    mf = result.scenario.acoustics.mf
    away = apart(mf, auv, asv)
    frame = f"the frame of {slot.told_by} that began at {slot.told_at_s:.4f} s"
    if mf.traits.ends_at_range and away > mf.range_m:
        return f"it was out of MF range of {frame}: {away:.1f} m > {mf.range_m:g} m"
    return f"it had not decoded {frame} when that slot began, from {away:.1f} m away"
