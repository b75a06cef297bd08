"""The channel `sonar`: the sonar equation, with echoes of surface and bottom that meet a ping.

A flat sea of constant depth and one speed of sound; each echo comes from an image of its source.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...support.arrays import Floats
from ..vehicles.bottom import UNKNOWN, Bottom
from .channel import SELDOM, Prospects, Receiver, Signals
from .propagation import PROSPECT
from .sonar_equation import REFERENCE_M, LinkBudget, SoundMessage, chance_decoded, threshold_db
from .sound_settings import OfBathymetry, PingSonar, Sonar, Sound

Complex = NDArray[np.complex128]


class Sea(NamedTuple):
    """A sea for echoes, flat for each of them: its depth (m), its water (kg/m3, m/s), the bottom's
    sediment (kg/m3, m/s), and the standard deviation of the surface's height (m).

    The sediment is a fluid without loss; the default is sand.
    """

    depth_m: float | Floats
    density_kg_per_m3: float = 1025.0
    sound_speed_m_per_s: float = 1500.0
    bottom_density_kg_per_m3: float = 1900.0
    bottom_speed_m_per_s: float = 1650.0
    surface_sd_m: float = 0.0


class EchoPath(NamedTuple):
    """The path of an echo: its reflections, such as SB for surface, then bottom.

    Its vertical extent is 2 `depths` H + `source` zs + `receiver` zr, with the depths of sea,
    source and receiver.
    """

    name: str
    depths: int
    source: int
    receiver: int


def ways(most_reflections: int) -> Iterator[EchoPath]:
    """Yield the paths of all echoes with up to so many reflections, fewest first.

    >>> [way.name for way in ways(3)]
    ['S', 'B', 'SB', 'BS', 'SBS', 'BSB']
    """
    for count in range(1, most_reflections + 1):
        for first in "SB":
            name = "".join("SB"[("SB".index(first) + n) % 2] for n in range(count))
            up, down = (1 if first == "S" else -1), (1 if name[-1] == "S" else -1)
            yield EchoPath(name, name.count("B"), up, down)


class Echoes(NamedTuple):
    """Echoes beside the direct sound, one for each of `ways` along the first axis.

    How much later (s) they arrive; their complex amplitude relative to the direct sound, with the
    phases of surface and bottom; and the sine of the elevation from which they arrive, positive
    from above.
    """

    ways: tuple[EchoPath, ...]
    later_s: Floats
    gain: Complex
    from_above: Floats


def echoes(
    sea: Sea,
    frequency_khz: float,
    range_m: ArrayLike,
    source_depth_m: ArrayLike,
    receiver_depth_m: ArrayLike,
    most_reflections: int = 3,
) -> Echoes:
    """Return the echoes over horizontal ranges (m) between two depths (m), arrays of one shape.

    Sound spreads spherically along the straight paths of images.  The surface inverts the phase
    and, if rough, scatters: -exp(-2 (k sd sin g)^2) at a grazing angle g; the bottom reflects as
    :func:`bottom_reflection`.  Raises ValueError for depths outside the sea.  Source: F. B. Jensen
    et al., Computational Ocean Acoustics (2011), 2.4; L. M. Brekhovskikh, Yu. P. Lysanov,
    Fundamentals of Ocean Acoustics (2003), 9.
    """
    away, source, receiver = np.broadcast_arrays(
        *(np.asarray(value, dtype=float) for value in (range_m, source_depth_m, receiver_depth_m))
    )
    if not all(((depth >= 0.0) & (depth <= sea.depth_m)).all() for depth in (source, receiver)):
        raise ValueError(f"depths must lie in the sea, between 0 and {np.max(sea.depth_m):g} m")
    taken = tuple(ways(most_reflections))
    upright = np.array(
        [
            2 * way.depths * sea.depth_m + way.source * source + way.receiver * receiver
            for way in taken
        ]
    )
    straight = np.hypot(away, source - receiver)
    lengths = np.hypot(away, upright)
    grazing = np.arctan2(upright, away)
    surface = _surface(sea, frequency_khz, grazing)
    bottom = bottom_reflection(sea, grazing)
    counts = [(way.name.count("S"), way.name.count("B")) for way in taken]
    reflected = np.array(
        [surface[n] ** up * bottom[n] ** down for n, (up, down) in enumerate(counts)]
    )
    wave = 2.0 * math.pi * frequency_khz * 1e3 / sea.sound_speed_m_per_s
    phase = np.exp(1j * wave * (lengths - straight))
    above = np.array([way.receiver for way in taken]).reshape(-1, *np.ones(away.ndim, dtype=int))
    return Echoes(
        taken,
        (lengths - straight) / sea.sound_speed_m_per_s,
        reflected * straight / lengths * phase,
        above * upright / lengths,
    )


def bottom_reflection(sea: Sea, grazing_rad: ArrayLike) -> Complex:
    """Return the Rayleigh reflection coefficient of the bottom at grazing angles (rad).

    Below the critical angle reflection is total, with a phase shift.  Source: F. B. Jensen et al.,
    Computational Ocean Acoustics (2011), eq. 1.57.

    >>> round(float(bottom_reflection(Sea(30.0), math.pi / 2).real), 6)
    0.341894
    """
    grazing = np.asarray(grazing_rad, dtype=float)
    denser = sea.bottom_density_kg_per_m3 / sea.density_kg_per_m3
    index = sea.sound_speed_m_per_s / sea.bottom_speed_m_per_s
    # what is under the root is negative below the critical angle, where the wave decays downwards
    below = np.sqrt(index**2 - np.cos(grazing) ** 2 + 0j)
    steep = denser * np.sin(grazing)
    return np.asarray((steep - below) / (steep + below))


def _surface(sea: Sea, frequency_khz: float, grazing: Floats) -> Floats:
    wave = 2.0 * math.pi * frequency_khz * 1e3 / sea.sound_speed_m_per_s
    return np.asarray(-np.exp(-2.0 * (wave * sea.surface_sd_m * np.sin(grazing)) ** 2))


class Blend(NamedTuple):
    """A ping and the echoes that a receiver cannot separate from it: how much later (s) it seems to
    arrive, its amplitude relative to the direct sound, and the sine of the elevation from which it
    seems to come.
    """

    later_s: Floats
    amplitude: Floats
    from_above: Floats


def blended(found: Echoes, straight_from_above: ArrayLike, bandwidth_khz: float) -> Blend:
    """Return what a matched filter sees of pings with echoes that come within 1 / B of them.

    The compressed pulse is a triangle of 1 / B on each side; that much of an echo adds to the ping,
    by phase.  Delay and direction are the sum's local slowness, Re(sum a x / sum a), which small
    arrays measure.  Where echo and ping cancel, it is far from either: an outlier.
    `straight_from_above` is the sine of the elevation from which the direct sound comes.
    """
    direct = np.asarray(straight_from_above, dtype=float)
    overlap = np.maximum(1.0 - found.later_s * bandwidth_khz * 1e3, 0.0)
    weights = found.gain * overlap
    total = 1.0 + weights.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        later = ((weights * found.later_s).sum(axis=0) / total).real
        above = ((direct + (weights * found.from_above).sum(axis=0)) / total).real
    return Blend(np.asarray(later), np.abs(total), np.asarray(above))


# The channel `sonar`: whether a signal is decoded follows from its signal-to-noise ratio.
#
# Frames of bits are lost with one wrong bit; over a flat bottom echoes of pings fade them and
# drown others.


# SNRs (dB) at which a costly decoding chance is tabulated: steps of 0.1 dB keep it within 1e-3 even
# without shadowing.
LOOKED_UP = np.linspace(-60.0, 80.0, 1401)

# Slant ranges (m) at which prospects are tabulated, and the limits between them: a range is rounded
# by at most 0.02 %.  Beyond the last, its values hold.
FARTHEST = 1e6
RANGES = np.geomspace(REFERENCE_M, FARTHEST, 40_001)
CHANGES_OVER = np.sqrt(RANGES[1:] * RANGES[:-1])


@dataclass(frozen=True)
class Listener:
    """A receiver of messages of one kind, by their SNR.

    Half of all messages are decoded at `threshold_db`; `chances` are the decoding chances at
    LOOKED_UP (dB), for decodings other than a threshold.
    """

    sonar: Sound
    message: SoundMessage
    threshold_db: float
    chances: Floats

    @property
    def faintest_db(self) -> float:
        """The least SNR (dB) at which signals drown others."""
        return self.threshold_db - self.sonar.interference_db

    def receiver(self, noise_db: float) -> Receiver:
        """Return the receiver, in noise of a level (dB)."""
        capture = self.sonar.capture_db
        ratio = math.inf if capture is None else 10.0 ** (capture / 10.0)
        return Receiver(ratio, self.sonar.shadowing_sd_db, noise_db, self.threshold_db)

    def prospects_at(self, snr_db: Floats) -> Prospects:
        """Return the prospects of signals by SNR (dB), in the same shape."""
        if self.sonar.decoding == "threshold":
            chance = chance_decoded(self.sonar, snr_db, self.message, self.threshold_db)
        else:
            chance = np.interp(snr_db, LOOKED_UP, self.chances)
        out = np.zeros(snr_db.shape, PROSPECT)
        out["loss"] = np.where(chance < SELDOM, 1.0, 1.0 - chance)
        out["snr_db"], out["late_s"] = snr_db, 0.0
        out["sound"] = self.loud(snr_db)
        return out

    def loud(self, snr_db: Floats) -> Floats:
        """Return the strength of sounds by SNR (dB), in units of the noise; 0 if too faint."""
        return np.where(snr_db >= self.faintest_db, 10.0 ** (snr_db / 10.0), 0.0)


def listener(
    sonar: Sound, budget: LinkBudget, message: SoundMessage, band_range_m: float
) -> Listener:
    """Return the receiver of a band; if no threshold is given, half of all messages are decoded at
    the band's range (m).
    """
    if sonar.decoding == "threshold":
        threshold = threshold_db(sonar, budget, band_range_m)
        return Listener(sonar, message, threshold, np.empty(0))
    chances = chance_decoded(sonar, LOOKED_UP, message)
    return Listener(sonar, message, float(np.interp(0.5, chances, LOOKED_UP)), chances)


@dataclass(frozen=True)
class SonarChannel:
    """Channel whose decoding chance follows SNR; `by_range` tabulates prospects at RANGES."""

    by_range: Prospects
    receiver: Receiver
    audible_m: float
    hears: Listener
    source_level_db: float

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal."""
        return self.by_range.take(CHANGES_OVER.searchsorted(signals.ranges))

    def at_level(self, level_db: float) -> "SonarChannel":
        """Return the channel of signals that are sent at another level (dB)."""
        snr = self.by_range["snr_db"] + (level_db - self.source_level_db)
        return replace(self, by_range=self.hears.prospects_at(snr), source_level_db=level_db)


