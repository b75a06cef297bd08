"""The channel `curve`: the decoding chance follows a curve over range in a file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...core.scenario.families import ChannelTraits, Lossy
from ...core.scenario.key_types import Real, Text, key
from ...core.scenario.measured import read_curve

if TYPE_CHECKING:
    from ...core.acoustics.asking import Asking
    from ...core.acoustics.channel import Prospects, Receiver, Signals
    from ...support.arrays import Floats


class Curve(Lossy):
    """Settings of the channel `curve`."""

    file: Text = key(
        ...,
        "",
        "CSV with columns range_m (slant) and delivery_ratio; relative to the scenario file",
    )
    interference_m: Real | None = key(
        None,
        "m",
        "distance up to which signals interfere with others; null = to the last range of the file",
        ge=0,
        le=1e6,
    )


@dataclass(frozen=True)
class CurveChannel:
    """Channel whose decoding chance is a curve of delivery ratios over slant ranges (m).

    It is linear between points, constant before the first, and 0 beyond the last.  Signals drown
    each other up to `audible_m`, whether or not they could be decoded.
    """

    ranges: Floats
    ratios: Floats
    audible_m: float
    receiver: Receiver

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal."""
        import numpy as np

        from ...core.acoustics.propagation import PROSPECT

        out = np.zeros(signals.ranges.shape, PROSPECT)
        out["loss"] = 1.0 - np.interp(signals.ranges, self.ranges, self.ratios, right=0.0)
        out["snr_db"], out["late_s"] = math.nan, 0.0
        out["sound"] = signals.ranges <= self.audible_m
        return out


@ChannelTraits(settings=Curve, frame_settings=Curve, reach_of_its_own=True)
def curve(asking: Asking, *, settings: Curve) -> CurveChannel:
    """Return the channel of a curve in a file.

    Raises:
        ValueError: naming file, line and remedy, when it is not such a curve.
    """
    import numpy as np

    from ...core.acoustics.channel import PLAIN

    ranges, ratios, _ = read_curve(settings.file)
    farthest = max(settings.interference_m or 0.0, ranges[-1])
    return CurveChannel(np.array(ranges), np.array(ratios), farthest, PLAIN)
