"""The chain of a ping, put together from its way up and the way down of its fix; or of an ASV's
ping, by which AUVs fix themselves (ranging passive).
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..core.wording import counted
from ..results.round_timeline import uplink_slots
from ..scenario.declared import channel_named
from .chain import Chain, LatencyPart, Step, out_of_range, row_of, rows_where
from .correcting import arriving
from .delivering import broadcasting, fixing, latency, undecoded
from .hearing import is_sent, receptions, sending, why_unanswered
from .losing import located, wrong
from .overlapping import failed, failed_while, frame_cut, overlapped

if TYPE_CHECKING:
    from ..results.result import Result

# What is told of a ping that no AUV has decoded, by the first of these that one of them had.
FATES = {
    "in_flight": "the mission ends while it is under way",
    "lost": "lost by chance",
    "collided": "overlapped by another ping",
}


def chain_of_fix(result: "Result", number: int) -> Chain:
    """Return where one fix came from and what became of it: the chain of its ping.

    Raises:
        LookupError: when the result holds no events, or no such fix.
    """
    fix = row_of(result, "fixes", "fix", number)
    if result.scenario.protocol.asvs_ping:
        return _own_chain(result, fix)
    return chain_of_ping(result, int(fix.ping))


def chain_of_ping(result: "Result", number: int) -> Chain:
    """Return what became of one ping, ASV by ASV, and of the fix that it led to.

    Raises:
        LookupError: when the result holds no events, or no such ping.
    """
    ping = row_of(result, "pings", "ping", number)
    if result.scenario.protocol.asvs_ping:
        return _shared_chain(result, ping)
    steps = [*sending(result, ping), *receptions(result, ping)]
    found = rows_where(result.tables["fixes"], ping=number)
    if not len(found):
        outcome, words = _without_fix(result, ping)
        return Chain(number, ping.auv, None, outcome, words, _in_order(steps))
    fix: Any = found.astype(object).where(found.notna(), None).iloc[0]
    parts: tuple[LatencyPart, ...] = ()
    steps.append(fixing(result, fix))
    if fix.broadcast_by is None:
        words = f"fix {fix.fix}, but the mission ends before any ASV broadcasts it"
    else:
        steps.append(broadcasting(result, fix))
        words = _never_delivered(result, fix)
    if fix.outcome == "delivered":
        steps.append(arriving(result, fix))
        parts = tuple(latency(result, fix))
        words = f"fix {fix.fix}, delivered {fix.latency_s:.4f} s after the ping"
    return Chain(number, ping.auv, fix.fix, fix.outcome, words, _in_order(steps), parts)


def _own_chain(result: "Result", fix: Any) -> Chain:
    """Return the chain of a fix that an AUV made itself: the ping, what it heard, its estimate."""
    ping = row_of(result, "pings", "ping", int(fix.ping))
    heard = [step for step in receptions(result, ping) if step.who == fix.auv]
    steps = [*_sending(result, ping), *heard, _fixing(result, fix), arriving(result, fix)]
    parts = (
        LatencyPart("way down: the ping's front reaches the AUV", fix.valid_at_s - fix.pinged_at_s),
        LatencyPart(
            "the ping's own length, until it is decoded", fix.delivered_at_s - fix.valid_at_s
        ),
    )
    words = f"fix {fix.fix}, the AUV's own, {fix.latency_s:.4f} s after the ping"
    return Chain(
        int(fix.ping), fix.auv, fix.fix, fix.outcome, words, _in_order(steps), parts, ping.asv
    )


def _shared_chain(result: "Result", ping: Any) -> Chain:
    """Return the chain of an ASV's ping: what each AUV makes of it."""
    steps = [*_sending(result, ping), *receptions(result, ping)]
    fixes = rows_where(result.tables["fixes"], ping=ping.ping)
    for number in fixes.fix:
        fix = row_of(result, "fixes", "fix", number)
        steps += [_fixing(result, fix), arriving(result, fix)]
    outcome, words = _shared(result, ping, fixes)
    return Chain(ping.ping, None, None, outcome, words, _in_order(steps), (), ping.asv)


