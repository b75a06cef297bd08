"""A channel by a curve of one's own: the share of signals that is decoded over each range."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scenario.channel_settings import Curve
from ..scenario.files.curve_file import read_curve
from .channel import PLAIN, Prospects, Receiver, Signals
from .propagation import PROSPECT

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CurveChannel:
    """Signals are decoded as often as a curve of delivery ratios over slant ranges (m) says.

    Between its points it is straight, before the first as there, and beyond the last 0.  Signals
    drown each other up to `audible_m`, whether or not they could be decoded.
    """

    ranges: Floats
    ratios: Floats
    audible_m: float
    receiver: Receiver = PLAIN

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal."""
        told = np.empty(signals.ranges.shape, PROSPECT)
        told["loss"] = 1.0 - np.interp(signals.ranges, self.ranges, self.ratios, right=0.0)
        told["snr_db"] = math.nan
        told["sound"] = signals.ranges <= self.audible_m
        return told


def curve_channel(settings: Curve) -> CurveChannel:
    """Return the channel of a curve in a file.

    Raises:
        ValueError: naming file, line and remedy, when it is no such curve.
    """
    ranges, ratios = read_curve(settings.file)
    farthest = max(settings.interference_m or 0.0, ranges[-1])
    return CurveChannel(np.array(ranges), np.array(ratios), farthest)
