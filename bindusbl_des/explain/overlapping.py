"""Frames at AUVs: which of them overlapped where a fix was lost."""

from typing import TYPE_CHECKING, Any

from ..acoustics.propagation import TOUCH
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
    return f"at {fix.auv} from {begin:.4f} to {end:.4f} s, overlapped by {', '.join(told)}"