def _never_delivered(result: "Result", fix: Any) -> str:
    if fix.outcome == "in_flight":
        return f"fix {fix.fix}, but the mission ends while it is on its way down"
    if met := overlapped(result, fix):
        return f"fix {fix.fix}, never delivered: its frame was {met}"
    if cut := frame_cut(result, fix):
        return f"fix {fix.fix}, never delivered: {cut}"
    mf = result.scenario.acoustics.mf
    if not channel_named(mf.channel).ends_at_range:
        return f"fix {fix.fix}, never delivered: {undecoded(mf, fix)}"
    reach = mf.range_m
    return (
        f"fix {fix.fix}, never delivered: {fix.auv} is beyond mf.range_m = {reach:g} m of "
        f"{fix.broadcast_by}"
    )


def _without_fix(result: "Result", ping: Any) -> tuple[str, str]:
    """Return why a ping led to no fix, as a word and in words."""
    if not is_sent(ping):
        return ping.call, f"no ping: {why_unanswered(result, ping)}"
    outcomes = list(rows_where(result.tables["receptions"], ping=ping.ping).outcome)
    if "heard" in outcomes or "in_flight" in outcomes:
        return "in_flight", "no fix: the mission ends while the ping is under way"
    if all(outcome == "out_of_range" for outcome in outcomes):
        beyond = out_of_range(result.scenario.acoustics.hf)
        beyond += " or has failed" if failed(result, ping.sent_at_s) else ""
        return "out_of_range", f"no fix: every ASV is {beyond}"
    counts = [
        f"{word} at {outcomes.count(outcome)}"
        for outcome, word in (("lost", "lost"), ("collided", "collided"))
        if outcome in outcomes
    ]
    outcome = "collided" if "lost" not in outcomes else "lost"
    near = sum(outcome != "out_of_range" for outcome in outcomes)
    return outcome, f"no fix: {' and '.join(counts)} of {near} ASVs in range"


def _in_order(steps: list[Step]) -> tuple[Step, ...]:
    return tuple(sorted(steps, key=lambda step: step.time_s))


def _sending(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the round and the ping."""
    row = row_of(result, "rounds", "round", ping["round"])
    yield Step(
        row.started_at_s,
        f"Round {ping['round']}",
        f"begins: {counted(row.colours, 'ASV')} in turn (passive)",
        facts={"round": ping["round"], "colours": row.colours},
    )
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


def _fixing(result: "Result", fix: Any) -> Step:
    """Return the step at which an AUV makes a fix of what it has heard."""
    words, facts = wrong(result, fix)
    return Step(
        fix.delivered_at_s,
        f"Fix {fix.fix}",
        f"is made by {fix.auv} itself, of where it was as the ping arrived: {located(fix)}",
        f"the offset by its own array, AHRS and clock, taken from where {fix.asvs} was; "
        + "; ".join([f"{fix.error_m:.2f} m off the truth", *words]),
        {"fix": fix.fix, "asvs": [fix.asvs], "x_m": fix.x_m, "y_m": fix.y_m,
         "error_m": fix.error_m, **facts},
    )  # fmt: skip


def _shared(result: "Result", ping: Any, fixes: Any) -> tuple[str, str]:
    """Return what became of a ping, as a word and in words."""
    count = result.scenario.auvs.count
    if len(fixes):
        verb = "fixes itself" if len(fixes) == 1 else "fix themselves"
        number = f"fix{'es' * (len(fixes) > 1)} {', '.join(map(str, fixes.fix))}"
        return "delivered", f"{', '.join(fixes.auv)} {verb} by it ({number})"
    outcomes = set(rows_where(result.tables["receptions"], ping=ping.ping).outcome)
    ends = ping.sent_at_s + result.scenario.acoustics.hf.ping_s
    if "lost" in outcomes and (
        cut := failed_while(result, ping.asv, ping.sent_at_s, ends, "pinged")
    ):
        return "lost", f"no fix: {cut}"
    for outcome, words in FATES.items():
        if outcome in outcomes:
            where = "" if outcome == "in_flight" else " at every AUV in range"
            return outcome, f"no fix: {words}{where}"
    beyond = out_of_range(result.scenario.acoustics.hf)
    return "out_of_range", f"no fix: {'the AUV is' if count == 1 else 'every AUV is'} {beyond}"
