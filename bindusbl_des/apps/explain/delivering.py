"""The downlink: how a fix is made, which ASV broadcasts it and why, and when it arrives."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.results.round_timeline import uplink_slots
from ...support.wording import plus_minus
from .chain import (
    UNREACHED,
    LatencyPart,
    Step,
    apart,
    behind,
    compared,
    failed_asvs,
    failed_at,
    known,
    lines,
    lost_in_a_row,
    position_at,
    row_of,
    rows_where,
    too_fast,
)

if TYPE_CHECKING:
    from ...core.results.result import Result

# Instants that differ by less (s) count as equal.
SAME = 1e-9


def known_at(result: "Result", fix: Any) -> float:
    """Return when the fleet has a fix (s): after its ping has passed every ASV in range.

    An ASV that replies directly has it when its reply begins.
    """
    if result.setup.downlink.replies:
        return float(fix.broadcast_at_s)
    met = rows_where(result.tables["receptions"], ping=fix.ping)
    reached = met[~met.outcome.isin(UNREACHED)]
    return float(reached.arrived_at_s.max()) + result.scenario.acoustics.hf.ping_s


def fixing(result: "Result", fix: Any) -> Step:
    """Return the step at which receptions become a fix, by the fleet or by the AUV itself."""
    asvs = fix.asvs.split()
    words, facts = _wrong(result, fix)
    located = f"x {plus_minus(fix.x_m, fix.sd_x_m)}, y {plus_minus(fix.y_m, fix.sd_y_m)} m"
    off = f"{fix.error_m:.2f} m off the truth"
    if result.scenario.protocol.asvs_ping:
        time, who = fix.delivered_at_s, f"{fix.auv} itself, of where it was as the ping arrived"
        array = "the offset by its own array, AHRS and clock"
        why = f"{array}, taken from where {fix.asvs} was; {off}"
    else:
        time, who = known_at(result, fix), ", ".join(asvs)
        made = "one measurement" if len(asvs) == 1 else f"{len(asvs)} measurements fused (MVLUE)"
        why = f"{made}, {off}"
    facts = {
        "fix": fix.fix, "asvs": asvs, "x_m": fix.x_m, "y_m": fix.y_m, "error_m": fix.error_m,
        **facts,
    }  # fmt: skip
    return Step(time, f"Fix {fix.fix}", f"is made by {who}: {located}", lines(why, *words), facts)


def _wrong(result: "Result", fix: Any) -> tuple[list[str], dict[str, Any]]:
    """Return the systematic errors in the measurements of a fix, in words and as numbers."""
    met = rows_where(result.tables["receptions"], ping=fix.ping, auv=fix.auv)
    heard = met[met.asv.isin(fix.asvs.split())]
    passive, setup = result.scenario.protocol.asvs_ping, result.setup
    facts, those = dict[str, Any](), dict[str, list[str]]()
    for row in heard.itertuples():
        gnss = {"gnss_x_m": row.gnss_error_x_m, "gnss_y_m": row.gnss_error_y_m}
        for text, who, digits, values in (
            ("headings misaligned (deg)", row.auv if passive else row.asv, 2,
             {"misalignment_deg": row.misalignment_deg}),
            ("GNSS slowly astray (x y, m)", row.asv, 2, gnss),
            ("ranges slowly astray (m)", row.asv, 3, {"slow_range_m": row.slow_range_error_m}),
        ):  # fmt: skip
            if any(known(value) is None for value in values.values()):
                continue
            facts |= {f"{who}_{name}": value for name, value in values.items()}
            numbers = [f"{value:+.{digits}f}" for value in values.values()]
            those.setdefault(text, []).append(" ".join([who, *numbers]))
    words = [f"{text}: {', '.join(numbers)}" for text, numbers in those.items()]
    share, assumed = setup.sound_speed_error, setup.assumed_sound_speed_m_per_s
    if share and not result.scenario.usbl.model.is_own:
        facts["sound_speed_error"] = share
        words.append(
            f"ranges {100 * abs(share):.2f} % too {'long' if share > 0 else 'short'}: sound is "
            f"assumed to travel at {assumed:g}, not at {setup.sound_speed_m_per_s:g} m/s"
        )
    late = None if heard.empty else known(heard.clock_late_s.iloc[0])
    if late is not None:
        facts["clock_late_s"] = float(late)
        longer = late * assumed * (-1 if passive else 1)
        words.append(
            f"the clock of {fix.auv} is {1e3 * late:+.3f} ms late: ranges {longer:+.2f} m too long"
        )
    return words, facts


def frame_of(result: "Result", fix: Any) -> Any:
    """Return the row of the frame in which a fix was broadcast."""
    frames = result.tables["broadcasts"]
    return rows_where(frames, sent_at_s=fix.broadcast_at_s, asv=fix.broadcast_by).iloc[0]


def carrier_of(result: "Result", fix: Any) -> Any:
    """Return the row of the frame that delivered a fix: one of several if it was repeated."""
    if (came_in := known(fix.get("came_in"))) is None:
        return frame_of(result, fix)
    return result.tables["broadcasts"].iloc[int(came_in)]


def relay_of(result: "Result", fix: Any) -> Any:
    """Return the row of the AUV's frame that relayed a fix; None if its ASV sent it."""
    by = known(fix.get("relayed_by"))
    if by is None:
        return None
    sent = rows_where(result.tables["auv_frames"], auv=by, broadcast=int(fix.came_in))
    return sent[sent.kind == "relay"].iloc[0]


