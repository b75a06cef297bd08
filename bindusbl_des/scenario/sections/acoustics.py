"""The keys of both bands: how far they carry, how long a message takes, what is lost."""

from typing import Literal

from pydantic import Field

from ..key_types import PAPER, Part, Real, Whole, key
from ..part_choice import SET, PartChoice


class Uplink(Part):
    """The high-frequency band on which AUVs ping."""

    range_m: Real = key(50.0, "m", "HF range R_HF", PAPER, ge=0.1, le=1e5)
    range_metric: Literal["horizontal", "slant"] = key(
        "horizontal", "", "which distance is compared with the HF range", PAPER
    )
    ping_s: Real = key(0.010, "s", "duration T_P of a ping", PAPER, ge=1e-6, le=10)
    channel: PartChoice = key(
        "disc",
        "",
        "which signals are decoded: within range but for acoustics.loss, by a curve, by SNR" + SET,
    )


class Downlink(Part):
    """The medium-frequency band on which ASVs broadcast fixes."""

    range_m: Real = key(100.0, "m", "MF range R_MF (horizontal)", PAPER, ge=0.1, le=1e6)
    channel: PartChoice = key(
        "disc", "", "which AUVs decode a frame: all within range, by a curve, or by SNR" + SET
    )
    bit_rate_bps: Real = key(2000.0, "bit/s", "bit rate R_DL", PAPER, ge=1, le=1e9)
    overhead: Real = key(2.0, "1", "protocol overhead factor Lambda", PAPER, ge=1, le=100)
    header_bytes: Whole = key(8, "B", "header of a broadcast N_hdr", PAPER, ge=0, le=65_535)
    fix_bytes: Whole = key(16, "B", "record of one fix B_fix", PAPER, ge=1, le=65_535)


class Loss(Part):
    """Why a ping in range may still not be decoded."""

    law: Literal["paper", "thesis", "head", "none"] = key(
        "paper", "", "coefficients of eq. fix_loss: published digits, full digits, OEM head, none"
    )
    combine: Literal["clamp_first", "paper_raw", "off"] = key(
        "off", "", "how contention is added (eq. fix_loss_total); off = collisions are simulated"
    )
    contention_per_auv: Real = key(0.05, "1", "P_col per additional AUV", PAPER, ge=0, le=1)
    cap: Real = key(0.999, "1", "largest loss probability", PAPER, ge=0, le=1)


class Acoustics(Part):
    """The two acoustic bands and the loss on the uplink."""

    hf: Uplink = Field(default=Uplink(), description="uplink band")
    mf: Downlink = Field(default=Downlink(), description="downlink band")
    loss: Loss = Field(default=Loss(), description="loss of single pings")
