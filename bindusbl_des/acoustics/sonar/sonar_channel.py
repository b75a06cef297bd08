"""The channel `sonar`: whether a signal is decoded follows from its signal-to-noise ratio."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...scenario.channel_settings import Sonar, Sound
from ..channel import SELDOM, Prospects, Receiver, Signals
from ..propagation import PROSPECT
from .budget import REFERENCE_M, LinkBudget
from .decoding import Message, chance_decoded, threshold_db

Floats = NDArray[np.float64]

# Where the chance of a decoding with many steps is worked out once (dB), to be looked up between:
# at 0.1 dB it is within 1e-3 of itself even without shadowing.
LOOKED_UP = np.linspace(-60.0, 80.0, 1401)

# Slant ranges (m) at which everything is worked out once, and between which it changes over from
# one to the next: levels are those of a range within 0.02 % of the true one.  Farther is as there.
FARTHEST = 1e6
RANGES = np.geomspace(REFERENCE_M, FARTHEST, 40_001)
CHANGES_OVER = np.sqrt(RANGES[1:] * RANGES[:-1])


@dataclass(frozen=True)
class Listener:
    """A receiver of messages of one kind, by their SNR.

    `threshold_db` is the SNR at which half of all are decoded, and `chances` those at LOOKED_UP
    (dB) by other ways than a threshold.
    """

    sonar: Sound
    message: Message
    threshold_db: float
    chances: Floats

    @property
    def faintest_db(self) -> float:
        """The least SNR (dB) with which signals drown others."""
        return self.threshold_db - self.sonar.interference_db

    def receiver(self, noise_db: float) -> Receiver:
        """Return what decides, in noise of a level (dB)."""
        capture = self.sonar.capture_db
        ratio = math.inf if capture is None else 10.0 ** (capture / 10.0)
        return Receiver(ratio, self.sonar.shadowing_sd_db, noise_db, self.threshold_db)

    def told(self, snr_db: Floats) -> Prospects:
        """Return what becomes of signals of an SNR (dB), of any shape."""
        if self.sonar.decoding == "threshold":
            chance = chance_decoded(self.sonar, snr_db, self.message, self.threshold_db)
        else:
            chance = np.interp(snr_db, LOOKED_UP, self.chances)
        told = np.empty(snr_db.shape, PROSPECT)
        told["loss"] = np.where(chance < SELDOM, 1.0, 1.0 - chance)
        told["snr_db"] = snr_db
        told["sound"] = self.loud(snr_db)
        return told

    def loud(self, snr_db: Floats) -> Floats:
        """Return how strong sounds of an SNR (dB) are, in units of the noise; 0 if too faint."""
        return np.where(snr_db >= self.faintest_db, 10.0 ** (snr_db / 10.0), 0.0)


def listener(sonar: Sound, budget: LinkBudget, message: Message, band_range_m: float) -> Listener:
    """Return the receiver of a band; where no threshold is given, half of all messages are decoded
    over the band's range (m).
    """
    if sonar.decoding == "threshold":
        threshold = threshold_db(sonar, budget, band_range_m)
        return Listener(sonar, message, threshold, np.empty(0))
    chances = chance_decoded(sonar, LOOKED_UP, message)
    return Listener(sonar, message, float(np.interp(0.5, chances, LOOKED_UP)), chances)


@dataclass(frozen=True)
class SonarChannel:
    """Signals are decoded as often as their SNR says; `told` is what becomes of them at RANGES."""

    told: Prospects
    receiver: Receiver
    audible_m: float

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal."""
        return self.told.take(CHANGES_OVER.searchsorted(signals.ranges))


@lru_cache(maxsize=16)
def sonar_channel(
    sonar: Sonar, budget: LinkBudget, message: Message, band_range_m: float
) -> SonarChannel:
    """Return the channel of a band on which messages of one kind are sent.

    `band_range_m` (m) is the protocol's range, at which every other message is decoded where no
    threshold is given.  Signals drown others as far as their SNR is above the threshold less
    `interference_db`.
    """
    hears = listener(sonar, budget, message, band_range_m)
    told = hears.told(budget.snr_db(RANGES))
    told.setflags(write=False)
    return SonarChannel(told, hears.receiver(budget.noise_db), reach_m(budget, hears.faintest_db))


def reach_m(budget: LinkBudget, snr_db: float) -> float:
    """Return the slant range (m) up to which signals have an SNR (dB), 0 if nowhere.

    >>> from .budget import link_budget
    >>> round(reach_m(link_budget(Sonar()), 15.0), 1)
    3239.5
    """
    near, far = math.log(REFERENCE_M), math.log(FARTHEST)
    if budget.snr_db(REFERENCE_M) < snr_db:
        return 0.0
    for _ in range(64):
        middle = (near + far) / 2.0
        if budget.snr_db(math.exp(middle)) >= snr_db:
            near = middle
        else:
            far = middle
    return math.exp(near)