@lru_cache(maxsize=16)
def sonar_channel(
    sonar: Sonar, budget: LinkBudget, message: SoundMessage, band_range_m: float
) -> SonarChannel:
    """Return the channel of a band on which messages of one kind are sent.

    If no threshold is given, half of all messages are decoded at `band_range_m` (m), the protocol's
    range.  Signals drown others down to an SNR of the threshold less `interference_db`.
    """
    hears = listener(sonar, budget, message, band_range_m)
    by_range = hears.prospects_at(budget.snr_db(RANGES))
    by_range.setflags(write=False)
    return SonarChannel(
        by_range, hears.receiver(budget.noise_db), reach_m(budget, hears.faintest_db), hears,
        budget.source_level_db,
    )  # fmt: skip


def reach_m(budget: LinkBudget, snr_db: float) -> float:
    """Return the slant range (m) up to which signals have an SNR (dB); 0 if nowhere.

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

# Effect of echoes on a ping that they blend into, as of :data:`..records.rows.RECEPTION`; and for
# each path how much later (s) a separate echo arrives, and its strength where it overlaps others.
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
    """A sonar whose pings arrive directly and by surface and bottom.

    Echoes within 1 / B of a ping add to it, by phase: it fades, and seems to come from elsewhere.
    Later ones are sounds of their own, which drown others.
    """

    settings: PingSonar
    sea: Sea
    plain: SonarChannel
    hears: Listener
    floor: Bottom = UNKNOWN

    @property
    def receiver(self) -> Receiver:
        """How receivers of this channel tell a signal from sounds that overlap it."""
        return self.plain.receiver

    @property
    def audible_m(self) -> float:
        """How far (m) a signal drowns others, without its echoes."""
        return self.plain.audible_m

    @property
    def source_level_db(self) -> float:
        """The source level (dB re 1 uPa at 1 m)."""
        return self.plain.source_level_db

    def at_level(self, level_db: float) -> "EchoingSonar":
        """Return the channel of signals that are sent at another level (dB)."""
        return replace(self, plain=self.plain.at_level(level_db))

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal.

        A call is late by the echoes that blend into it, and so is the AUV's answer.
        """
        found, echo = self.heard(signals)
        if signals.calling:
            found["late_s"] = np.where(np.isnan(echo["lowered"]), 0.0, echo["late_s"])
        return found

    def _sea_of(self, signals: Signals) -> Sea:
        """Return the sea of each signal (n, m): as deep as below the middle of its way; on average,
        where that is not known.
        """
        if not self.floor.is_known:
            return self.sea
        middles = (signals.auvs[:, None, :2] + signals.asvs[:, :2]) / 2.0
        depth = self.floor.below(middles.reshape(-1, 2)).reshape(middles.shape[:2])
        depth = np.where(np.isnan(depth), np.nanmean(self.floor.depths), depth)
        return self.sea._replace(depth_m=np.maximum(depth, 2.0 * self.settings.transducer_m))

    def heard(self, signals: Signals) -> Heard:
        """Return the answer about each signal (n, m), and its echoes (n, m), :data:`ECHO`."""
        away = np.hypot(
            signals.auvs[:, None, 0] - signals.asvs[:, 0],
            signals.auvs[:, None, 1] - signals.asvs[:, 1],
        )
        sea = self._sea_of(signals)
        depth = sea.depth_m
        source = np.clip(signals.auvs[:, None, 2], 0.0, depth)
        receiver = np.clip(signals.asvs[None, :, 2], self.settings.transducer_m, depth)
        found = echoes(sea, self.settings.frequency_khz, away, source, receiver, MOST_REFLECTIONS)
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
        return self.hears.prospects_at(faded), out


def echoing_sonar(
    settings: PingSonar,
    budget: LinkBudget,
    message: SoundMessage,
    band_range_m: float,
    sound_speed_m_per_s: float,
    floor: Bottom = UNKNOWN,
) -> EchoingSonar:
    """Return the channel of pings over a bottom of sand, flat unless its `floor` is known; see
    :func:`.sonar_channel`.
    """
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
        floor if isinstance(settings.bottom_m, OfBathymetry) else UNKNOWN,
    )
