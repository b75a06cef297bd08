"""The channel `sonar` over a flat bottom: what echoes of pings do to them, and to others."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scenario.channel_settings import PingSonar
from ..channel import Prospects, Receiver, Signals
from ..echoes import Sea, blended, echoes, ways
from .budget import LinkBudget
from .decoding import Message
from .sonar_channel import Listener, SonarChannel, listener, sonar_channel

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
