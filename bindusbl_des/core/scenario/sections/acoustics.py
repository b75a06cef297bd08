"""The keys of both acoustic bands: range, channel, airtime, power; and the loss of pings."""

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    Field,
    ModelWrapValidatorHandler,
    Strict,
    WithJsonSchema,
    model_validator,
)

from ....models.presets.catalogue import CATALOGUE, preset
from ....models.presets.modems import table_file
from ..families import CHANNEL, ChannelTraits
from ..key_types import PAPER, Part, Real, Text, Whole, key, known_preset
from ..part_choice import SET, PartChoice

MODEMS = [entry.name for entry in CATALOGUE["modem"]]


ModemName = Annotated[
    str,
    Strict(),
    AfterValidator(partial(known_preset, "modem")),
    WithJsonSchema({"type": "string", "enum": MODEMS}),
]


RangeMetric = Literal["horizontal", "slant"]


def modem_values(name: str, band: "type[Band]") -> dict[str, Any]:
    """Return the values that a modem's data sheet gives for keys of a band."""
    values: dict[str, Any] = preset("modem", name).values
    if "airtimes" in values:
        values["airtimes"] = table_file(str(values["airtimes"]))
    if "channel" in values:  # the delivery ratio as measured
        values["channel"] = PartChoice("curve", {"file": table_file(str(values["channel"]))})
    return {key: value for key, value in values.items() if key in band.model_fields}


class Band(Part):
    """The keys that both bands have: modem, power, and the facts that follow from them."""

    modem: ModemName | None = key(
        None,
        "",
        "modem whose data sheet (`bindusbl-des presets modem`) sets the keys of this band "
        "that are not given",
    )
    transmit_w: Real | None = key(
        None, "W", "electrical power while sending; null = energy is not reported", ge=0, le=1e5
    )
    receive_w: Real = key(0.0, "W", "electrical power while a signal arrives", ge=0, le=1e5)
    idle_w: Real | None = key(
        None, "W", "electrical power at other times; null = as while a signal arrives", ge=0, le=1e5
    )

    if TYPE_CHECKING:  # keys of each band, at their places among its others
        range_m: Real
        range_metric: RangeMetric
        channel: PartChoice

    @property
    def stated(self) -> dict[str, Any]:
        """The values that the modem's data sheet gives for keys of this band."""
        return {} if self.modem is None else modem_values(self.modem, type(self))

    @property
    def traits(self) -> ChannelTraits:
        """What the band's channel declares."""
        return CHANNEL.declared(self.channel)

    @property
    def by_place(self) -> bool:
        """Whether the channel needs positions alone: neither user-defined nor of named links."""
        return not (self.channel.is_own or self.traits.by_link)

    @property
    def burst_s(self) -> float | None:
        """The mean duration (s) of a burst of losses; None where signals are lost independently."""
        given: float | None = self.channel.settings.get("burst_s")
        return given

    @property
    def doppler_limit_m_per_s(self) -> float | None:
        """The highest range rate (m/s) at which signals are decoded; None without a limit.

        As the channel says, else as the modem's data sheet does.
        """
        given = self.channel.settings.get("doppler_limit_m_per_s")
        if given is None and self.modem is not None:
            given = preset("modem", self.modem).values.get("doppler_limit_m_per_s")
        return None if given is None else float(given)

    @property
    def frequency_khz(self) -> float:
        """The centre frequency (kHz) of channels that compute sound levels."""
        sounding = CHANNEL.having(lambda traits: traits.has_levels)[0]
        usual = CHANNEL.settings[sounding].model_fields["frequency_khz"].default
        return float(self.channel.settings.get("frequency_khz", usual))

    def longest_path_m(self, depth: float, further_m: float = 0.0) -> float:
        """Return the longest path (m) of a decoded signal between a depth (m) and the surface.

        `further_m` (m) is added to the range.  A horizontal range ignores the depth: sound takes
        the slant path.

        >>> UplinkSection(range_m=40.0).longest_path_m(30.0)
        50.0
        >>> UplinkSection(range_m=40.0, range_metric="slant").longest_path_m(30.0)
        40.0
        """
        reach = self.range_m + further_m
        return math.hypot(reach, depth) if self.range_metric == "horizontal" else reach

    @model_validator(mode="wrap")
    @classmethod
    def _filled(cls, data: Any, validate: ModelWrapValidatorHandler["Band"]) -> "Band":
        """Let the modem's figures replace defaults; they do not count as given."""
        name = data.get("modem") if isinstance(data, dict) else None
        if name not in MODEMS:
            return validate(data)
        band = validate({**modem_values(name, cls), **data})
        object.__setattr__(band, "__pydantic_fields_set__", set(data))
        return band


