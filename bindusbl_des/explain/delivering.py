"""The way down: who broadcasts a fix and why, when it arrives, and what the AUV makes of it."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.plugins import is_plugin
from ..results.round_timeline import uplink_slots
from .chain import Part, Step
from .numbers import compared, place, rows_where

if TYPE_CHECKING:
    from ..results.result import Result

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# With these filters nothing but a fix changes the correction of dead reckoning.
UNCHANGING = ("fixed_gain", "dead_reckoning")


def known_at(result: "Result", fix: Any) -> float:
    """Return when the fleet knows a fix (s): once its ping has passed every ASV in range.

    Who replies directly knows it when the reply sets out.
    """
    if result.scenario.protocol.downlink == "direct_reply":
        return float(fix.broadcast_at_s)
    met = rows_where(result.tables["receptions"], ping=fix.ping)
    reached = met[met.outcome != "out_of_range"]
    return float(reached.arrived_at_s.max()) + result.scenario.acoustics.hf.ping_s


def fixing(result: "Result", fix: Any) -> Step:
    """Return the step at which receptions become a fix."""
    asvs = fix.asvs.split()
    why = "one measurement" if len(asvs) == 1 else f"{len(asvs)} measurements fused (MVLUE)"
    return Step(
        known_at(result, fix),
        f"Fix {fix.fix}",
        f"is made by {', '.join(asvs)}: x {fix.x_m:.2f} +- {fix.sd_x_m:.2f}, y {fix.y_m:.2f} +- "
        f"{fix.sd_y_m:.2f} m",
        f"{why}, {fix.error_m:.2f} m off the truth",
        {"fix": fix.fix, "asvs": asvs, "x_m": fix.x_m, "y_m": fix.y_m, "error_m": fix.error_m},
    )


def broadcasting(result: "Result", fix: Any) -> Step:
    """Return the step at which an ASV broadcasts a fix: why then, why this ASV, who is in range."""
    frames = result.tables["broadcasts"]
    frame = rows_where(frames, sent_at_s=fix.broadcast_at_s, asv=fix.broadcast_by).iloc[0]
    auv, asv = (place(result, name, fix.broadcast_at_s) for name in (fix.auv, fix.broadcast_by))
    away, limit = math.hypot(*(auv - asv)[:2]), result.scenario.acoustics.mf.range_m
    facts = {
        "waited_s": fix.broadcast_at_s - known_at(result, fix),
        "airtime_s": float(frame.airtime_s),
        "payload_bytes": int(frame.payload_bytes),
        "fixes": int(frame.fixes),
        "range_m": away,
        "limit_m": limit,
    }
    if result.scenario.protocol.downlink == "direct_reply":
        why = "direct_reply: the first ASV to decode a ping answers it at once; " + (
            "as the ping's front arrives (reply_at ping_front)"
            if result.scenario.protocol.reply_at == "ping_front"
            else "when the ping has arrived in full (reply_at ping_end)"
        )
        return Step(fix.broadcast_at_s, fix.broadcast_by, "answers it", why, facts)
    mf = result.scenario.acoustics.mf
    within = (away > limit) == (fix.outcome == "out_of_range")
    told = compared(away, limit) if within else "at the edge of the"
    why = (
        f"{_why_then(result, fix)}; {_why_it(result, fix, int(frame.name))}; "
        f"{frame.payload_bytes} B x 8 x {mf.overhead:g} / {mf.bit_rate_bps:g} bit/s = "
        f"{frame.airtime_s:.4f} s on the air; horizontal range of {fix.auv} {told} MF range"
    )
    number = "the fix alone" if frame.fixes == 1 else f"it among {frame.fixes} fixes"
    return Step(fix.broadcast_at_s, fix.broadcast_by, f"broadcasts {number}", why, facts)


def _why_then(result: "Result", fix: Any) -> str:
    """Tell what the fix has waited for."""
    policy = result.scenario.protocol.downlink
    if is_plugin(policy):
        return f"{policy.told}: the plug-in decided to broadcast now"
    slots = uplink_slots(result, fix["round"])
    slot = row_slot(result, fix) if policy == "pipelined_group" else len(slots) - 1
    ends = slots[slot].end
    which = "its slot" if policy == "pipelined_group" else "the last slot of its round"
    told = f"{policy}: {which} ended at {ends:.4f} s"
    if fix.broadcast_at_s - ends > 1e-9:
        told += " and the frame before it held the band until now"
    return told


def row_slot(result: "Result", fix: Any) -> int:
    """Return the slot in which the ping of a fix was sent."""
    return int(rows_where(result.tables["pings"], ping=fix.ping).slot.iloc[0])


def _why_it(result: "Result", fix: Any, number: int) -> str:
    """Tell by which rule this ASV broadcasts, `number` counting all frames before."""
    rule, count = result.scenario.protocol.broadcaster, result.scenario.asvs.count
    carried = rows_where(result.tables["fixes"], broadcast_at_s=fix.broadcast_at_s)
    if is_plugin(rule):
        return f"{rule.told}: the plug-in chose {fix.broadcast_by}"
    if rule == "rotate":
        return f"rotate: frame {number} is that of ASV {number} mod {count} = {number % count}"
    if rule == "random":
        return "random: drawn by lot"
    if rule == "fixed":
        return f"fixed: always {fix.broadcast_by}"
    if rule == "most_fixes":
        own = sum(fix.broadcast_by in asvs.split() for asvs in carried.asvs)
        return f"most_fixes: it measured {own} of the {len(carried)}, no ASV more"
    goals = carried[["x_m", "y_m"]].to_numpy(float)
    means = [
        float(np.hypot(*(goals - place(result, f"ASV{n}", fix.broadcast_at_s)[:2]).T).mean())
        for n in range(count)
    ]
    told = ", ".join(f"ASV{n} {mean:.1f} m" for n, mean in enumerate(means))
    return f"nearest: mean distance to the fixes {told}"


def arriving(result: "Result", fix: Any) -> Step:
    """Return the step at which the AUV has the fix and corrects its estimate."""
    before, after = errors_around(result, fix)
    told = ""
    if before is not None and after is not None:
        verb = "falls" if after <= before else "grows"
        told = f"; its error {verb} from {before:.2f} to {after:.2f} m"
    return Step(
        fix.delivered_at_s,
        fix.auv,
        f"has it {fix.latency_s:.4f} s after its ping{told}",
        f"innovation {fix.innovation_m:.2f} m against its estimate {_reference(result)}; "
        f"{_weighed(result, fix)}",
        {
            "latency_s": fix.latency_s, "innovation_m": fix.innovation_m,
            "nis": _known(fix.nis), "moved_m": _known(fix.correction_m),
            "error_before_m": before, "error_after_m": after,
        },
    )  # fmt: skip


def _known(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else value


def _reference(result: "Result") -> str:
    """Return in words with which estimate a fix is compared."""
    navigation = result.scenario.navigation
    if navigation.filter != "fixed_gain" or navigation.delay_compensation == "shift":
        return "of the instant at which the fix holds"
    return "of now, though it has gone on since the ping (delay_compensation none)"


def _weighed(result: "Result", fix: Any) -> str:
    """Return in words how the navigator weighed the fix."""
    navigation, moved, weight = (
        result.scenario.navigation,
        _known(fix.correction_m),
        _known(fix.nis),
    )
    if navigation.filter == "dead_reckoning":
        return "dead reckoning alone takes no fix in"
    if moved is None and weight is None:
        return "it comes too late for its place among fixes of later instants, and is left out"
    if moved is None:
        return f"refused: normalised, its square is {weight:.1f}, above {navigation.nis_gate:.2f}"
    moves = f"moves the estimate by {moved:.2f} m"
    if navigation.filter == "fixed_gain":
        return f"gain {navigation.gain:g} x {fix.innovation_m:.2f} m {moves}"
    if navigation.filter != "kalman":
        return f"{navigation.filter.told} {moves}"
    if weight is None:
        return f"by the covariances it {moves}"
    return f"normalised, its square is {weight:.2f}; by the covariances it {moves}"


def errors_around(result: "Result", fix: Any) -> tuple[float | None, float | None]:
    """Return the horizontal errors (m) just before and after a correction.

    The drift at that instant is interpolated between the rows of the track around it, the
    corrections before and after are the rows' own, carried there as they go on changing without a
    fix (a filter that has learnt a bias); none where another fix came between the rows.
    """
    track = rows_where(result.tables["tracks"], vehicle=fix.auv)
    times = track.time_s.to_numpy(float)
    last = int(np.searchsorted(times, fix.delivered_at_s, side="left")) - 1
    others = rows_where(result.tables["fixes"], auv=fix.auv).delivered_at_s.dropna()
    came = np.diff(np.searchsorted(np.sort(others), times, side="right"))  # from row to row
    if last < 0 or last + 1 >= len(times) or came[last] != 1:
        return None, None
    x, y = ("x_m", "y_m")
    imu = track[[f"imu_{x}", f"imu_{y}"]].to_numpy(float)
    drift = imu - track[[x, y]].to_numpy(float)
    corrections = track[[f"estimate_{x}", f"estimate_{y}"]].to_numpy(float) - imu
    share = (fix.delivered_at_s - times[last]) / (times[last + 1] - times[last])
    now = drift[last] + share * (drift[last + 1] - drift[last])
    rates = _rates(result, times, corrections, came, last)
    if rates is None:
        return None, None
    before, after = (
        float(np.hypot(*(now + corrections[row] + rate * (fix.delivered_at_s - times[row]))))
        for row, rate in zip((last, last + 1), rates, strict=True)
    )
    return before, after


def _rates(
    result: "Result", times: Floats, corrections: Floats, came: Ints, last: int
) -> tuple[Floats, Floats] | None:
    """Return how fast corrections (n, 2), m, change without a fix, before row `last` and after it.

    Each is the rate (m/s) in the nearest interval between rows in which no fix `came`; None where
    there is no such interval.
    """
    if result.scenario.navigation.filter in UNCHANGING:
        return np.zeros(2), np.zeros(2)
    quiet = np.flatnonzero(came == 0)
    before, after = quiet[quiet < last], quiet[quiet > last]
    if not (before.size and after.size):
        return None
    rates = np.diff(corrections, axis=0) / np.diff(times)[:, None]
    return rates[before[-1]], rates[after[0]]


def latency(result: "Result", fix: Any) -> Iterator[Part]:
    """Yield what the time from ping to delivery went into; the parts add up to the latency."""
    frames = result.tables["broadcasts"]
    frame = rows_where(frames, sent_at_s=fix.broadcast_at_s, asv=fix.broadcast_by).iloc[0]
    known = known_at(result, fix)
    on_air = fix.broadcast_at_s + float(frame.airtime_s)
    replies = result.scenario.protocol.downlink == "direct_reply"
    until = "is heard by the first ASV" if replies else "has passed every ASV in range"
    yield Part(f"way up: the ping {until}", known - fix.pinged_at_s)
    yield Part("wait for the broadcast", fix.broadcast_at_s - known)
    yield Part("frame on the air", float(frame.airtime_s))
    if result.scenario.protocol.tick_rate_hz is None:
        yield Part("way down", fix.delivered_at_s - on_air)
        return
    auv, asv = (place(result, name, on_air) for name in (fix.auv, fix.broadcast_by))
    travel = math.dist(auv, asv) / result.scenario.environment.sound_speed_m_per_s
    travel = min(travel, fix.delivered_at_s - on_air)
    yield Part("way down", travel)
    yield Part("rounded up to the clock's tick", fix.delivered_at_s - on_air - travel)
