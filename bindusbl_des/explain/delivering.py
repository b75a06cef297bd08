"""The way down: who broadcasts a fix and why, and when it arrives."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.plugins import is_plugin
from ..results.round_timeline import uplink_slots
from ..scenario.declared import channel_named
from .chain import LatencyPart, Step, apart, compared, frame_of, place, rows_where
from .losing import frame_burst_words, located, why_broadcast, wrong
from .overlapping import failed, frame_cut, overlapped

if TYPE_CHECKING:
    from ..results.result import Result
    from ..scenario.sections.acoustics import Downlink


def known_at(result: "Result", fix: Any) -> float:
    """Return when the fleet knows a fix (s): once its ping has passed every ASV in range.

    Who replies directly knows it when the reply sets out.
    """
    if result.setup.downlink.replies:
        return float(fix.broadcast_at_s)
    met = rows_where(result.tables["receptions"], ping=fix.ping)
    reached = met[met.outcome != "out_of_range"]
    return float(reached.arrived_at_s.max()) + result.scenario.acoustics.hf.ping_s


def fixing(result: "Result", fix: Any) -> Step:
    """Return the step at which receptions become a fix."""
    asvs = fix.asvs.split()
    why = "one measurement" if len(asvs) == 1 else f"{len(asvs)} measurements fused (MVLUE)"
    words, facts = wrong(result, fix)
    return Step(
        known_at(result, fix),
        f"Fix {fix.fix}",
        f"is made by {', '.join(asvs)}: {located(fix)}",
        "; ".join([f"{why}, {fix.error_m:.2f} m off the truth", *words]),
        {
            "fix": fix.fix, "asvs": asvs, "x_m": fix.x_m, "y_m": fix.y_m, "error_m": fix.error_m,
            **facts,
        },
    )  # fmt: skip


def broadcasting(result: "Result", fix: Any) -> Step:
    """Return the step at which an ASV broadcasts a fix: why then, why this ASV, who is in range."""
    frame = frame_of(result, fix)
    auv, asv = (place(result, name, fix.broadcast_at_s) for name in (fix.auv, fix.broadcast_by))
    protocol, mf = result.scenario.protocol, result.scenario.acoustics.mf
    away, limit = apart(mf, auv, asv), mf.range_m
    facts = {
        "waited_s": fix.broadcast_at_s - known_at(result, fix),
        "airtime_s": float(frame.airtime_s),
        "payload_bytes": int(frame.payload_bytes),
        "fixes": int(frame.fixes),
        "range_m": away,
        "limit_m": limit,
    }
    at_once = f"{protocol.downlink}: the first ASV to decode a ping answers it at once"
    if not protocol.sends_frames:
        when = (
            "as the ping's front arrives (reply_at ping_front)"
            if protocol.answer.reply_at == "ping_front"
            else "when the ping has arrived in full (reply_at ping_end)"
        )
        why = f"{at_once}; {when}, without airtime (reply instant)"
        return Step(fix.broadcast_at_s, fix.broadcast_by, "answers it", why, facts)
    within = (away > limit) == (fix.outcome == "out_of_range")
    words = compared(away, limit) if within else "at the edge of the"
    reached = f"{mf.range_metric} range of {fix.auv} {words} MF range"
    if met := overlapped(result, fix):
        reached = f"the frame is {met}"
    elif cut := frame_cut(result, fix):
        reached = cut
    elif not channel_named(mf.channel).ends_at_range:
        reached = f"{fix.auv} is {away:.1f} m away"
        reached += f"; {undecoded(mf, fix)}" if fix.outcome in ("lost", "out_of_range") else ""
        if fix.outcome == "lost" and (lasts := frame_burst_words(result, fix)):
            reached += f"; {lasts}"
    if protocol.replies:
        why = f"{at_once}; {_on_air(result, frame)}; {reached}"
        return Step(fix.broadcast_at_s, fix.broadcast_by, "answers it", why, facts)
    why = (
        f"{_why_then(result, fix, frame)}; {_why_it(result, fix, _turn(result, frame))}; "
        f"{_on_air(result, frame)}; {reached}"
    )
    number = "the fix alone" if frame.fixes == 1 else f"it among {frame.fixes} fixes"
    return Step(fix.broadcast_at_s, fix.broadcast_by, f"broadcasts {number}", why, facts)


def undecoded(mf: "Downlink", fix: Any) -> str:
    """Tell why an AUV has not decoded the frame with its fix, by a channel other than the disc."""
    if fix.outcome == "out_of_range":
        return f"the channel {mf.channel} lets {fix.auv} decode no frame of {fix.broadcast_by}"
    return (
        f"{fix.auv} does not decode the frame of {fix.broadcast_by}, by the chance of {mf.channel}"
    )


def _on_air(result: "Result", frame: Any) -> str:
    """Tell how long a frame is on the air, and why."""
    mf = result.scenario.acoustics.mf
    airtime = result.setup.slots.messages.airtime(int(frame.fixes), int(frame.named))
    if mf.airtimes is None:
        size = f"{frame.payload_bytes} B x 8 x {mf.overhead:g} / {mf.bit_rate_bps:g} bit/s"
    else:
        of = "" if mf.modem is None else f" of {mf.modem}"
        size = f"{frame.payload_bytes} B by the table of airtimes{of}"
    cut = f", cut after {frame.airtime_s:.4f} s" if frame.airtime_s < airtime else ""
    return f"{size} = {max(airtime, frame.airtime_s):.4f} s on the air{cut}"


def _turn(result: "Result", frame: Any) -> int:
    """Return how many broadcasts came before that of a frame; one may be several frames."""
    frames, number = result.tables["broadcasts"], int(frame.name)
    return number if "part" not in frames else int((frames.part[: number + 1] == 0).sum()) - 1


def _why_then(result: "Result", fix: Any, frame: Any) -> str:
    """Tell what the fix has waited for."""
    downlink = result.scenario.protocol.downlink
    if is_plugin(downlink):
        return f"{downlink.words}: the plug-in decided to broadcast now"
    if result.scenario.protocol.random_access:
        return why_broadcast(result, fix, frame, known_at(result, fix))
    slots, declared = uplink_slots(result, fix["round"]), result.setup.downlink
    slot = row_slot(result, fix) if declared.by_group else len(slots) - 1
    ends = slots[slot].end
    if int(frame["round"]) != int(fix["round"]) and declared.waits:
        if known_at(result, fix) > ends:
            return f"{downlink}: the last slot of its round had ended before the fix was made"
        most = result.setup.slots.messages.most
        return f"{downlink}: older fixes filled the messages before, of {most} each"
    which = "its slot" if declared.by_group else "the last slot of its round"
    words = f"{downlink}: {which} ended at {ends:.4f} s"
    if fix.broadcast_at_s - ends > 1e-9:
        words += " and the frame before it held the band until now"
    return words


def row_slot(result: "Result", fix: Any) -> int:
    """Return the slot in which the ping of a fix was sent."""
    return int(rows_where(result.tables["pings"], ping=fix.ping).slot.iloc[0])


def _why_it(result: "Result", fix: Any, number: int) -> str:
    """Tell by which rule this ASV broadcasts, `number` counting all frames before."""
    rule, count = result.scenario.protocol.broadcaster, result.scenario.asvs.count
    gone = failed(result, fix.broadcast_at_s)
    able = [n for n in range(count) if n not in gone]
    carried = rows_where(result.tables["fixes"], broadcast_at_s=fix.broadcast_at_s)
    if is_plugin(rule):
        return f"{rule.words}: the plug-in chose {fix.broadcast_by}"
    chosen = result.setup.broadcaster
    if chosen.chosen_by == "turn" and gone:
        names = ", ".join(f"ASV{n}" for n in able)
        return (
            f"{rule}: frame {number} is that of number {number} mod {len(able)} = "
            f"{number % len(able)} of those that work, {names}"
        )
    if chosen.chosen_by == "turn":
        return f"{rule}: frame {number} is that of ASV {number} mod {count} = {number % count}"
    if chosen.chosen_by == "lot":
        return f"{rule}: drawn at random"
    if chosen.chosen_by == "one":
        asked = f"ASV{rule.settings.get('asv', 0)}"
        if asked != fix.broadcast_by:
            return f"{rule}: {asked} has failed, {fix.broadcast_by} is the next that works"
        return f"{rule}: always {fix.broadcast_by}"
    if chosen.chosen_by == "hearing":
        own = sum(fix.broadcast_by in asvs.split() for asvs in carried.asvs)
        return f"{rule}: it measured {own} of the {len(carried)}, no ASV more"
    if chosen.at_once:
        return _shared(result, fix, able)
    goals = carried[["x_m", "y_m"]].to_numpy(float)
    means = [
        float(np.hypot(*(goals - place(result, f"ASV{n}", fix.broadcast_at_s)[:2]).T).mean())
        for n in able
    ]
    words = ", ".join(f"ASV{n} {mean:.1f} m" for n, mean in zip(able, means, strict=True))
    return f"{rule}: mean distance to the fixes {words}"


def _shared(result: "Result", fix: Any, able: list[int]) -> str:
    """Tell why the one of those ASVs that work sends a fix that is nearest to it."""
    begin, goal = fix.broadcast_at_s, np.array([fix.x_m, fix.y_m], dtype=float)
    away = [math.hypot(*(goal - place(result, f"ASV{n}", begin)[:2])) for n in able]
    frames = rows_where(result.tables["broadcasts"], sent_at_s=begin)
    others = sorted(set(frames.asv) - {fix.broadcast_by})
    rule = result.scenario.protocol.broadcaster
    words = f"{rule}: {fix.broadcast_by} is the nearest to the fix, {min(away):.1f} m from it"
    if not others:
        return f"{words}; no other ASV sends now"
    return f"{words}; {', '.join(others)} {'send' if len(others) > 1 else 'sends'} at once"


def latency(result: "Result", fix: Any) -> Iterator[LatencyPart]:
    """Yield what the time from ping to delivery went into; the parts add up to the latency."""
    frame = frame_of(result, fix)
    known = known_at(result, fix)
    on_air = fix.broadcast_at_s + float(frame.airtime_s)
    protocol = result.scenario.protocol
    until = "is heard by the first ASV" if protocol.replies else "has passed every ASV in range"
    yield LatencyPart(f"way up: the ping {until}", known - fix.pinged_at_s)
    yield LatencyPart("wait for the broadcast", fix.broadcast_at_s - known)
    yield LatencyPart("frame on the air", float(frame.airtime_s))
    load = int(frame.fixes), int(frame.named)
    handing = result.setup.slots.messages.delay(*load) if protocol.sends_frames else 0.0
    if handing:
        yield LatencyPart("modem hands it over", handing)
        on_air += handing
    if result.scenario.protocol.tick_rate_hz is None:
        yield LatencyPart("way down", fix.delivered_at_s - on_air)
        return
    auv, asv = (place(result, name, on_air) for name in (fix.auv, fix.broadcast_by))
    travel = math.dist(auv, asv) / result.setup.sound_speed_m_per_s
    travel = min(travel, fix.delivered_at_s - on_air)
    yield LatencyPart("way down", travel)
    yield LatencyPart("rounded up to the clock's tick", fix.delivered_at_s - on_air - travel)
