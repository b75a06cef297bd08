"""The channel `sonar`: whether a signal is decoded follows from its signal-to-noise ratio."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

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

# Sound from farther (m) is that from here: nothing in a scenario is farther off.
FARTHEST = 1e7


@dataclass(frozen=True)
class SonarChannel:
    """Signals are decoded as often as their SNR says, and drown others down to `faintest_db`.

    `decoded` turns mean SNRs (dB) into probabilities.
    """

    budget: LinkBudget
    decoded: Callable[[Floats], Floats]
    faintest_db: float
    receiver: Receiver
    audible_m: float

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal."""
        snr = self.budget.snr_db(signals.ranges)
        chance = self.decoded(snr)
        told = np.empty(snr.shape, PROSPECT)
        told["loss"] = np.where(chance < SELDOM, 1.0, 1.0 - chance)
        told["snr_db"] = snr
        told["sound"] = np.where(snr >= self.faintest_db, 10.0 ** (snr / 10.0), 0.0)
        return told


def sonar_channel(
    sonar: Sonar, budget: LinkBudget, message: Message, band_range_m: float
) -> SonarChannel:
    """Return the channel of a band on which messages of one kind are sent.

    `band_range_m` (m) is the protocol's range, at which every other message is decoded where no
    threshold is given.
    """
    if sonar.decoding == "threshold":
        threshold = threshold_db(sonar, budget, band_range_m)
        decoded = partial(_over_threshold, sonar, message, threshold)
    else:
        chances = _chances(sonar, message)
        threshold = float(np.interp(0.5, chances, LOOKED_UP))
        decoded = partial(np.interp, xp=LOOKED_UP, fp=chances)
    faintest = threshold - sonar.interference_db
    capture = math.inf if sonar.capture_db is None else 10.0 ** (sonar.capture_db / 10.0)
    return SonarChannel(
        budget,
        decoded,
        faintest,
        Receiver(capture, sonar.shadowing_sd_db, budget.noise_db, threshold),
        reach_m(budget, faintest),
    )


def _over_threshold(sonar: Sonar, message: Message, threshold: float, snr_db: Floats) -> Floats:
    return chance_decoded(sonar, snr_db, message, threshold)


@lru_cache(maxsize=64)
def _chances(sonar: Sonar, message: Message) -> Floats:
    return chance_decoded(sonar, LOOKED_UP, message)


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
