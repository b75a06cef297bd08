"""Chains of a ping and of a fix, from the steps of uplink, downlink and correction."""

from typing import TYPE_CHECKING, Any

from .chain import UNREACHED, Chain, LatencyPart, Step, failed_asvs, known, row_of, rows_where
from .correcting import arriving
from .delivering import broadcasting, fixing, forwarding, latency, why_missed
from .hearing import is_sent, receptions, why_unanswered
from .sending import acknowledged, beaconing, sending

if TYPE_CHECKING:
    from ...core.results.result import Result

# Words for an ASV's ping that no AUV decoded: of these outcomes, the first that any AUV has counts.
FATES = {
    "in_flight": "the mission ends while it is under way",
    "lost": "lost by chance at every AUV in range",
    "collided": "overlapped by another ping at every AUV in range",
}


def chain_of_fix(result: "Result", number: int) -> Chain:
    """Return the chain of one fix: that of its ping, or of its AUV alone with passive ranging.

    Raises:
        LookupError: when the result holds no events, or no such fix.
    """
    fix = row_of(result, "fixes", "fix", number)
    if not result.scenario.protocol.asvs_ping:
        return chain_of_ping(result, int(fix.ping))
    ping = row_of(result, "pings", "ping", int(fix.ping))
    heard = [step for step in receptions(result, ping) if step.who == fix.auv]
    made = fixing(result, fix), arriving(result, fix)
    steps = _in_order([*beaconing(result, ping), *heard, *made])
    words = f"fix {fix.fix}, the AUV's own, {fix.latency_s:.4f} s after the ping"
    parts = tuple(latency(result, fix))
    return Chain(int(fix.ping), fix.auv, fix.fix, fix.outcome, words, steps, parts, ping.asv)


def chain_of_ping(result: "Result", number: int) -> Chain:
    """Return the chain of one ping: all its receptions, and the fix that it led to.

    With passive ranging AUVs receive the ping, and several may fix themselves by it.

    Raises:
        LookupError: when the result holds no events, or no such ping.
    """
    ping = row_of(result, "pings", "ping", number)
    numbers = rows_where(result.tables["fixes"], ping=number).fix.tolist()
    fixes = [row_of(result, "fixes", "fix", fix) for fix in numbers]
    if result.scenario.protocol.asvs_ping:
        steps = [*beaconing(result, ping), *receptions(result, ping)]
        steps += [of(result, fix) for fix in fixes for of in (fixing, arriving)]
        outcome, words = _shared(result, ping, fixes)
        return Chain(number, None, None, outcome, words, _in_order(steps), (), ping.asv)
    steps = [*sending(result, ping), *receptions(result, ping), *acknowledged(result, ping)]
    if not fixes:
        outcome, words = _without_fix(result, ping)
        return Chain(number, ping.auv, None, outcome, words, _in_order(steps))
    fix, parts = fixes[0], tuple[LatencyPart, ...]()
    steps.append(fixing(result, fix))
    if fix.broadcast_by is None:
        words = f"fix {fix.fix}, but the mission ends before any ASV broadcasts it"
    else:
        steps += [broadcasting(result, fix), *forwarding(result, fix)]
        words = f"fix {fix.fix}, but the mission ends while it is on its way down"
    if fix.outcome == "delivered":
        steps.append(arriving(result, fix))
        parts = tuple(latency(result, fix))
        words = f"fix {fix.fix}, delivered {fix.latency_s:.4f} s after the ping"
        hops = known(fix.get("hops"))
        words += f" by {int(hops)} hop{'s' * (hops > 1)}" if hops else ""
    elif fix.outcome != "in_flight":
        frame = "its frame was " if fix.outcome == "collided" else ""
        words = f"fix {fix.fix}, never delivered: {frame}{why_missed(result, fix)}"
    return Chain(number, ping.auv, fix.fix, fix.outcome, words, _in_order(steps), parts)


def _without_fix(result: "Result", ping: Any) -> tuple[str, str]:
    """Return the outcome of a ping that led to no fix, as a word and in words."""
    if not is_sent(ping):
        return ping.call, f"no ping: {why_unanswered(result, ping)}"
    outcomes = list(rows_where(result.tables["receptions"], ping=ping.ping).outcome)
    if "heard" in outcomes or "in_flight" in outcomes:
        return "in_flight", "no fix: the mission ends while the ping is under way"
    if set(outcomes) <= {*UNREACHED}:
        beyond = result.scenario.acoustics.hf.beyond
        if "blocked" in outcomes:
            behind = outcomes.count("blocked")
            others = f", the others are {beyond}" if behind < len(outcomes) else ""
            return "blocked", f"no fix: land is between {ping.auv} and {behind} ASVs{others}"
        beyond += " or has failed" if failed_asvs(result, ping.sent_at_s) else ""
        return "out_of_range", f"no fix: every ASV is {beyond}"
    destroyed = [word for word in ("lost", "collided") if word in outcomes]
    words = [f"{word} at {outcomes.count(word)}" for word in destroyed]
    near = sum(outcome not in UNREACHED for outcome in outcomes)
    return destroyed[0], f"no fix: {' and '.join(words)} of {near} ASVs in range"


def _shared(result: "Result", ping: Any, fixes: list[Any]) -> tuple[str, str]:
    """Return the outcome of an ASV's ping, as a word and in words."""
    if fixes:
        verb = "fixes itself" if len(fixes) == 1 else "fix themselves"
        number = f"fix{'es' * (len(fixes) > 1)} {', '.join(str(fix.fix) for fix in fixes)}"
        return "delivered", f"{', '.join(fix.auv for fix in fixes)} {verb} by it ({number})"
    met = rows_where(result.tables["receptions"], ping=ping.ping)
    if (met.why == "failed_meanwhile").any():
        words = next(step.why for step in receptions(result, ping) if step.what.startswith("loses"))
        return "lost", f"no fix: {words}"
    for outcome, words in FATES.items():
        if outcome in set(met.outcome):
            return outcome, f"no fix: {words}"
    if "blocked" in set(met.outcome):
        return "blocked", f"no fix: land is between {ping.asv} and every AUV in range"
    beyond = result.scenario.acoustics.hf.beyond
    who = "the AUV is" if result.scenario.auvs.count == 1 else "every AUV is"
    return "out_of_range", f"no fix: {who} {beyond}"


def _in_order(steps: list[Step]) -> tuple[Step, ...]:
    return tuple(sorted(steps, key=lambda step: step.time_s))
