"""What overlapped: pings, calls and frames where one was lost, and who was deaf as it sent."""

import math
from typing import TYPE_CHECKING, Any

from ..acoustics.propagation import TOUCH
from ..results.round_timeline import pings_sent
from ..scenario.water import sound_speed_of
from .by_channel import audible
from .numbers import apart, place, rows_where

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
        (f"ping {it.ping} of {getattr(it, protocol.pinging)}", it.arrived_at_s)
        for it in others.itertuples()
    ]
    sounds += _calls_beside(result, reception)
    return [
        f"{what} at {time:.4f} s (overlap "
        f"{1e3 * (duration - abs(time - reception.arrived_at_s)):.1f} of {1e3 * duration:.1f} ms)"
        for what, time in sounds
    ]


def _calls_beside(result: "Result", reception: Any) -> list[tuple[str, float]]:
    """Return the calls that overlap a ping at its ASV, and when they began to be heard there."""
    pings, speed = result.tables["pings"], sound_speed_of(result.scenario)
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
    told = [
        f"the frame of {asv} from {its_begin:.4f} to {its_end:.4f} s"
        for asv, its_begin, its_end in zip(
            frames.asv[others], begins[others], ends[others], strict=True
        )
    ]
    told += _own_pings(result, fix.auv, begin, end)
    return f"at {fix.auv} from {begin:.4f} to {end:.4f} s, overlapped by {', '.join(told)}"


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
