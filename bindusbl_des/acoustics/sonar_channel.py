"""The channel `sonar`: whether a signal is decoded follows from its signal-to-noise ratio.

Frames of bits are lost with one wrong bit; over a flat bottom echoes of pings fade them and drown
others.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..scenario.channel_settings import PingSonar, Sonar, Sound
from .channel import SELDOM, Prospects, Receiver, Signals
from .echoes import Sea, blended, echoes, ways
from .propagation import PROSPECT
from .sonar_equation import REFERENCE_M, LinkBudget, Message, chance_decoded, threshold_db

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

    >>> from .sonar_equation import link_budget
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


MOST_REFLECTIONS = 3
WAYS = len(tuple(ways(MOST_REFLECTIONS)))

# What echoes make of a ping that they blend into, as of :data:`.rows.RECEPTION`; and for each way
# how much later (s) an echo of its own arrives, and how strong it is where it overlaps others.
ECHO = np.dtype(
    [
        ("late_s", "f8"),
        ("lowered", "f8"),
        ("later_s", "f8", (WAYS,)),
        ("sound", "f8", (WAYS,)),
    ]
)
Heard = tuple[Prospects, NDArray[np.void]]

# Signals that cancel with their echoes keep this share of their amplitude.
FAINTEST = 1e-3


@dataclass(frozen=True)
class EchoingSonar:
    """A sonar whose pings come straight and by way of surface and bottom.

    What comes within 1 / B of a ping adds up with it, by phase: it fades, and seems to come from
    elsewhere.  What comes later is a sound of its own, which drowns others.
    """

    settings: PingSonar
    sea: Sea
    plain: SonarChannel
    hears: Listener

    @property
    def receiver(self) -> Receiver:
        """What decides at its receivers."""
        return self.plain.receiver

    @property
    def audible_m(self) -> float:
        """How far (m) a signal drowns others, without its echoes."""
        return self.plain.audible_m

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal."""
        return self.heard(signals)[0]

    def heard(self, signals: Signals) -> Heard:
        """Return what becomes of each signal (n, m), and its echoes (n, m), :data:`ECHO`."""
        away = np.hypot(
            signals.auvs[:, None, 0] - signals.asvs[:, 0],
            signals.auvs[:, None, 1] - signals.asvs[:, 1],
        )
        depth = self.sea.depth_m
        source = np.clip(signals.auvs[:, None, 2], 0.0, depth)
        receiver = np.clip(signals.asvs[None, :, 2], self.settings.transducer_m, depth)
        found = echoes(
            self.sea, self.settings.frequency_khz, away, source, receiver, MOST_REFLECTIONS
        )
        straight = (receiver - source) / np.maximum(np.hypot(away, source - receiver), 1e-3)
        blend = blended(found, straight, self.settings.bandwidth_khz)
        apart = found.later_s * self.settings.bandwidth_khz * 1e3 >= 1.0
        snr = self.plain.prospects(signals)["snr_db"]
        faded = snr + 20.0 * np.log10(np.maximum(blend.amplitude, FAINTEST))
        each = snr + 20.0 * np.log10(np.maximum(np.abs(found.gain), FAINTEST))
        out = np.empty(away.shape, ECHO)
        pulse_s = 1e-3 / self.settings.bandwidth_khz  # a matched filter peaks within it
        out["late_s"] = np.clip(blend.later_s, -pulse_s, pulse_s)
        alone = apart.all(axis=0) | np.isnan(blend.later_s)
        out["lowered"] = np.where(alone, np.nan, straight - blend.from_above)
        out["later_s"] = np.moveaxis(found.later_s, 0, -1)
        out["sound"] = np.moveaxis(np.where(apart, self.hears.loud(each), 0.0), 0, -1)
        return self.hears.told(faded), out


def echoing_sonar(
    settings: PingSonar,
    budget: LinkBudget,
    message: Message,
    band_range_m: float,
    sound_speed_m_per_s: float,
) -> EchoingSonar:
    """Return the channel of pings over a flat bottom of sand; see :func:`.sonar_channel`."""
    assert settings.bottom_m is not None
    return EchoingSonar(
        settings,
        Sea(
            settings.bottom_m,
            sound_speed_m_per_s=sound_speed_m_per_s,
            surface_sd_m=settings.surface_sd_m,
        ),
        sonar_channel(settings, budget, message, band_range_m),
        listener(settings, budget, message, band_range_m),
    )