def forwarding(result: "Result", fix: Any) -> Iterator[Step]:
    """Yield the steps of a fix after its first broadcast: repeats, relays, acknowledgement."""
    protocol, frame = result.scenario.protocol, carrier_of(result, fix)
    if known(fix.get("came_in")) is not None and frame.sent_at_s > fix.broadcast_at_s:
        times = int(fix.repeats)
        why = f"repeat {protocol.repeat}: {times} further broadcast{'s' * (times > 1)} carried it"
        facts = {"repeats": times}
        yield Step(frame.sent_at_s, frame.asv, "broadcasts it once more", why, facts)
    if (relay := relay_of(result, fix)) is not None:
        met = rows_where(
            result.tables["auv_frame_receptions"], auv_frame=relay.auv_frame, listener=fix.auv
        ).iloc[0]
        words = lines(
            f"hop {relay.hops}: in its turn, once it had decoded the frame of {frame.asv}",
            f"{relay.payload_bytes} B, {relay.airtime_s:.4f} s on the air; {fix.auv} hears it from "
            f"{met.arrived_at_s:.4f} s on",
        )
        sent = {"hops": int(relay.hops), "airtime_s": float(relay.airtime_s)}
        yield Step(relay.sent_at_s, fix.relayed_by, "forwards it", words, sent)
    if (since := known(fix.get("acknowledged_at_s"))) is not None:
        how = "a frame of its own" if protocol.acknowledge == "frame" else "its ping"
        why = f"acknowledge {protocol.acknowledge}: {how} tells of it"
        if fix.duplicates:
            copies = f"{int(fix.duplicates)} further cop{'ies' if fix.duplicates > 1 else 'y'}"
            why = lines(why, f"{copies} that {fix.auv} decoded corrected nothing")
        told = {"acknowledged_at_s": float(since), "duplicates": int(fix.duplicates)}
        yield Step(since, "The fleet", f"knows that {fix.auv} has it", why, told)


def broadcasting(result: "Result", fix: Any) -> Step:
    """Return the step at which an ASV broadcasts a fix: why now, why this ASV, in which range."""
    frame, protocol = frame_of(result, fix), result.scenario.protocol
    facts = {
        "waited_s": fix.broadcast_at_s - known_at(result, fix),
        "airtime_s": float(frame.airtime_s),
        "payload_bytes": int(frame.payload_bytes),
        "fixes": int(frame.fixes),
        "range_m": _away(result, fix),
        "limit_m": result.scenario.acoustics.mf.range_m,
    }
    on_air = _on_air(result, frame), _reached(result, fix)
    if not protocol.replies:
        number = "the fix alone" if frame.fixes == 1 else f"it among {frame.fixes} fixes"
        what = f"broadcasts {number}"
        why = lines(_why_then(result, fix, frame), _why_it(result, fix, frame), *on_air)
    else:
        what = "answers it"
        why = f"{protocol.downlink}: the first ASV to decode a ping answers it at once"
        if protocol.sends_frames:
            why = lines(why, *on_air)
        else:
            front = protocol.answer.reply_at == "ping_front"
            when = "as the ping's front arrives" if front else "when the ping has arrived in full"
            at = f"{when} (reply_at {protocol.answer.reply_at}), without airtime (reply instant)"
            why = lines(why, at)
    return Step(fix.broadcast_at_s, fix.broadcast_by, what, why, facts)


