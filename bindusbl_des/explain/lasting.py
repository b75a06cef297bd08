"""How long a signal had been lost already: losses that come in bursts (`burst_s` of a channel)."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..acoustics.bursts import PAIR, lost_since, pair_keys
from ..acoustics.channel import between
from ..acoustics.named_channels import mf_channel
from ..core.plugins import is_plugin
from ..core.streams import Purpose, Streams
from ..core.wording import plain
from ..scenario.channel_settings import burst_s
from ..scenario.part_choice import PartChoice
from .numbers import place, rows_where

if TYPE_CHECKING:
    from ..results.result import Result


def ping_lasting(result: "Result", reception: Any, loss: float | None) -> str:
    """Tell since when pings of a pair were lost as one arrived that was, with its probability of
    that, None where nobody knows it; "" where each is lost by itself.
    """
    channel = result.scenario.acoustics.hf.channel
    time = float(reception.arrived_at_s)
    return _told(result, channel, Purpose.BURST, (reception.auv, reception.asv), time, loss)


def frame_lasting(result: "Result", fix: Any) -> str:
    """Tell since when frames of a pair were lost as one began that was, with a fix; "" where each
    is lost by itself.
    """
    channel, time = result.scenario.acoustics.mf.channel, float(fix.broadcast_at_s)
    if burst_s(channel) is None:
        return ""
    vehicles = fix.auv, fix.broadcast_by
    loss = None if is_plugin(channel) else _frame_loss(result, fix)
    return _told(result, channel, Purpose.FRAME_BURST, vehicles, time, loss)


def _frame_loss(result: "Result", fix: Any) -> float:
    """Return how likely the frame of a fix was lost, from where both are in the tables."""
    channel_of, time = mf_channel(result.scenario), float(fix.broadcast_at_s)
    assert channel_of is not None
    frames = rows_where(result.tables["broadcasts"], sent_at_s=time, asv=fix.broadcast_by)
    auv, asv = (place(result, name, time)[None, :3] for name in (fix.auv, fix.broadcast_by))
    signals = between(time, auv, asv, result.scenario.acoustics.mf.range_m, calling=True)
    frame: Any = frames.iloc[0]
    channel = channel_of(int(frame.payload_bytes), float(frame.airtime_s))
    return float(channel.prospects(signals)["loss"][0, 0])


def lasting(channel: PartChoice) -> str:
    """Tell how long losses of a channel last; "" where each signal is lost by itself."""
    mean_s = burst_s(channel)
    return "" if mean_s is None else f"losses last {plain(mean_s)} s on average (burst_s)"


def _told(
    result: "Result",
    channel: PartChoice,
    purpose: Purpose,
    vehicles: tuple[str, str],
    time: float,
    loss: float | None,
) -> str:
    mean_s, words = burst_s(channel), lasting(channel)
    if mean_s is None:
        return ""
    auv, asv = (int(name[3:]) for name in vehicles)
    key = pair_keys(Streams(result.seed), purpose, auv, asv + 1)[asv]
    pair = np.array([(key, mean_s)], dtype=PAIR)[0]
    since = math.nan if loss is None else lost_since(pair, time, loss)
    if math.isnan(since):
        return words
    begun = "the start" if since == 0.0 else f"{since:.2f} s"
    return f"{words}, and this pair had lost its signals since {begun}"
