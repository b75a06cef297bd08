"""What overlapped: pings, calls and frames where one was lost, and who was deaf as it sent; where a
vessel that moves was going, as its track tells afterwards; and what ASVs missed that had failed.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..acoustics.propagation import TOUCH
from ..core.plugins import is_plugin
from ..results.round_timeline import pings_sent
from .chain import apart, frame_of, place, rows_where
from .losing import audible

if TYPE_CHECKING:
    from ..results.result import Result


def sounds_beside(result: "Result", reception: Any) -> list[str]:
    """Name the pings and calls that overlap a ping where it is heard, and by how much."""
    duration, protocol = result.scenario.acoustics.hf.ping_s, result.scenario.protocol
    here = protocol.listening
    met = rows_where(result.tables["receptions"], **{here: getattr(reception, here)})
    gap = (met.arrived_at_s - reception.arrived_at_s).abs()
    beside = (met.ping != reception.ping) & (gap < duration)
    others = met[beside & audible(result, met)]
    sounds = [
        (f"ping {row.ping} of {getattr(row, protocol.pinging)}", row.arrived_at_s)
        for row in others.itertuples()
    ]
    sounds += _calls_beside(result, reception)
    return [
        f"{what} at {time:.4f} s (overlap "
        f"{1e3 * (duration - abs(time - reception.arrived_at_s)):.1f} of {1e3 * duration:.1f} ms)"
        for what, time in sounds
    ]


def _calls_beside(result: "Result", reception: Any) -> list[tuple[str, float]]:
    """Return the calls that overlap a ping at its ASV, and when they began to be heard there."""
    pings, speed = result.tables["pings"], result.setup.sound_speed_m_per_s
    if "called_by" not in pings:
        return []
    hf = result.scenario.acoustics.hf
    near = (pings.called_at_s - reception.arrived_at_s).abs() < hf.ping_s + hf.range_m / speed
    found = []
    for call in pings[near].drop_duplicates(["called_at_s", "called_by"]).itertuples():
        here = place(result, call.called_by, call.called_at_s)
        there = place(result, reception.asv, call.called_at_s)
        heard_at = call.called_at_s + math.dist(here, there) / speed
        overlaps = abs(heard_at - reception.arrived_at_s) < hf.ping_s
        if overlaps and apart(hf, here, there) <= hf.range_m:
            found.append((f"the call of {call.called_by}", heard_at))
    return found


def overlapped(result: "Result", fix: Any) -> str:
    """Tell which frames overlapped, at its AUV, the one that carried a fix; "" if none did.

    They are there from when their front came, for their airtime: how far vehicles move meanwhile
    is left out.
    """
    if fix.outcome != "collided":
        return ""
    met = rows_where(result.tables["frame_receptions"], auv=fix.auv)
    met = met[(met.outcome != "out_of_range") & met.arrived_at_s.notna()]
    frames = result.tables["broadcasts"].loc[met.broadcast]
    begins = met.arrived_at_s.to_numpy()
    ends = begins + frames.airtime_s.to_numpy()
    own = ((frames.sent_at_s == fix.broadcast_at_s) & (frames.asv == fix.broadcast_by)).to_numpy()
    begin, end = begins[own][0], ends[own][0]
    others = ~own & (begins < end - TOUCH) & (ends > begin + TOUCH)
    words = [
        f"the frame of {asv} from {its_begin:.4f} to {its_end:.4f} s"
        for asv, its_begin, its_end in zip(
            frames.asv[others], begins[others], ends[others], strict=True
        )
    ]
    words += _own_pings(result, fix.auv, begin, end)
    return f"at {fix.auv} from {begin:.4f} to {end:.4f} s, overlapped by {', '.join(words)}"


def _own_pings(result: "Result", auv: str, begin: float, end: float) -> list[str]:
    """Name the pings that an AUV sends between two instants (s), if it is deaf meanwhile."""
    if result.scenario.protocol.duplex == "per_band":
        return []
    pings, lasts = pings_sent(result), result.scenario.acoustics.hf.ping_s
    during = (pings.auv == auv) & (pings.sent_at_s < end) & (pings.sent_at_s + lasts > begin)
    return [f"its own ping at {at:.4f} s (duplex per_node)" for at in pings.sent_at_s[during]]


def deafened(result: "Result", reception: Any) -> str:
    """Tell which frame an ASV was sending while a ping came, so that it was deaf; "" if none."""
    protocol = result.scenario.protocol
    if not protocol.deafens_asvs or reception.outcome != "collided":
        return ""
    begin, frames = (
        reception.arrived_at_s,
        rows_where(result.tables["broadcasts"], asv=reception.asv),
    )
    end = begin + result.scenario.acoustics.hf.ping_s
    during = frames[(frames.sent_at_s < end) & (frames.sent_at_s + frames.airtime_s > begin)]
    if not len(during):
        return ""
    frame = during.iloc[0]
    over = frame.sent_at_s + frame.airtime_s
    why = "direct_reply" if protocol.replies else "duplex per_node"
    return f"it sends a frame from {frame.sent_at_s:.4f} to {over:.4f} s ({why})"


# A vessel slower than this (m/s) rests; one that turns by less (rad) goes straight on.
RESTS, STRAIGHT = 1e-3, 1e-3


def on_its_way(result: "Result", vessel: str, time: float) -> str:
    """Return where a vessel was going at an instant (s), and how fast; "" where it did not move.

    It goes straight until it turns or rests: there it was bound for, as near as the rows of its
    track tell.
    """
    formation = result.scenario.asvs.formation
    if not formation.moves and not is_plugin(formation.choice):
        return ""
    track = rows_where(result.tables["tracks"], vehicle=vessel)
    times, x, y = (track[name].to_numpy(float) for name in ("time_s", "x_m", "y_m"))
    steps, lasts = np.diff(x) + 1j * np.diff(y), np.diff(times)
    now = max(int(np.searchsorted(times, time, side="right")) - 1, 0)
    if now >= len(lasts) or abs(steps[now]) < RESTS * lasts[now]:
        return ""
    same = np.abs(np.angle(steps[now:] / steps[now])) < STRAIGHT
    same &= np.abs(steps[now:]) >= RESTS * lasts[now:]
    end = now + (int(same.argmin()) if not same.all() else len(same))
    speed = (np.abs(steps[now:end]) / lasts[now:end]).max()
    return f"; {vessel} was on its way to x {x[end]:.0f}, y {y[end]:.0f} m at {speed:.2g} m/s"


def number_of(vehicle: str) -> int:
    """Return the number of a vehicle by its name.

    >>> number_of("ASV12")
    12
    """
    return int(vehicle[3:])


def failed(result: "Result", time: float) -> list[int]:
    """Return the ASVs that have failed by an instant (s) and do not work again, by number."""
    failures = result.setup.failures
    return [] if failures is None else list(failures.failed(time))


def had_failed(result: "Result", asv: str, time: float) -> str:
    """Tell that an ASV had failed by an instant (s); "" if it worked."""
    failures, number = result.setup.failures, number_of(asv)
    if failures is None or number not in failures.failed(time):
        return ""
    earlier = (failures.whose == number) & (failures.begin_s <= time)
    return f"{asv} had failed at {failures.begin_s[earlier].max():g} s"


def failed_while(result: "Result", asv: str, begin: float, end: float, doing: str) -> str:
    """Tell that an ASV failed after an instant and before another (s), as it was `doing` something;
    "" if it did not.
    """
    failures = result.setup.failures
    when = np.inf if failures is None else failures.next_of(number_of(asv), begin)
    return f"{asv} failed at {when:g} s, while it {doing}" if when < end else ""


def frame_cut(result: "Result", fix: Any) -> str:
    """Tell that the ASV failed that was broadcasting a fix; "" if it did not."""
    if fix.broadcast_by is None or not result.scenario.protocol.sends_frames:
        return ""
    frame = frame_of(result, fix)
    airtime = result.setup.slots.messages.airtime(int(frame.fixes), int(frame.named))
    begin = float(fix.broadcast_at_s)
    if before := had_failed(result, fix.broadcast_by, begin):
        return f"{before}, before its turn to broadcast"
    return failed_while(result, fix.broadcast_by, begin, begin + airtime, "broadcast the frame")
