"""The chain of a ping, put together from its way up and the way down of its fix."""

from typing import TYPE_CHECKING, Any

from ..scenario.declared import channel_named
from .chain import Chain, LatencyPart, Step, out_of_range, row_of, rows_where
from .correcting import arriving
from .delivering import broadcasting, fixing, latency, undecoded
from .hearing import is_sent, receptions, sending, why_unanswered
from .itself import own_chain, shared_chain
from .overlapping import failed, frame_cut, overlapped

if TYPE_CHECKING:
    from ..results.result import Result


def explain_ping(result: "Result", number: int) -> str:
    """Tell what became of one ping, ASV by ASV, and of the fix that it led to.

    Raises:
        LookupError: when the result holds no events, or no such ping.
    """
    return chain_of_ping(result, number).text()


def explain_fix(result: "Result", number: int) -> str:
    """Tell where one fix came from and what became of it.

    Raises:
        LookupError: when the result holds no events, or no such fix.
    """
    return chain_of_fix(result, number).text()


def chain_of_fix(result: "Result", number: int) -> Chain:
    """Return the causal chain of the ping that a fix belongs to; errors as `explain_fix`."""
    fix = row_of(result, "fixes", "fix", number)
    if result.scenario.protocol.asvs_ping:
        return own_chain(result, fix)
    return chain_of_ping(result, int(fix.ping))


def chain_of_ping(result: "Result", number: int) -> Chain:
    """Return the causal chain of one ping; errors as `explain_ping`."""
    ping = row_of(result, "pings", "ping", number)
    if result.scenario.protocol.asvs_ping:
        return shared_chain(result, ping)
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


def _in_order(steps: list[Step]) -> tuple[Step, ...]:
    return tuple(sorted(steps, key=lambda step: step.time_s))


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