class UplinkSection(Band):
    """The high-frequency band on which AUVs ping."""

    range_m: Real = key(50.0, "m", "HF range R_HF", PAPER, ge=0.1, le=1e5)
    range_metric: RangeMetric = key(
        "horizontal", "", "which distance is compared with the HF range", PAPER
    )
    ping_s: Real = key(0.010, "s", "duration T_P of a ping", PAPER, ge=1e-6, le=10)
    bit_rate_bps: Real = key(
        1000.0,
        "bit/s",
        "bit rate of data (traffic), and of signals of programs (protocol.access)",
        ge=1,
        le=1e9,
    )
    channel: PartChoice = key(
        "disc",
        "",
        "which signals are decoded: within range but for acoustics.loss, by a curve, by SNR" + SET,
    )

    @property
    def beyond(self) -> str:
        """Why a signal from beyond the range is not decoded: words that complete "ASV0 is 60 m
        away, ...".
        """
        if self.channel.is_own:
            return f"where the channel {self.channel.words} lets no sound through"
        if not self.traits.ends_at_range:
            return f"where the channel {self.channel} lets nothing be decoded"
        return f"out of HF range ({self.range_m:g} m {self.range_metric})"


class Downlink(Band):
    """The medium-frequency band on which ASVs broadcast fixes."""

    range_m: Real = key(100.0, "m", "MF range R_MF", PAPER, ge=0.1, le=1e6)
    range_metric: RangeMetric = key(
        "horizontal", "", "which distance is compared with the MF range", PAPER
    )
    channel: PartChoice = key(
        "disc", "", "which AUVs decode a frame: all within range, by a curve, or by SNR" + SET
    )
    bit_rate_bps: Real = key(2000.0, "bit/s", "bit rate R_DL", PAPER, ge=1, le=1e9)
    overhead: Real = key(2.0, "1", "protocol overhead factor Lambda", PAPER, ge=1, le=100)
    airtimes: Text | None = key(
        None,
        "",
        "CSV file of measured airtimes, columns payload_bytes (rising; interpolated "
        "linearly), airtime_s and processing_delay_mean_s; null = by bit rate and overhead",
    )
    processing_s: Real | None = key(
        None,
        "s",
        "time from the end of a message to its delivery by the modem, beside the airtime; "
        "null = that of the table of airtimes, else 0",
        ge=0,
        le=1e3,
    )
    payload_bytes: Whole | None = key(
        None, "B", "largest payload of a message; null = that of the table, or any", ge=1, le=65_535
    )
    overfull: Literal["split", "oldest_first"] = key(
        "split",
        "",
        "how to send more fixes than one message holds: in consecutive messages, or the "
        "oldest now and the rest with the next broadcast",
    )
    header_bytes: Whole = key(8, "B", "header of a broadcast N_hdr", PAPER, ge=0, le=65_535)
    fix_bytes: Whole = key(16, "B", "record of one fix B_fix", PAPER, ge=1, le=65_535)


class Loss(Part):
    """The loss of pings within range."""

    law: Literal["scaled", "paper", "thesis", "head", "none"] = key(
        "scaled",
        "",
        "loss by range (eq. fix_loss): the paper's law over 100 m stretched to a longer "
        "`hf.range_m`, the paper's law (beyond 518 m all is lost), the same with full digits, "
        "that of the OEM head, or none",
    )
    combine: Literal["clamp_first", "paper_raw", "off"] = key(
        "off", "", "how contention is added (eq. fix_loss_total); off = collisions are simulated"
    )
    contention_per_auv: Real = key(0.05, "1", "P_col per additional AUV", PAPER, ge=0, le=1)
    cap: Real = key(0.999, "1", "largest loss probability", PAPER, ge=0, le=1)


class Acoustics(Part):
    """The two acoustic bands, and the loss of pings."""

    hf: UplinkSection = Field(default=UplinkSection(), description="uplink band")
    mf: Downlink = Field(default=Downlink(), description="downlink band")
    loss: Loss = Field(default=Loss(), description="loss of single pings")

    @property
    def bands(self) -> dict[str, Band]:
        """The bands by name, "hf" and "mf"."""
        return {"hf": self.hf, "mf": self.mf}
