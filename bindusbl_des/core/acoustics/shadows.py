"""Channels of a sea with land in it: what a path that land crosses carries is not even a sound.

A path is the straight line between where sender and listener are as a signal begins, as for ranges.
Where there is land every channel is asked, the disc as well, so that without any nothing is.
"""

from dataclasses import dataclass
from math import nan

import numpy as np

from ..geometry.land import Land
from .channel import PLAIN, AskedChannel, LevelledChannel, Prospects, Receiver, Signals
from .loss import LossTerms
from .propagation import PROSPECT, all_within


@dataclass(frozen=True)
class AskedDisc:
    """The disc: signals within their reach, slant or horizontal, are decoded unless they are lost
    by its `loss`.
    """

    loss: LossTerms
    slant: bool
    receiver: Receiver = PLAIN
    audible_m: float | None = None

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal (n, m), :data:`.propagation.PROSPECT`."""
        near = all_within(signals.auvs, signals.asvs, self.slant, signals.reach)
        lost, out = self.loss.over(signals.ranges.ravel()), np.zeros(near.shape, PROSPECT)
        out["sound"], out["snr_db"] = near, nan
        out["loss"] = np.where(near, lost.reshape(near.shape), 1.0)
        return out


@dataclass(frozen=True)
class Shadowed:
    """A channel of the open sea, to which `land` is added."""

    open_sea: AskedChannel
    land: Land

    @property
    def receiver(self) -> Receiver:
        """How receivers of this channel tell a signal from sounds that overlap it."""
        return self.open_sea.receiver

    @property
    def audible_m(self) -> float | None:
        """How far (m) a signal drowns others, where no land is between."""
        return self.open_sea.audible_m

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal (n, m); what makes no sound anyway is not blocked."""
        found = self.open_sea.prospects(signals)
        reaches = (found["loss"] < 1.0) | (found["sound"] > 0.0)
        blocked = reaches & self.land.crossed(signals.auvs, signals.asvs)
        for name, value in (("loss", 1.0), ("snr_db", nan), ("sound", 0.0), ("blocked", 1)):
            found[name][blocked] = value
        return found


class ShadowedLevels(Shadowed):
    """A channel with levels in a sea with land."""

    open_sea: LevelledChannel

    @property
    def source_level_db(self) -> float:
        """The source level (dB re 1 uPa at 1 m) of signals."""
        return self.open_sea.source_level_db

    def at_level(self, level_db: float) -> Shadowed:
        """Return the channel of signals that are sent at another level (dB)."""
        return Shadowed(self.open_sea.at_level(level_db), self.land)


def shadowed(channel: AskedChannel, land: Land) -> Shadowed:
    """Return a channel in a sea with land."""
    if isinstance(channel, LevelledChannel):
        return ShadowedLevels(channel, land)
    return Shadowed(channel, land)
