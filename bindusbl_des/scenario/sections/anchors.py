"""The keys of vessels that move: how they are placed anew during the mission, or their tracks."""

from typing import ClassVar, Literal

from ..key_types import OURS, Part, Point, Real, Text, key
from ..part_choice import PartChoice

SPEED_M_PER_S, REPLAN_S = 1.5, 10.0


class Moving(Part):
    """ASVs that keep no station."""

    MODEL: ClassVar[str]

    @property
    def choice(self) -> PartChoice:
        """The placement as a part of the mission."""
        return PartChoice(self.MODEL)


class Placed(Moving):
    """ASVs that are told again and again where to go, on what the fleet knows."""

    speed_m_per_s: Real = key(
        SPEED_M_PER_S, "m/s", "speed of an ASV on its way", OURS, ge=0.001, le=20
    )
    replan_s: Real = key(REPLAN_S, "s", "how often ASVs are told where to go", OURS, ge=0.1, le=1e6)
    start_m: tuple[Point, ...] | None = key(
        None, "m", "one [x, y] per ASV where it is launched; null = where it is to be at first"
    )


class Grouped(Placed):
    """ASVs that are told to go elsewhere only where that is worth it."""

    hysteresis: Real = key(
        0.05, "1", "share by which another placement must be better to be taken", OURS, ge=0, le=1
    )


class Ahead(Grouped):
    """ASVs that are placed for where AUVs are going to be."""

    horizon_s: Real = key(
        10.0, "s", "how long ahead AUVs are believed to be where ASVs go", OURS, ge=0, le=1e6
    )


class Follow(Ahead):
    """ASVs keep to where the fleet is, the farthest AUV as near as possible (k-centre)."""

    MODEL = "follow"
    model: Literal["follow"] = "follow"


class Assign(Ahead):
    """Each ASV stays above the middle of AUVs of its own."""

    MODEL = "assign"
    model: Literal["assign"] = "assign"


class Zigzag(Grouped):
    """Each ASV sweeps to and fro over AUVs of its own."""

    MODEL = "zigzag"
    model: Literal["zigzag"] = "zigzag"
    amplitude_m: Real | None = key(
        None,
        "m",
        "half the width of the sweep; null = from the first to the last of the ASV's AUVs, of a "
        "single one half the HF range",
        ge=0.01,
        le=1e5,
    )
    period_s: Real | None = key(
        None,
        "s",
        "time of a sweep there and back; null = as long as an ASV takes that keeps up with AUVs",
        ge=1,
        le=1e6,
    )


class AsvTrack(Moving):
    """Each ASV repeats the recorded track of a real vessel."""

    MODEL = "track"
    model: Literal["track"] = "track"
    files: tuple[Text, ...] = key(
        (),
        "",
        "per ASV a CSV with columns time_s, x_m, y_m (or lat_deg, lon_deg), depth_m, a GPX or an "
        "MCAP file; relative to the scenario file; whatever its depths, ASVs are at the surface",
    )
    tracks: tuple[Text, ...] = key(
        (),
        "",
        "per ASV which track of its file, where that holds several: a vehicle of a CSV, the name "
        "of a GPX track, the topic of an MCAP",
    )
    time_offset_s: Real = key(
        0.0,
        "s",
        "subtracted from the time_s of the files, such as the Unix time of the mission's start",
        ge=-1e12,
        le=1e12,
    )