def _away(result: "Result", fix: Any) -> float:
    """Return the distance (m) from the AUV of a fix to its broadcaster as the broadcast begins."""
    auv, asv = (
        position_at(result, name, fix.broadcast_at_s) for name in (fix.auv, fix.broadcast_by)
    )
    return apart(result.scenario.acoustics.mf, auv, asv)


def _reached(result: "Result", fix: Any) -> str:
    """Tell the distance at which an AUV decodes the frame with its fix, or why it does not."""
    mf, away, missed = result.scenario.acoustics.mf, _away(result, fix), why_missed(result, fix)
    beyond, ends = fix.outcome == "out_of_range", mf.traits.ends_at_range
    if fix.outcome == "blocked":
        return missed
    if fix.outcome == "collided":
        return f"the frame is {missed}"
    if not ends and not (missed and _met(result, fix).why in ("failed", "failed_meanwhile")):
        words = f"{fix.auv} is {away:.1f} m away"
        return f"{words}; {missed}" if missed else words
    if missed and not beyond:
        return missed
    if not ends:
        return f"{fix.auv} is {away:.1f} m away"
    words = compared(away, mf.range_m) if (away > mf.range_m) == beyond else "at the edge of the"
    return f"{mf.range_metric} range of {fix.auv} {words} MF range"


def _met(result: "Result", fix: Any) -> Any:
    """Return the row of the reception, at its AUV, of the frame with a fix."""
    met = result.tables["frame_receptions"]
    return rows_where(met, broadcast=frame_of(result, fix).name, auv=fix.auv).iloc[0]


def why_missed(result: "Result", fix: Any) -> str:
    """Tell why the AUV did not decode the frame with its fix; "" if it did, or still may."""
    if fix.outcome == "blocked":
        return behind(result, fix.auv, fix.broadcast_by, fix.broadcast_at_s)
    if fix.outcome not in ("out_of_range", "lost", "collided"):
        return ""
    mf, met, asv = result.scenario.acoustics.mf, _met(result, fix), fix.broadcast_by
    if met.why == "failed":
        return (
            f"{asv} had {failed_at(result, asv, fix.broadcast_at_s)}, before its turn to broadcast"
        )
    if met.why == "failed_meanwhile":
        over = fix.broadcast_at_s + frame_of(result, fix).airtime_s + SAME
        return f"{asv} {failed_at(result, asv, over)}, while it broadcast the frame"
    if fix.outcome == "collided":
        return _overlapped(result, fix, met)
    if met.why == "doppler":
        words = too_fast(result, "mf", (fix.auv, asv), fix.broadcast_at_s)
        return f"{fix.auv} does not decode the frame of {asv}: {words}"
    if fix.outcome == "lost":
        words = f"{fix.auv} does not decode the frame of {asv}, by the chance of {mf.channel}"
        if met.why != "burst":
            return words
        frames, table = result.tables["broadcasts"], result.tables["frame_receptions"]
        pair = table[(table.auv == fix.auv) & (frames.asv[table.broadcast] == asv).to_numpy()]
        return lines(words, lost_in_a_row(mf, pair, met.arrived_at_s))
    if mf.traits.ends_at_range:
        return f"{fix.auv} is beyond mf.range_m = {mf.range_m:g} m of {asv}"
    return f"the channel {mf.channel} lets {fix.auv} decode no frame of {asv}"


