"""The keys of each placement of ASVs: stations, replanned positions, tracks, user-defined ones."""

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
    """What the program asks of a placement: do ASVs keep station, get orders, or repeat tracks?"""

    moves: ClassVar[bool] = False

    @property
    def moored(self) -> "Formation | None":
        """The keys of the stations; None where ASVs move, or a user-defined part places them."""
        return None

    @property
    def replanned(self) -> "Placed | None":
        """The keys of a placement that sends ASVs elsewhere during the mission; None otherwise."""
        return None

    @property
    def recording(self) -> "AsvTrack | None":
        """The keys of the files that ASVs repeat; None without."""
        return None

    def miscounted(self, asvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield each list that has not one entry per ASV: its key, what an entry is, its length."""
        yield from ()


class OwnPlacement(PlacementTraits, OwnSection):
    """A user-defined placement, which says where ASVs keep station or go."""

    WORD = "model"


class Formation(PlacementTraits, Part):
    """Where the ASVs are moored: a regular N-gon (eq. formation) or given positions."""

    model: Literal["ring", "positions"] | None = key(
        None, "", "placement; null = the given positions (_m or _deg), else ring"
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
        """The placement as a part."""
        return PartChoice("positions" if self.is_placed else "ring")

    @property
    def moored(self) -> "Formation":
        """This section itself, since it has the keys of the stations."""
        return self

    def radius(self, hf_range_m: float) -> float:
        """Return the radius (m) of a ring: as given, or HF range plus clearance."""
        return hf_range_m + self.clearance_m if self.radius_m is None else self.radius_m

    @property
    def is_placed(self) -> bool:
        """Whether each ASV has a position of its own."""
        return self.positions_m is not None or self.positions_deg is not None

    def misnamed(self, name: str) -> str:
        """Return how `model` contradicts the key of positions, `name`; "" if it does not."""
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
        """The placement as a part."""
        return PartChoice(self.MODEL)


class Placed(Moving):
    """ASVs that get new orders again and again, based on what the fleet knows."""

    speed_m_per_s: Real = key(
        SPEED_M_PER_S, "m/s", "speed of an ASV on its way", OURS, ge=0.001, le=20
    )
    replan_s: Real = key(REPLAN_S, "s", "interval of new orders to ASVs", OURS, ge=0.1, le=1e6)
    start_m: tuple[Point, ...] | None = key(
        None, "m", "one [x, y] per ASV where it is launched; null = its first position"
    )

    # The most AUVs that such ASVs can follow; None for any number.
    MOST_AUVS: ClassVar[int | None] = None

    @property
    def replanned(self) -> "Placed":
        """This section itself, since it has the keys of a replanned placement."""
        return self

    def miscounted(self, asvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield the list of launch positions, if it has not one per ASV."""
        if self.start_m and len(self.start_m) != asvs:
            yield "start_m", "[x, y]", len(self.start_m)


class Grouped(Placed):
    """ASVs that get new orders only where another placement is better by a margin."""

    hysteresis: Real = key(
        0.05,
        "1",
        "share by which another placement must be better to replace the present one",
        OURS,
        ge=0,
        le=1,
    )


class Ahead(Grouped):
    """ASVs that are placed for where AUVs will be."""

    horizon_s: Real = key(
        10.0,
        "s",
        "how far ahead AUVs are predicted to choose the ASVs' positions",
        OURS,
        ge=0,
        le=1e6,
    )


class Follow(Ahead):
    """ASVs stay where the farthest AUV is as near as possible (k-centre)."""

    MODEL, MOST_AUVS = "follow", 100  # these take 0.1 s to place; twice as many take seconds
    model: Literal["follow"] = "follow"
    within_m: Real | None = key(
        None,
        "m",
        "ASVs rest while each AUV is estimated within this distance of one; null = never",
        ge=0,
        le=1e5,
    )


class Assign(Ahead):
    """Each ASV stays above the middle of its own AUVs."""

    MODEL = "assign"
    model: Literal["assign"] = "assign"


class Visit(Grouped):
    """Each ASV keeps near one of its AUVs at a time: that with the largest expected error."""

    MODEL = "visit"
    model: Literal["visit"] = "visit"
    near_m: Real | None = key(
        None,
        "m",
        "an ASV rests while the AUV that it visits is estimated within this distance; null = "
        "half the HF range",
        ge=0,
        le=1e5,
    )
    dwell_s: Real = key(
        30.0, "s", "least time that an ASV stays with an AUV, once near", OURS, ge=0, le=1e6
    )


class Information(Grouped):
    """ASVs go where fixes are expected to leave the least error (Fisher information)."""

    MODEL, MOST_AUVS = "information", 100
    model: Literal["information"] = "information"
    lookahead_s: Real = key(
        30.0, "s", "how far ahead the AUVs' errors are predicted", OURS, ge=1, le=1e6
    )
    criterion: Literal["trace", "determinant"] = key(
        "trace", "", "size of a covariance: A-optimality or D-optimality", OURS
    )


class Zigzag(Grouped):
    """Each ASV sweeps to and fro over its own AUVs."""

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
        "period of a sweep; null = that of an ASV which keeps up with AUVs",
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
        """Each file with the name of the track to read from it."""
        return sources(self.files, self.tracks)

    @property
    def recording(self) -> "AsvTrack":
        """This section itself, since it has the keys of the files that ASVs repeat."""
        return self

    def miscounted(self, asvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield the lists of files and of track names that have not one entry per ASV."""
        if len(self.files) != asvs:
            yield "files", "file", len(self.files)
        if self.tracks and len(self.tracks) != asvs:
            yield "tracks", "name", len(self.tracks)


def _placed(placement: Any) -> str:
    """Return the tag of a placement's model: `moored`, `own`, or the name of one that moves."""
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
    | Annotated[Visit, Tag("visit")]
    | Annotated[Information, Tag("information")]
    | Annotated[AsvTrack, Tag("track")]
    | Annotated[OwnPlacement, Tag("own")],
    Discriminator(_placed),
]
