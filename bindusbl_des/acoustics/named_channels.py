"""The channels of both bands, as a scenario names them, and `curve`: a share decoded over range."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from ..core.arrays import Floats
from ..core.plugins import Family, is_plugin
from ..presets.catalogue import preset
from ..scenario.channel_settings import (
    Curve,
    PingSonar,
    Series,
    Sonar,
    Sound,
    Table,
    read_curve,
    read_series,
)
from ..scenario.families import CHANNEL, MF_CHANNEL
from ..scenario.part_choice import settings_of
from ..scenario.sections.acoustics import Loss, UplinkSection
from ..scenario.site import Site
from .channel import PLAIN, SELDOM, AskedChannel, Prospects, Receiver, Signals, own_channel
from .loss import COMBINERS, LossTerms, contention_loss, loss_law
from .propagation import PROSPECT
from .sonar_channel import echoing_sonar, sonar_channel
from .sonar_equation import SoundMessage, link_budget, normal_cdf, timing_sd_s


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
        out = np.empty(signals.ranges.shape, PROSPECT)
        out["loss"] = 1.0 - np.interp(signals.ranges, self.ranges, self.ratios, right=0.0)
        out["snr_db"], out["late_s"] = math.nan, 0.0
        out["sound"] = signals.ranges <= self.audible_m
        return out


def curve_channel(settings: Curve) -> CurveChannel:
    """Return the channel of a curve in a file.

    Raises:
        ValueError: naming file, line and remedy, when it is no such curve.
    """
    ranges, ratios, _ = read_curve(settings.file)
    farthest = max(settings.interference_m or 0.0, ranges[-1])
    return CurveChannel(np.array(ranges), np.array(ratios), farthest)


@dataclass(frozen=True)
class SeriesChannel:
    """Signals of each link are decoded as was measured of it: the last value holds until the next,
    the first before it too.

    A link of which the file has one direction alone holds both ways; one that it does not have
    hears nothing.  `links` have instants and values of (sender, listener), by AUVs' numbers from 0
    on and ASVs' from -1 down.  Levels are those of a receiver with a threshold.
    """

    links: Mapping[tuple[int, int], tuple[Floats, Floats]]
    has_levels: bool
    receiver: Receiver = PLAIN
    audible_m: float | None = None

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal between vehicles that are named.

        Raises:
            ValueError: when it is not said which vehicles they are.
        """
        if signals.auv_numbers is None or signals.asv_numbers is None:
            raise ValueError("what was measured of links tells of no places, but of vehicles alone")
        found = np.full(signals.ranges.shape, np.nan)
        for row, auv in enumerate(signals.auv_numbers.tolist()):
            for column, asv in enumerate(signals.asv_numbers.tolist()):
                ends = auv, -1 - asv
                link = ends[::-1] if signals.calling else ends
                found[row, column] = self._at(signals.time, *link)
        out, deaf = np.empty(found.shape, PROSPECT), np.isnan(found)
        out["snr_db"], out["late_s"] = math.nan, 0.0
        out["loss"], out["sound"] = (
            np.where(deaf, 1.0, 1.0 - found),
            np.where(found > 0.0, 1.0, 0.0),
        )
        if self.has_levels:
            receiver = self.receiver
            snr = np.where(deaf, -math.inf, found - receiver.noise_db)
            chance = normal_chance(snr - receiver.threshold_db, receiver.shadowing_sd_db)
            out["loss"], out["snr_db"] = 1.0 - chance, np.where(deaf, math.nan, snr)
            out["sound"] = np.where(chance > SELDOM, 10.0 ** (np.where(deaf, 0.0, snr) / 10.0), 0.0)
        out["loss"][out["loss"] > 1.0 - SELDOM] = 1.0
        return out

    def _at(self, time: float, sender: int, listener: int) -> float:
        """Return what held of a link at an instant (s); NaN of one that was not measured."""
        link = self.links.get((sender, listener)) or self.links.get((listener, sender))
        if link is None:
            return math.nan
        return float(link[1][max(int(np.searchsorted(link[0], time, side="right")) - 1, 0)])


def normal_chance(margin_db: Floats, sd: float) -> Floats:
    """Return how likely a level above its threshold by so much (dB) stays so if it varies by `sd`
    (dB).

    >>> normal_chance(np.array([-1.0, 0.0, 3.0]), 0.0), normal_chance(np.array([3.0]), 3.0).round(4)
    (array([0., 1., 1.]), array([0.8413]))
    """
    if sd == 0.0:
        return np.where(margin_db >= 0.0, 1.0, 0.0)
    return normal_cdf(margin_db / sd)