def _overlapped(result: "Result", fix: Any, met: Any) -> str:
    """Tell which signal overlapped the frame with a fix at its AUV."""
    begin, end = met.arrived_at_s, met.arrived_at_s + frame_of(result, fix).airtime_s
    here = f"at {fix.auv} from {begin:.4f} to {end:.4f} s, overlapped by"
    by = known(met.overlapped_by)
    if by is None:
        return f"{here} another sound (which one, this folder does not say)"
    if met.why == "own_ping":
        sent_at = row_of(result, "pings", "ping", int(by)).sent_at_s
        return f"{here} its own ping at {sent_at:.4f} s (duplex per_node)"
    if met.why == "own_frame":
        sent_at = row_of(result, "auv_frames", "auv_frame", int(by)).sent_at_s
        return f"{here} the frame that it sent itself at {sent_at:.4f} s"
    if met.why == "auv_frame":
        own = row_of(result, "auv_frames", "auv_frame", int(by))
        heard = result.tables["auv_frame_receptions"]
        at = rows_where(heard, auv_frame=int(by), listener=fix.auv).iloc[0].arrived_at_s
        return f"{here} the {own.kind} of {own.auv} from {at:.4f} to {at + own.airtime_s:.4f} s"
    frame = result.tables["broadcasts"].iloc[int(by)]
    other = rows_where(result.tables["frame_receptions"], broadcast=int(by), auv=fix.auv).iloc[0]
    its_end = other.arrived_at_s + frame.airtime_s
    return f"{here} the frame of {frame.asv} from {other.arrived_at_s:.4f} to {its_end:.4f} s"


def _on_air(result: "Result", frame: Any) -> str:
    """Tell the airtime of a frame and how it is computed."""
    mf = result.scenario.acoustics.mf
    airtime = result.setup.slots.messages.airtime(int(frame.fixes), int(frame.named))
    if mf.airtimes is None:
        size = f"{frame.payload_bytes} B x 8 x {mf.overhead:g} / {mf.bit_rate_bps:g} bit/s"
    else:
        of = "" if mf.modem is None else f" of {mf.modem}"
        size = f"{frame.payload_bytes} B by the table of airtimes{of}"
    cut = f", cut after {frame.airtime_s:.4f} s" if frame.airtime_s < airtime else ""
    return f"{size} = {max(airtime, frame.airtime_s):.4f} s on the air{cut}"


def _why_then(result: "Result", fix: Any, frame: Any) -> str:
    """Tell why the broadcast of a fix began when it did."""
    downlink, declared = result.scenario.protocol.downlink, result.setup.downlink
    made, slots = known_at(result, fix), result.setup.slots
    if downlink.is_own:
        return f"{downlink.words}: the plug-in decided to broadcast now"
    if result.scenario.protocol.random_access:
        return _why_then_at_random(result, frame, made)
    spans = uplink_slots(result, fix["round"])
    slot = len(spans) - 1
    if declared.by_group:
        slot = row_of(result, "pings", "ping", int(fix.ping)).slot
    ends = spans[slot].end
    if int(frame["round"]) != int(fix["round"]) and declared.waits:
        if made > ends:
            return f"{downlink}: the last slot of its round had ended before the fix was made"
        return f"{downlink}: older fixes filled the messages before, of {slots.messages.most} each"
    which = "its slot" if declared.by_group else "the last slot of its round"
    words = f"{downlink}: {which} ended at {ends:.4f} s"
    if fix.broadcast_at_s - ends > SAME:
        words += " and the frame before it held the band until now"
    return words


def _why_then_at_random(result: "Result", frame: Any, made: float) -> str:
    """Tell why a fix, made at time `made` (s), was broadcast at this instant in random access."""
    downlink = result.scenario.protocol.downlink
    if frame.sent_at_s <= result.setup.slots.clock.after(made, 0.0) + SAME:
        return f"{downlink}: MF was free, so that it is broadcast at once"
    if frame.get("part"):
        return f"{downlink}: it is in message {frame.part + 1} of its broadcast"
    waited = f"{frame.sent_at_s - made:.4f} s"
    if row_of(result, "rounds", "round", int(frame["round"])).started_at_s < made:
        return f"{downlink}: no ASV worked for {waited}"
    return f"{downlink}: frames before it held the band until now, for {waited}"


