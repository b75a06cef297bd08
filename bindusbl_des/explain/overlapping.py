"""Frames: which of them overlapped where a fix was lost, and who heard nothing for what it sent."""

from typing import TYPE_CHECKING, Any

from ..acoustics.propagation import TOUCH
from ..results.round_timeline import pings_sent
from .numbers import rows_where

if TYPE_CHECKING:
    from ..results.result import Result


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
    if result.scenario.protocol.duplex == "per_band" or reception.outcome != "collided":
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
    return f"it sends a frame from {frame.sent_at_s:.4f} to {over:.4f} s (duplex per_node)"