def series_channel(settings: Series, auvs: int, asvs: int) -> SeriesChannel:
    """Return the channel of what was measured of links in a file, of so many AUVs and ASVs.

    Raises:
        ValueError: naming file, line and remedy, when it is none, or names a vehicle that there is
            not.
    """
    series = read_series(settings.file)
    if series.has_levels and settings.threshold_db is None:
        raise ValueError(
            f"{settings.file} has levels, of which nobody says which are decoded; give threshold_db"
        )
    found: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for row in series.rows:
        ends = []
        for column, name in (("from", row.sender), ("to", row.listener)):
            kind, number, count = name[:3], int(name[3:]), auvs if name[:3] == "AUV" else asvs
            if number >= count:
                raise ValueError(
                    f"{row.where}: {column} is {name!r}, and the mission has {count} {kind}s, "
                    f"{kind}0 to {kind}{count - 1}; leave the line out, or add vehicles"
                )
            ends.append(number if kind == "AUV" else -1 - number)
        found.setdefault((ends[0], ends[1]), []).append((row.time, row.value))
    links = {link: (np.array(rows)[:, 0], np.array(rows)[:, 1]) for link, rows in found.items()}
    if not series.has_levels:
        return SeriesChannel(links, False)
    threshold = (settings.threshold_db or 0.0) - settings.noise_db
    receiver = Receiver(math.inf, settings.shadowing_sd_db, settings.noise_db, threshold)
    return SeriesChannel(links, True, receiver)


# The settings of a channel that knows levels
Sounding = TypeVar("Sounding", bound=Sound)

# The channel of a frame of so many bytes that is on the air for so long (s).
FrameChannel = Callable[[int, float], AskedChannel]


def ping_channel(site: Site) -> AskedChannel | None:
    """Return the channel of pings; None for the compiled disc.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
        ValueError: when the file of a curve is none.
    """
    hf = site.scenario.acoustics.hf
    return _channel(site, CHANNEL, SoundMessage(hf.ping_s), hf.range_m)


def frame_channel(site: Site) -> FrameChannel | None:
    """Return the channel of frames; None: the disc.  Errors are those of :func:`ping_channel`."""
    mf = site.scenario.acoustics.mf
    if mf.channel == "disc":
        return None

    @cache
    def channel_of(size_bytes: int, airtime_s: float) -> AskedChannel:
        # a frame of neither header nor fix says all the same that it is one
        message = SoundMessage(airtime_s, max(1, 8 * size_bytes))
        channel = _channel(site, MF_CHANNEL, message, mf.range_m)
        assert channel is not None
        return channel

    channel_of(mf.fix_bytes, 1.0)  # what is wrong with it is told before the mission
    return channel_of


def _channel(
    site: Site, family: Family[Any], message: SoundMessage, range_m: float
) -> AskedChannel | None:
    choice: str = attrgetter(family.key)(site.scenario)
    if is_plugin(choice):
        return own_channel(family, choice)
    if choice == "disc":
        return None
    settings = settings_of(family, choice)
    if isinstance(settings, Curve):
        return curve_channel(settings)
    if isinstance(settings, Series):
        return series_channel(settings, site.scenario.auvs.count, site.scenario.asvs.count)
    modem = attrgetter(family.key.rpartition(".")[0])(site.scenario).modem
    if isinstance(settings, Table):
        from .table_channel import table_channel  # brings pyarrow

        return table_channel(site, _as_sold(settings, modem), message, range_m)
    assert isinstance(settings, Sonar)
    settings = _as_sold(settings, modem)
    budget = link_budget(settings, site.water)
    if isinstance(settings, PingSonar) and site.pings_echo:
        return echoing_sonar(settings, budget, message, range_m, site.sound_speed_m_per_s)
    return sonar_channel(settings, budget, message, range_m)


def loss_of(loss: Loss, range_m: float, auvs: int) -> LossTerms:
    """Return how likely a ping is lost over a disc of a range (m) that so many AUVs share."""
    return LossTerms(
        loss_law(loss.law, range_m).coefficients,
        list(COMBINERS).index(loss.combine),
        contention_loss(auvs, loss.contention_per_auv) if auvs else 0.0,
        loss.cap,
    )


def timing_sd_of(hf: UplinkSection) -> float:
    """Return what a ping of 0 dB adds to the noise (s) of the elements that time it; 0 without a
    sonar that knows of levels.
    """
    timing = hf.channel.settings.get("timing", "constant")
    if hf.channel not in ("sonar", "table") or timing == "constant":
        return 0.0
    settings = settings_of(CHANNEL, hf.channel)
    assert isinstance(settings, Sound)
    settings = _as_sold(settings, hf.modem)
    return float(timing_sd_s(settings, 0.0, hf.ping_s, timing == "carrier"))


def _as_sold(settings: Sounding, modem: str | None) -> Sounding:
    """Let the figures of a band's modem stand for settings that are not given."""
    if modem is None:
        return settings
    values = preset("modem", modem).values
    names = (values.keys() & type(settings).model_fields) - settings.model_fields_set
    return settings.model_copy(update={name: values[name] for name in names})
