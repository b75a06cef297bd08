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
from ..scenario.scenario import Scenario
from ..scenario.site import sound_speed_of, water_of
from .channel import PLAIN, AskedChannel, Prospects, Receiver, Signals, contention_of, own_channel
from .loss import COMBINERS, LossTerms, loss_law
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


def hf_channel(scenario: Scenario) -> AskedChannel | None:
    """Return the channel of pings; None for the compiled disc.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
        ValueError: when the file of a curve is none.
    """
    hf = scenario.acoustics.hf
    return _channel(scenario, CHANNEL, SoundMessage(hf.ping_s), hf.range_m)


def mf_channel(scenario: Scenario) -> FrameChannel | None:
    """Return the channel of frames; None for the disc.  Errors are those of :func:`hf_channel`."""
    mf = scenario.acoustics.mf
    if mf.channel == "disc":
        return None

    @cache
    def channel_of(size_bytes: int, airtime_s: float) -> AskedChannel:
        # a frame of neither header nor fix says all the same that it is one
        message = SoundMessage(airtime_s, max(1, 8 * size_bytes))
        channel = _channel(scenario, MF_CHANNEL, message, mf.range_m)
        assert channel is not None
        return channel

    channel_of(mf.fix_bytes, 1.0)  # what is wrong with it is told before the mission
    return channel_of


def _channel(
    scenario: Scenario, family: Family, message: SoundMessage, range_m: float
) -> AskedChannel | None:
    choice: str = attrgetter(family.key)(scenario)
    if is_plugin(choice):
        return own_channel(family, choice)
    if choice == "disc":
        return None
    settings = settings_of(family, choice)
    if isinstance(settings, Curve):
        return curve_channel(settings)
    modem = attrgetter(family.key.rpartition(".")[0])(scenario).modem
    if isinstance(settings, Table):
        from .table_channel import table_channel  # brings pyarrow

        return table_channel(scenario, _as_sold(settings, modem), message, range_m)
    assert isinstance(settings, Sonar)
    settings = _as_sold(settings, modem)
    budget = link_budget(settings, water_of(scenario))
    if isinstance(settings, PingSonar) and echoing(scenario):
        speed = sound_speed_of(scenario)
        return echoing_sonar(settings, budget, message, range_m, speed)
    return sonar_channel(settings, budget, message, range_m)


def echoing(scenario: Scenario) -> bool:
    """Tell whether pings have echoes: those of AUVs, by a sonar, where a bottom is given."""
    channel = scenario.acoustics.hf.channel
    given = channel == "sonar" and channel.settings.get("bottom_m") is not None
    return given and not scenario.protocol.asvs_ping


def loss_of(scenario: Scenario) -> LossTerms:
    """Return how likely a ping is lost on its way over the disc."""
    loss = scenario.acoustics.loss
    return LossTerms(
        loss_law(loss.law, scenario.acoustics.hf.range_m).coefficients,
        list(COMBINERS).index(loss.combine),
        contention_of(scenario),
        loss.cap,
    )


def timing_sd_of(scenario: Scenario) -> float:
    """Return what a ping of 0 dB adds to the noise (s) of the elements that time it; 0 without a
    sonar that knows of levels.
    """
    hf = scenario.acoustics.hf
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
