"""The channels of both bands, as a scenario names them, and `curve`: a share decoded over range."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from operator import attrgetter
from typing import TypeVar

import numpy as np

from ..core.arrays import Floats
from ..core.plugins import Family, is_plugin
from ..presets.catalogue import preset
from ..scenario.channel_settings import Curve, PingSonar, Sonar, Sound, Table, read_curve
from ..scenario.families import CHANNEL, MF_CHANNEL
from ..scenario.part_choice import settings_of
from ..scenario.sections.acoustics import Loss, UplinkSection
from ..scenario.site import Site
from .channel import PLAIN, AskedChannel, Prospects, Receiver, Signals, own_channel
from .loss import COMBINERS, LossTerms, contention_loss, loss_law
from .propagation import PROSPECT
from .sonar_channel import echoing_sonar, sonar_channel
from .sonar_equation import SoundMessage, link_budget, timing_sd_s


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
    site: Site, family: Family, message: SoundMessage, range_m: float
) -> AskedChannel | None:
    choice: str = attrgetter(family.key)(site.scenario)
    if is_plugin(choice):
        return own_channel(family, choice)
    if choice == "disc":
        return None
    settings = settings_of(family, choice)
    if isinstance(settings, Curve):
        return curve_channel(settings)
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
