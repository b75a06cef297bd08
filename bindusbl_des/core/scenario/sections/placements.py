"""The keys of placements of ASVs: stations, tracks, user-defined ones, and what all have that are
replanned (:mod:`....models.placements`).
"""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal

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
    """What the program asks of a placement: do ASVs keep station, get orders, or repeat tracks?

    One that ships and keeps stations answers by `stations`, as a user-defined one does.
    """

    moves: ClassVar[bool] = False

    @property
    def moored(self) -> "Formation | None":
        """The keys of the stations; None where ASVs move, or a user-defined part places them."""
        return None

    @property
    def replanned(self) -> "Placed | None":
        """The keys of a placement that sends ASVs elsewhere during the mission; None otherwise."""
        return None

    def stations(self, view: Any) -> Any:
        """Return places (m, 2), m, where ASVs are to keep station, for a plan
        (:class:`..own_routes.PlanView`).
        """
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


class Shipped(PlacementTraits, Part):
    """A placement that ships, which its `model` names."""

    if TYPE_CHECKING:  # each has its own, among its keys
        model: str

    @property
    def choice(self) -> PartChoice:
        """The placement as a part."""
        return PartChoice(self.model)


class Moving(Shipped):
    """ASVs that keep no station."""

    moves: ClassVar[bool] = True


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

    @abstractmethod
    def mover(self, site: Any, errors: Callable[[], Any]) -> Any:
        """Return what gives the ASVs of a mission their targets, made anew: an object
        of :class:`...protocol.anchors.view.Mover`.  `errors` returns what is expected of the fixes
        of each ASV, as :class:`...protocol.anchors.information.FixErrors`.
        """

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


class AsvTrack(Moving):
    """Each ASV repeats the recorded track of a real vessel."""

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


def placed(placement: Any) -> str:
    """Return the tag of a placement: `own`, its name, or else `ring`, also with positions."""
    if is_own(placement, "model"):
        return "own"
    if isinstance(placement, Mapping):
        model = placement.get("model")
    else:
        model = getattr(placement, "choice", None)
    known = PLACEMENT.traits.get(model) if isinstance(model, str) else None
    return "ring" if known in (None, Formation) else str(model)
