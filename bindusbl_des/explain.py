"""The causal chain of one ping or fix, told from the result tables."""

from collections.abc import Iterator
from typing import Any

from .result import Result


def explain_ping(result: Result, number: int) -> str:
    """Tell what became of one ping, ASV by ASV, and of the fix that it led to.

    Raises:
        LookupError: when the result holds no events, or no such ping.
    """
    ping = _row(result, "pings", "ping", number)
    lines = [*_sending(result, ping), *_receptions(result, number)]
    fixes = result.tables["fixes"]
    fix = fixes[fixes.ping == number]
    if len(fix):
        lines += _fix(result, fix.astype(object).iloc[0])
    else:
        lines.append(_why_no_fix(result, number))
    return "\n".join(lines)


def explain_fix(result: Result, number: int) -> str:
    """Tell where one fix came from and what became of it.

    Raises:
        LookupError: when the result holds no events, or no such fix.
    """
    return explain_ping(result, int(_row(result, "fixes", "fix", number).ping))


def _row(result: Result, table: str, key: str, number: int) -> Any:
    if table not in result.arrow:
        raise LookupError("the run recorded no events (record.detail: summary); run it with 'full'")
    rows = result.tables[table]
    found = rows[rows[key] == number]
    if not len(found):
        last = f"it has 0..{len(rows) - 1}" if len(rows) else "it has none"
        raise LookupError(f"the run has no {key} {number}; {last}")
    return found.astype(object).iloc[0]  # whole numbers stay whole


def _sending(result: Result, ping: Any) -> Iterator[str]:
    rounds = result.tables["rounds"]
    row = rounds[rounds["round"] == ping["round"]].astype(object).iloc[0]
    yield (
        f"Ping {ping.ping} of {ping.auv}: round {ping['round']} (began {row.started_at_s:.4f} s, "
        f"{row.colours} groups, {row.conflicts} conflicts), slot {ping.slot}."
    )
    yield (
        f"  {ping.sent_at_s:.4f} s  {ping.auv} pings at x {ping.x_m:.1f}, y {ping.y_m:.1f}, "
        f"depth {ping.z_m:.1f} m; ASVs within HF range: {ping.in_range_of}."
    )


def _receptions(result: Result, number: int) -> Iterator[str]:
    receptions = result.tables["receptions"]
    hf = result.scenario.acoustics.hf
    rules = {
        "heard": "decoded",
        "out_of_range": f"too far: {hf.range_metric} distance above hf.range_m = {hf.range_m:g} m",
        "lost": "lost to the channel (acoustics.loss)",
        "in_flight": "the mission ends while it is under way",
    }
    own: Any = receptions[receptions.ping == number].sort_values("arrived_at_s")
    for reception in own.itertuples():
        rule = rules.get(str(reception.outcome)) or _collision(result, reception)
        yield (
            f"  {reception.arrived_at_s:.4f} s  {reception.asv}: after "
            f"{reception.slant_range_m:.1f} m and {1e3 * reception.travel_time_s:.1f} ms: {rule}."
        )


def _collision(result: Result, reception: Any) -> str:
    receptions = result.tables["receptions"]
    duration = result.scenario.acoustics.hf.ping_s
    others = receptions[
        (receptions.asv == reception.asv)
        & (receptions.ping != reception.ping)
        & (receptions.outcome != "out_of_range")
        & ((receptions.arrived_at_s - reception.arrived_at_s).abs() < duration)
    ]
    names = ", ".join(
        f"ping {other.ping} of {other.auv} at {other.arrived_at_s:.4f} s"
        for other in others.itertuples()
    )
    return f"collided with {names}"


def _fix(result: Result, fix: Any) -> Iterator[str]:
    yield (
        f"  Fix {fix.fix} from {fix.asvs}: x {fix.x_m:.2f} +- {fix.sd_x_m:.2f}, y {fix.y_m:.2f} +- "
        f"{fix.sd_y_m:.2f} m; it is {fix.error_m:.2f} m off the truth."
    )
    if fix.broadcast_by is None or fix.broadcast_by != fix.broadcast_by:
        yield "  The mission ends before any ASV broadcasts it."
        return
    yield f"  {fix.broadcast_at_s:.4f} s  {fix.broadcast_by} broadcasts it."
    if fix.outcome == "out_of_range":
        reach = result.scenario.acoustics.mf.range_m
        yield (
            f"  Never delivered: {fix.auv} is beyond mf.range_m = {reach:g} m of "
            f"{fix.broadcast_by}."
        )
    elif fix.outcome == "in_flight":
        yield "  The mission ends before it is delivered."
    else:
        yield (
            f"  {fix.delivered_at_s:.4f} s  {fix.auv} has it, {fix.latency_s:.4f} s after its "
            f"ping, and corrects by {result.scenario.navigation.gain:g} x {fix.innovation_m:.2f} m."
        )


def _why_no_fix(result: Result, number: int) -> str:
    receptions = result.tables["receptions"]
    outcomes = receptions[receptions.ping == number].outcome
    if (outcomes == "in_flight").any():
        return "  No fix: the mission ends while the ping is under way."
    if (outcomes == "out_of_range").all():
        return "  No fix: no ASV is within HF range."
    return "  No fix: no ASV decoded it."
