"""The keys of each placement: stations, vessels that are placed anew during the mission, tracks;
and of placements of somebody's own.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Tag

from ..families import PLACEMENT
from ..key_types import (
    OURS,
    PAPER,
    TIME_OFFSET_S,
    Part,
    Point,
    Position,
    Real,
    Text,
    key,
    sources,
    which_tracks,
)
from ..part_choice import PartChoice
from .routes import OwnSection, is_own

SPEED_M_PER_S, REPLAN_S = 1.5, 10.0


class PlacementTraits:
    """What the program asks of a placement, whichever it is: ASVs keep station, or move."""

    moves: ClassVar[bool] = False

    @property
    def moored(self) -> "Formation | None":
        """Where ASVs keep station; None where they move, or somebody's own part says it."""
        return None

    @property
    def replanned(self) -> "Placed | None":
        """How ASVs are sent elsewhere again and again; None where they are not."""
        return None

    @property
    def recording(self) -> "AsvTrack | None":
        """The files that ASVs repeat; None if they repeat none."""
        return None

    def miscounted(self, asvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield each list of places or files that is not of so many ASVs: its key, what it needs
        one of for each, and how many it has.
        """
        yield from ()


class OwnPlacement(PlacementTraits, OwnSection):
    """Where the ASVs keep station, or go, as somebody's own function says."""

    WORD = "model"


class Formation(PlacementTraits, Part):
    """Where the ASVs are moored: a regular N-gon (eq. formation) or given positions."""

    model: Literal["ring", "positions"] | None = key(
        None, "", "placement; null = positions where these are given (_m or _deg), else ring"
    )
    angle_deg: Real = key(
        0.0, "deg", "formation angle alpha_0 of ASV0 from +x", PAPER, ge=-360, le=360
    )
    clearance_m: Real = key(
        0.0, "m", "clearance Delta_b: R_f = hf.range_m + clearance_m", PAPER, ge=0, le=1e6
    )
    radius_m: Real | None = key(
        None, "m", "formation radius R_f itself; null = range plus clearance", ge=0, le=1e6
    )
    positions_m: tuple[Point, ...] | None = key(None, "m", "one [x, y] per ASV instead of an N-gon")
    positions_deg: tuple[Position, ...] | None = key(
        None, "deg", "one [lat, lon] per ASV instead, with environment.origin (WGS-84)"
    )

    @property
    def choice(self) -> PartChoice:
        """The placement as a part of the mission."""
        return PartChoice("positions" if self.is_placed else "ring")

    @property
    def moored(self) -> "Formation":
        """Where ASVs keep station."""
        return self

    def radius(self, hf_range_m: float) -> float:
        """Return how far (m) from the middle a ring lies: by default HF range plus clearance."""
        return hf_range_m + self.clearance_m if self.radius_m is None else self.radius_m

    @property
    def is_placed(self) -> bool:
        """Whether each ASV is given its own place."""
        return self.positions_m is not None or self.positions_deg is not None

    def misnamed(self, name: str) -> str:
        """Say how its name contradicts what is given at the key of places; "" if it does not."""
        if self.model is None or (self.model == "positions") is self.is_placed:
            return ""
        if self.is_placed:
            return f"ring excludes {name}; remove it, or use positions"
        return f"positions needs {name}; add it, or use ring"


class Moving(PlacementTraits, Part):
    """ASVs that keep no station."""

    MODEL: ClassVar[str]
    moves: ClassVar[bool] = True

    @property
    def choice(self) -> PartChoice:
        """The placement as a part of the mission."""
        return PartChoice(self.MODEL)


class Placed(Moving):
    """ASVs that are told again and again where to go, on what the fleet knows."""

    speed_m_per_s: Real = key(
        SPEED_M_PER_S, "m/s", "speed of an ASV on its way", OURS, ge=0.001, le=20
    )
    replan_s: Real = key(REPLAN_S, "s", "how often ASVs get new orders", OURS, ge=0.1, le=1e6)
    start_m: tuple[Point, ...] | None = key(
        None, "m", "one [x, y] per ASV where it is launched; null = where it is to be at first"
    )

    # How many AUVs they can be placed among; None for any number.
    MOST_AUVS: ClassVar[int | None] = None

    @property
    def replanned(self) -> "Placed":
        """How ASVs are sent elsewhere again and again."""
        return self

    def miscounted(self, asvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield the places where ASVs are launched, if they are not one for each."""
        if self.start_m and len(self.start_m) != asvs:
            yield "start_m", "[x, y]", len(self.start_m)


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

    MODEL, MOST_AUVS = "follow", 100  # which takes a tenth of a second; twice as many take seconds
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
    tracks: tuple[Text, ...] = which_tracks("ASV")
    time_offset_s: Real = TIME_OFFSET_S

    @property
    def sources(self) -> list[tuple[str, str]]:
        """Its files, and which of the tracks in each is meant."""
        return sources(self.files, self.tracks)

    @property
    def recording(self) -> "AsvTrack":
        """The files that ASVs repeat."""
        return self

    def miscounted(self, asvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield the files, and the names of tracks in them, that are not one for each ASV."""
        if len(self.files) != asvs:
            yield "files", "file", len(self.files)
        if self.tracks and len(self.tracks) != asvs:
            yield "tracks", "name", len(self.tracks)


def _placed(placement: Any) -> str:
    """Tell how ASVs are placed: moored, moving in some way, or as somebody's own part says."""
    if is_own(placement, "model"):
        return "own"
    if isinstance(placement, Moving):
        return placement.MODEL
    model = placement.get("model") if isinstance(placement, Mapping) else None
    known = PLACEMENT.traits.get(model) if isinstance(model, str) else None
    return str(model) if known is not None and known.moves else "moored"


Placement = Annotated[
    Annotated[Formation, Tag("moored")]
    | Annotated[Follow, Tag("follow")]
    | Annotated[Assign, Tag("assign")]
    | Annotated[Zigzag, Tag("zigzag")]
    | Annotated[AsvTrack, Tag("track")]
    | Annotated[OwnPlacement, Tag("own")],
    Discriminator(_placed),
]
