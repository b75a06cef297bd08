"""Channels: whether a signal on the HF band is decoded where nothing overlaps it.

The one that ships, `disc`, is compiled: nothing beyond a reach, and within it the loss of
:mod:`.loss`.  One's own answers for all signals that begin at one instant.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.plugins import PluginError, asked, shown
from ..scenario.families import CHANNEL
from ..scenario.part_settings import own_part
from ..scenario.scenario import Scenario
from .loss import contention_loss

Array = NDArray[np.float64]

# No channel but the disc is asked
DISC: Array = np.empty((0, 0))


@dataclass(frozen=True)
class Signals:
    """Signals that begin at an instant (s) between n AUVs and m ASVs: pings, or calls for them.

    Of the ping of an ASV (passive ranging) those of all ASVs are asked for, and its own taken.

    `auvs` (n, 3) and `asvs` (m, 3) are true places (m), `ranges` (n, m) the slant ranges (m) of
    that instant; `reach` (m) is the protocol's HF range, and `calling` tells whether the sound goes
    down, from ASVs to AUVs.
    """

    time: float
    auvs: Array
    asvs: Array
    ranges: Array
    reach: float
    calling: bool


class Channel(Protocol):
    """How likely signals are decoded."""

    def __call__(self, signals: Signals, /) -> Array:
        """Return the probability (n, m) that each is decoded if nothing overlaps it.

        Where it is 0 there is no sound either: the signal drowns no other.
        """


@dataclass(frozen=True)
class OwnChannel:
    """A channel of somebody's own: each of its answers is checked."""

    name: str
    chances: Channel

    def losses(self, signals: Signals) -> Array:
        """Return the probability (n, m) that each signal is lost.

        Raises:
            PluginError: when it raises anything, or what it returns are no probabilities.
        """
        when = f" at {signals.time:g} s"
        answer = asked(CHANNEL.key, self.name, self.chances, signals, when=when)
        found = asked(CHANNEL.key, self.name, np.asarray, answer, when=when)
        wanted = signals.ranges.shape
        plain = found.dtype.kind in "fiub" and found.shape == wanted
        if not plain or not ((found >= 0.0) & (found <= 1.0)).all():
            said = shown(CHANNEL.key, self.name, answer, when)
            raise PluginError(
                CHANNEL.key,
                f"{self.name!r} returned {said}{when}; it must be an array of probabilities in "
                f"[0, 1], {wanted[0]} AUVs by {wanted[1]} ASVs",
            )
        return 1.0 - found.astype(np.float64)


def channel_named(name: str) -> OwnChannel | None:
    """Return a channel by its name in the scenario; None for the compiled disc.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
    """
    return None if name in CHANNEL.siblings else OwnChannel(name, own_part(CHANNEL, name))


def contention_of(scenario: Scenario) -> float:
    """Return what AUVs that share the uplink add to the loss of a ping: none where none pings."""
    if scenario.protocol.is_passive:
        return 0.0
    return contention_loss(scenario.auvs.count, scenario.acoustics.loss.contention_per_auv)