def _why_it(result: "Result", fix: Any, frame: Any) -> str:
    """Tell by which rule this ASV broadcasts a fix."""
    rule, chosen = result.scenario.protocol.broadcaster, result.setup.broadcaster
    count, gone = result.scenario.asvs.count, failed_asvs(result, fix.broadcast_at_s)
    able, by = [n for n in range(count) if n not in gone], fix.broadcast_by
    if rule.is_own or not chosen.chosen_by:
        return f"{rule.words}: {'the plug-in' if rule.is_own else 'a rule of its own'} chose {by}"
    if chosen.chosen_by == "turn":
        parts = result.tables["broadcasts"].part[: frame.name + 1]
        number = int((parts == 0).sum()) - 1  # one broadcast may be several frames
        whose = f"{rule}: frame {number} is that of"
        if not gone:
            return f"{whose} ASV {number} mod {count} = {number % count}"
        turn = f"number {number} mod {len(able)} = {number % len(able)}"
        return f"{whose} {turn} of those that work, {', '.join(f'ASV{n}' for n in able)}"
    if chosen.chosen_by == "lot":
        return f"{rule}: drawn at random"
    if chosen.chosen_by == "one":
        asked = f"ASV{rule.settings.get('asv', 0)}"
        failing = f"{asked} has failed, {by} is the next that works"
        return f"{rule}: always {by}" if asked == by else f"{rule}: {failing}"
    carried = rows_where(result.tables["fixes"], broadcast_at_s=fix.broadcast_at_s)
    if chosen.chosen_by == "hearing":
        own = sum(by in asvs.split() for asvs in carried.asvs)
        return f"{rule}: it measured {own} of the {len(carried)}, no ASV more"
    goals = carried if not chosen.at_once else rows_where(carried, fix=fix.fix)
    means = {n: _mean_distance(result, n, fix.broadcast_at_s, goals) for n in able}
    if not chosen.at_once:
        words = ", ".join(f"ASV{n} {mean:.1f} m" for n, mean in means.items())
        return f"{rule}: mean distance to the fixes {words}"
    frames = rows_where(result.tables["broadcasts"], sent_at_s=fix.broadcast_at_s)
    others = sorted(set(frames.asv) - {by})
    verb = "send" if len(others) > 1 else "sends"
    beside = f"{', '.join(others)} {verb} at once" if others else "no other ASV sends now"
    nearest = f"{by} is the nearest to the fix, {min(means.values()):.1f} m from it"
    return f"{rule}: {nearest}; {beside}"


def _mean_distance(result: "Result", asv: int, time: float, fixes: Any) -> float:
    """Return the mean horizontal distance (m) of an ASV at time (s) to fixes."""
    away = fixes[["x_m", "y_m"]].to_numpy(float) - position_at(result, f"ASV{asv}", time)[:2]
    return float(np.hypot(*away.T).mean())


def latency(result: "Result", fix: Any) -> Iterator[LatencyPart]:
    """Yield the parts of the time from ping to delivery; they add up to the latency."""
    if result.scenario.protocol.asvs_ping:
        front, rest = fix.valid_at_s - fix.pinged_at_s, fix.delivered_at_s - fix.valid_at_s
        yield LatencyPart("way down: the ping's front reaches the AUV", front)
        yield LatencyPart("the ping's own length, until it is decoded", rest)
        return
    frame, made, protocol = carrier_of(result, fix), known_at(result, fix), result.scenario.protocol
    on_air = frame.sent_at_s + float(frame.airtime_s)
    until = "is heard by the first ASV" if protocol.replies else "has passed every ASV in range"
    yield LatencyPart(f"way up: the ping {until}", made - fix.pinged_at_s)
    yield LatencyPart("wait for the broadcast", frame.sent_at_s - made)
    yield LatencyPart("frame on the air", float(frame.airtime_s))
    sender = fix.broadcast_by if known(fix.get("came_in")) is None else frame.asv
    if (relay := relay_of(result, fix)) is not None:
        yield LatencyPart("turns of AUVs that forward it", relay.sent_at_s - on_air)
        yield LatencyPart("forwarded frame on the air", float(relay.airtime_s))
        on_air, sender = relay.sent_at_s + float(relay.airtime_s), fix.relayed_by
    load = int(frame.fixes), int(frame.named)
    handing = result.setup.slots.messages.delay(*load) if protocol.sends_frames else 0.0
    if handing:
        yield LatencyPart("modem hands it over", handing)
        on_air += handing
    if protocol.tick_rate_hz is None:
        yield LatencyPart("way down", fix.delivered_at_s - on_air)
        return
    auv, asv = (position_at(result, name, on_air) for name in (fix.auv, sender))
    travel = math.dist(auv, asv) / result.setup.sound_speed_m_per_s
    travel = min(travel, fix.delivered_at_s - on_air)
    yield LatencyPart("way down", travel)
    yield LatencyPart("rounded up to the clock's tick", fix.delivered_at_s - on_air - travel)
