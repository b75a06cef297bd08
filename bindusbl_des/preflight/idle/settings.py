"""Settings of channels, instruments and casts that another setting leaves nothing to do."""

from collections.abc import Iterator

from ...core.plugins import is_plugin
from ...scenario.agreement.problem import Problem
from ...scenario.channel_settings import burst_s
from ...scenario.declared import channel_named
from ...scenario.scenario import Scenario
from ...scenario.sections.environment import Environment

# Channels of the HF band that tell how much louder than the noise a ping is
WITH_SNR = ("sonar", "table")
MATCHED_FILTERS = ("non_coherent", "coherent", "rayleigh")
USUAL_LAW = Environment.model_fields["sound_speed_law"].default


def sheet(scenario: Scenario) -> Iterator[Problem]:
    """Yield what a USBL's sheet says of signal-to-noise ratios where there are none."""
    channel = scenario.acoustics.hf.channel
    if "reference_snr_db" in scenario.usbl.model.settings and channel not in WITH_SNR:
        yield Problem(
            "usbl.model.reference_snr_db",
            f"has no effect with acoustics.hf.channel: {channel} (it tells of no signal-to-noise "
            "ratio, angles are as stated); remove it",
            ("acoustics.hf.channel",),
        )


def sonar(scenario: Scenario) -> Iterator[Problem]:
    """Yield settings of a sonar that do nothing here."""
    settings, model = scenario.acoustics.hf.channel.settings, scenario.usbl.model
    if "timing" in settings and model != "array":
        yield Problem(
            "acoustics.hf.channel.timing",
            f"has no effect with usbl.model: {model} (how directions err is said there, arrivals "
            "at an array are not timed); remove it",
            ("usbl.model",),
        )
    if scenario.acoustics.hf.channel == "sonar" and scenario.protocol.is_passive:
        for name in {"bottom_m", "surface_sd_m", "transducer_m"} & settings.keys():
            yield Problem(
                f"acoustics.hf.channel.{name}",
                "has no effect with protocol.ranging: passive (the pings of ASVs have no echoes); "
                "remove it",
                ("protocol.ranging",),
            )


def levels(scenario: Scenario) -> Iterator[Problem]:
    """Yield settings of channels with levels that another of their settings leaves out."""
    for band in ("hf", "mf"):
        channel = getattr(scenario.acoustics, band).channel
        if channel not in WITH_SNR:
            continue
        given = channel.settings
        decoding = given.get("decoding", "threshold")
        for name, chooser, chosen, idle in (
            ("ph", "absorption", given.get("absorption"), given.get("absorption") == "thorp"),
            ("false_alarm", "decoding", decoding, decoding not in MATCHED_FILTERS),
        ):
            if idle and name in given:
                yield Problem(
                    f"acoustics.{band}.channel.{name}",
                    f"has no effect with {chooser}: {chosen}; remove it",
                    (f"acoustics.{band}.channel.{chooser}",),
                )


def bursts(scenario: Scenario) -> Iterator[Problem]:
    """Yield how long losses last where nothing is lost."""
    hf, mf = scenario.acoustics.hf.channel, scenario.acoustics.mf.channel
    if burst_s(mf) is not None and channel_named(mf).keeps_frames:
        yield Problem(
            "acoustics.mf.channel.burst_s",
            f"has no effect with acoustics.mf.channel: {mf} (within its range it loses no frame); "
            "remove it",
            ("acoustics.mf.channel",),
        )
    loss = scenario.acoustics.loss
    by_law = channel_named(hf).ends_at_range and not is_plugin(hf)
    if burst_s(hf) is not None and by_law and loss.law == "none" and loss.combine == "off":
        yield Problem(
            "acoustics.hf.channel.burst_s",
            "has no effect with acoustics.loss.law: none (no ping is lost on its way); remove it",
            ("acoustics.loss.law",),
        )


def cast(scenario: Scenario) -> Iterator[Problem]:
    """Yield a law of sound speed where the cast says what it is."""
    water = scenario.environment
    if water.ctd is None or "sound_speed_law" not in water.model_fields_set:
        return
    from ...sea.water_column import read_cast  # needs numpy, which few scenarios wait for here

    if water.sound_speed_law != USUAL_LAW and read_cast(water.ctd).speeds_m_per_s is not None:
        yield Problem(
            "environment.sound_speed_law",
            "has no effect on a cast that has speeds of sound itself; remove it",
            ("environment.ctd",),
        )
