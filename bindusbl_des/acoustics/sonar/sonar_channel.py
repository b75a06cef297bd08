"""The channel `sonar`: whether a signal is decoded follows from its signal-to-noise ratio."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...scenario.channel_settings import Sonar
from ..channel import PROSPECT, SELDOM, Prospects, Receiver, Signals
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
    snr = budget.snr_db(RANGES)
    if sonar.decoding == "threshold":
        threshold = threshold_db(sonar, budget, band_range_m)
        chance = chance_decoded(sonar, snr, message, threshold)
    else:
        chances = chance_decoded(sonar, LOOKED_UP, message)
        threshold = float(np.interp(0.5, chances, LOOKED_UP))
        chance = np.interp(snr, LOOKED_UP, chances)
    faintest = threshold - sonar.interference_db
    told = np.empty(len(RANGES), PROSPECT)
    told["loss"] = np.where(chance < SELDOM, 1.0, 1.0 - chance)
    told["snr_db"] = snr
    told["sound"] = np.where(snr >= faintest, 10.0 ** (snr / 10.0), 0.0)
    told.setflags(write=False)
    capture = math.inf if sonar.capture_db is None else 10.0 ** (sonar.capture_db / 10.0)
    receiver = Receiver(capture, sonar.shadowing_sd_db, budget.noise_db, threshold)
    return SonarChannel(told, receiver, reach_m(budget, faintest))


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
