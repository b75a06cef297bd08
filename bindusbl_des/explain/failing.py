"""What ASVs missed because they had failed, in words."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..protocol.slots import slots_of
from ..scenario.failing import failures_of
from .numbers import rows_where

if TYPE_CHECKING:
    from ..results.result import Result


def number_of(vehicle: str) -> int:
    """Return the number of a vehicle by its name.

    >>> number_of("ASV12")
    12
    """
    return int(vehicle[3:])


def failed(result: "Result", time: float) -> list[int]:
    """Return the ASVs that have failed by an instant (s) and do not work again, by number."""
    failures = failures_of(result.scenario)
    return [] if failures is None else list(failures.failed(time))


def had_failed(result: "Result", asv: str, time: float) -> str:
    """Tell that an ASV had failed by an instant (s); "" if it worked."""
    failures, number = failures_of(result.scenario), number_of(asv)
    if failures is None or number not in failures.failed(time):
        return ""
    earlier = (failures.whose == number) & (failures.begin_s <= time)
    return f"{asv} had failed at {failures.begin_s[earlier].max():g} s"


def failed_while(result: "Result", asv: str, begin: float, end: float, doing: str) -> str:
    """Tell that an ASV failed after an instant and before another (s), as it was `doing` something;
    "" if it did not.
    """
    failures = failures_of(result.scenario)
    when = np.inf if failures is None else failures.next_of(number_of(asv), begin)
    return f"{asv} failed at {when:g} s, while it {doing}" if when < end else ""


def frame_cut(result: "Result", fix: Any) -> str:
    """Tell that the ASV failed that was broadcasting a fix; "" if it did not."""
    if fix.broadcast_by is None or not result.scenario.protocol.sends_frames:
        return ""
    frames = result.tables["broadcasts"]
    frame = rows_where(frames, sent_at_s=fix.broadcast_at_s, asv=fix.broadcast_by).iloc[0]
    airtime = slots_of(result.scenario).messages.airtime(int(frame.fixes), int(frame.named))
    begin = float(fix.broadcast_at_s)
    if before := had_failed(result, fix.broadcast_by, begin):
        return f"{before}, before its turn to broadcast"
    return failed_while(result, fix.broadcast_by, begin, begin + airtime, "broadcast the frame")
