"""Channels: whether a signal is decoded where nothing overlaps it, and what it drowns.

The default, `disc`, is compiled: nothing beyond a reach, and within it the loss of :mod:`.loss`.
All others are asked, in numpy, for all signals that begin at one instant.
"""

from dataclasses import dataclass
from math import inf, nan
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Floats
from ..core.plugins import Family, PluginError, asked, shown
from ..scenario.part_choice import own_part
from .loss import LossTerms
from .propagation import DISC, PROSPECT, SignalBand, SignalPath

Prospects = NDArray[np.void]
Value = TypeVar("Value", float, Floats)

# Signals that are decoded more seldom are out of range.
SELDOM = 1e-6


class Receiver(NamedTuple):
    """What decides at a receiver, and what its levels are counted from.

    A signal is destroyed by others that overlap it unless its intensity is `capture` times that of
    noise and all of them together; infinite: by any.  What has an SNR varies from signal to signal
    by `shadowing_sd_db`.  Levels are in dB: `noise_db` that of the noise in the band, re 1 uPa, and
    `threshold_db` the SNR at which a signal is as often lost as decoded; NaN where they are none.
    """

    capture: float = inf
    shadowing_sd_db: float = 0.0
    noise_db: float = nan
    threshold_db: float = nan

    def levels(self, snr_db: Value) -> dict[str, Value]:
        """Return what is told of signals that have an SNR (dB): that, their level and margin."""
        level, margin = snr_db + self.noise_db, snr_db - self.threshold_db
        return {"snr_db": snr_db, "level_db": level, "margin_db": margin}


PLAIN = Receiver()

# What stands for the compiled loss where another channel is asked
NO_LOSS = LossTerms(np.zeros(5), 0, 0.0, 1.0)

# Adds up three axes: quicker than `sum` for the few signals of a slot
AXES = np.ones(3)


@dataclass(frozen=True)
class Signals:
    """Signals that begin at an instant (s) between n AUVs and m ASVs: pings, or calls for them.

    Of the ping of an ASV (passive ranging) those of all ASVs are asked for, and its own taken; of a
    frame on the MF band those of the one ASV that sends it.

    `auvs` (n, 3) and `asvs` (m, 3) are true places (m), `ranges` (n, m) the slant ranges (m) of
    that instant; `reach` (m) is the protocol's range, and `calling` tells whether the sound goes
    down, from ASVs to AUVs.
    """

    time: float
    auvs: Floats
    asvs: Floats
    ranges: Floats
    reach: float
    calling: bool


def between(time: float, auvs: Floats, asvs: Floats, reach: float, calling: bool) -> Signals:
    """Return the signals of an instant (s) between places of AUVs (n, 3) and of ASVs (m, 3), m."""
    apart = auvs[:, None] - asvs
    ranges = np.sqrt((apart * apart) @ AXES)
    return Signals(time, auvs, asvs, ranges, reach, calling)


class Channel(Protocol):
    """How likely signals are decoded: what one's own channel answers."""

    def __call__(self, signals: Signals, /) -> Floats:
        """Return the probability (n, m) that each is decoded if nothing overlaps it.

        Where it is 0 there is no sound either: the signal drowns no other.
        """


class AskedChannel(Protocol):
    """A channel that is asked for the signals of an instant: any but the disc."""

    @property
    def receiver(self) -> Receiver:
        """What decides at its receivers."""

    @property
    def audible_m(self) -> float | None:
        """How far (m) a signal drowns others; None: as far as it may be decoded."""

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal (n, m), :data:`PROSPECT`."""


@dataclass(frozen=True)
class OwnChannel:
    """A channel of somebody's own: each of its answers is checked."""

    key: str
    name: str
    chances: Channel
    receiver: Receiver = PLAIN
    audible_m: float | None = None

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal: who is not heard drowns nobody.

        Raises:
            PluginError: when it raises anything, or what it returns are no probabilities.
        """
        when = f" at {signals.time:g} s"
        answer = asked(self.key, self.name, self.chances, signals, when=when)
        found = asked(self.key, self.name, np.asarray, answer, when=when)
        wanted = signals.ranges.shape
        plain = found.dtype.kind in "fiub" and found.shape == wanted
        if not plain or not ((found >= 0.0) & (found <= 1.0)).all():
            said = shown(self.key, self.name, answer, when)
            raise PluginError(
                self.key,
                f"{self.name!r} returned {said}{when}; it must be an array of probabilities in "
                f"[0, 1], {wanted[0]} AUVs by {wanted[1]} ASVs",
            )
        drawn = np.empty(wanted, PROSPECT)
        drawn["loss"] = 1.0 - found.astype(np.float64)
        drawn["snr_db"], drawn["sound"], drawn["late_s"] = nan, found > 0, 0.0
        return drawn


def own_channel(family: Family, choice: str) -> OwnChannel:
    """Return a channel of somebody's own.

    Raises:
        PluginError: when it is not allowed, or cannot be loaded or called.
    """
    return OwnChannel(family.key, choice, own_part(family, choice))


class Deciding(NamedTuple):
    """What decides on a band: the channel that is asked, if any is, what receivers make of sounds,
    and what is known of their way before anybody is asked.
    """

    channel: AskedChannel | None
    receiver: Receiver
    way: SignalPath


def deciding(channel: LossTerms | AskedChannel, band: SignalBand) -> Deciding:
    """Return what decides on a band: the compiled disc with its loss, or a channel that is asked.

    The band of the way has the reach that sounds have.
    """
    if isinstance(channel, LossTerms):
        return Deciding(None, PLAIN, SignalPath(band, channel, DISC))
    audible = channel.audible_m
    air = band if audible is None else band._replace(reach=audible)
    return Deciding(channel, channel.receiver, SignalPath(air, NO_LOSS, DISC))
