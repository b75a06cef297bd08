"""The channels of both bands, as a scenario names them."""

from collections.abc import Callable
from functools import cache
from operator import attrgetter
from typing import Any

from ...support.plugins import Family, is_plugin
from ..geometry.land import Land
from ..scenario.families import CHANNEL, MF_CHANNEL
from ..scenario.part_choice import settings_of, shipped_part
from ..scenario.sections.acoustics import Loss, UplinkSection
from ..scenario.site import Site
from .asking import Asking, as_sold
from .channel import NO_LOSS, AskedChannel, own_channel
from .loss import COMBINERS, LossTerms, contention_loss, loss_law
from .shadows import AskedDisc, shadowed
from .sonar_equation import SoundMessage, timing_sd_s
from .sound_settings import Sound

# Function of a frame's size (B) and airtime (s): its channel
FrameChannel = Callable[[int, float], AskedChannel]


def ping_channel(site: Site) -> AskedChannel | None:
    """Return the channel of pings; None for the compiled disc.

    Raises:
        PluginError: when a user-defined one is not allowed, or cannot be loaded or called.
        ValueError: when the file of a curve is not valid.
    """
    hf = site.scenario.acoustics.hf
    return _channel(site, CHANNEL, SoundMessage(hf.ping_s), hf.range_m)


def frame_channel(site: Site) -> FrameChannel | None:
    """Return the channel of frames, None for the disc; raises what :func:`ping_channel` does."""
    mf = site.scenario.acoustics.mf
    if not mf.channel.is_own and MF_CHANNEL.declared(mf.channel).ends_at_range:
        return None

    @cache
    def channel_of(size_bytes: int, airtime_s: float) -> AskedChannel:
        # a frame without header and fixes still carries a bit
        message = SoundMessage(airtime_s, max(1, 8 * size_bytes))
        channel = _channel(site, MF_CHANNEL, message, mf.range_m)
        assert channel is not None
        return channel

    channel_of(mf.fix_bytes, 1.0)  # mistakes are raised before the mission
    return channel_of


def in_shadow(channel: FrameChannel | None, slant: bool, land: Land) -> FrameChannel:
    """Return a channel of frames (None: the disc, slant or horizontal) in a sea with land."""

    @cache
    def channel_of(size_bytes: int, airtime_s: float) -> AskedChannel:
        disc = AskedDisc(NO_LOSS, slant)
        return shadowed(channel(size_bytes, airtime_s) if channel else disc, land)

    return channel_of


def _channel(
    site: Site, family: Family[Any], message: SoundMessage, range_m: float
) -> AskedChannel | None:
    choice: str = attrgetter(family.key)(site.scenario)
    if is_plugin(choice):
        return own_channel(family, choice)
    if family.declared(choice).ends_at_range:
        return None
    modem = attrgetter(family.key.rpartition(".")[0])(site.scenario).modem
    made: AskedChannel | None = shipped_part(family, choice)(Asking(site, message, range_m, modem))
    return made


def loss_of(loss: Loss, range_m: float, auvs: int) -> LossTerms:
    """Return the disc's law of loss for pings within a range (m), shared by so many AUVs."""
    return LossTerms(
        loss_law(loss.law, range_m).coefficients,
        list(COMBINERS).index(loss.combine),
        contention_loss(auvs, loss.contention_per_auv) if auvs else 0.0,
        loss.cap,
    )


def timing_sd_of(hf: UplinkSection) -> float:
    """Return the timing noise (s) that a ping of 0 dB adds at each element; 0 without levels."""
    timing = hf.channel.settings.get("timing", "constant")
    if timing == "constant" or not CHANNEL.declared(hf.channel).has_levels:
        return 0.0
    settings = settings_of(CHANNEL, hf.channel)
    assert isinstance(settings, Sound)
    settings = as_sold(settings, hf.modem)
    return float(timing_sd_s(settings, 0.0, hf.ping_s, timing == "carrier"))
