"""The keys of ASVs that fail during a mission."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from ..key_types import PAPER, Part, Point, Position, Real, Whole, key
from ..moved_keys import Moved, Section
from ..part_choice import PartChoice
from ..part_settings import Settings
from ..shipped_settings import Kinematic
from .anchors import Assign, AsvTrack, Follow, Moving, Zigzag
from .routes import Lawnmower, OwnPlacement, Route, is_own
from .vehicle_choice import AsvVehicle, AuvVehicle

Instant = Annotated[Real, Field(ge=0, le=1e9)]


class Failure(Part):
    """An ASV that from an instant on neither hears, calls nor broadcasts, for good or for a time.

    It stays where it keeps station.
    """

    asv: Whole = Field(
        ge=0,
        le=9_999,
        description="number of the ASV that fails",
        json_schema_extra={"unit": "1", "source": "this package"},
    )
    at_s: Instant = Field(
        description="instant at which it fails",
        json_schema_extra={"unit": "s", "source": "this package"},
    )
    until_s: Instant | None = key(
        None, "s", "instant from which it works again; null = it does not until the mission ends"
    )

    def lasts(self, time: float) -> bool:
        """Tell whether it has failed, and not come back, at an instant (s)."""
        return self.at_s <= time and (self.until_s is None or time < self.until_s)


# The keys of both fleets: how many, what they are, where they go and keep station.


Speed = Annotated[Real, Field(ge=0.001, le=20)]
Late = Annotated[Real, Field(ge=0, le=10)]


class Auvs(Section):
    """The underwater vehicles: how many, what they are, where they go."""

    MOVED: ClassVar = (Moved("turning_radius_m", "vehicle", "kinematic"),)

    count: Whole = key(3, "1", "number of AUVs", PAPER, ge=1, le=100_000)
    vehicle: AuvVehicle = key(
        "kinematic", "", "vehicle model, or {model: ..., coefficient or setting: value, ...}"
    )
    speed_m_per_s: Real = key(
        0.627,
        "m/s",
        "speed along the route",
        "tab:case_study (182-192 m in 300 s)",
        ge=0.001,
        le=20,
    )
    speeds_m_per_s: tuple[Speed, ...] | None = key(
        None, "m/s", "speed of each AUV; null = speed_m_per_s for all of them"
    )
    join_angle_deg: Real = key(
        20.0, "deg", "angle at which an AUV that has turned about joins a line again", ge=0.1, le=45
    )
    route: Route = Field(default=Lawnmower(), description="where the AUVs go")
    launch_m: tuple[Point, ...] | None = key(
        None,
        "m",
        "[x, y] where AUVs are launched, one for all or one per AUV: they begin there; null = as "
        "the route says",
    )
    recovery_m: tuple[Point, ...] | None = key(
        None,
        "m",
        "[x, y] where AUVs are recovered, one for all or one per AUV: once through their route "
        "they go and wait there; null = they fly it there and back",
    )
    ping_late_s: tuple[Late, ...] | None = key(
        None,
        "s",
        "how much later than its slot begins each AUV pings (owtt_sync), such as by a late clock; "
        "ranges are measured from the ping itself; null = on time",
    )
    feedback: Literal["truth", "estimate"] = key(
        "truth", "", "what guidance steers by: the true position or the fused estimate", PAPER
    )

    @property
    def turning_radius_m(self) -> float:
        """The smallest turning radius of AUVs without dynamics (m)."""
        own = Kinematic if not self.vehicle.flies_paths else Settings
        return self.vehicle.choice.settings_as(Kinematic, own).turning_radius_m

    def speed(self, auv: int) -> float:
        """Return the speed of an AUV along its route (m/s)."""
        return self.speeds_m_per_s[auv] if self.speeds_m_per_s else self.speed_m_per_s

    def launch(self, auv: int) -> Point | None:
        """Return where an AUV is launched (m); None where its route says."""
        return _of(self.launch_m, auv)

    def recovery(self, auv: int) -> Point | None:
        """Return where an AUV is recovered (m); None if it flies its route there and back."""
        return _of(self.recovery_m, auv)

    @property
    def speeds(self) -> tuple[float, ...]:
        """The speed of each AUV (m/s)."""
        return self.speeds_m_per_s or (self.speed_m_per_s,) * self.count


def _of(places: tuple[Point, ...] | None, auv: int) -> Point | None:
    """Return the place of an AUV, of one for all or one for each."""
    if not places:
        return None
    return places[0] if len(places) == 1 else places[auv]


class Formation(Part):
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
    def is_placed(self) -> bool:
        """Whether each ASV is given its own place."""
        return self.positions_m is not None or self.positions_deg is not None


MOVING = tuple(kind.MODEL for kind in (Follow, Assign, Zigzag, AsvTrack))


def _placed(placement: Any) -> str:
    """Tell how ASVs are placed: moored, moving in some way, or as somebody's own part says."""
    if is_own(placement, "model"):
        return "own"
    if isinstance(placement, Moving):
        return placement.MODEL
    model = placement.get("model") if isinstance(placement, dict) else None
    return model if model in MOVING else "moored"


Placement = Annotated[
    Annotated[Formation, Tag("moored")]
    | Annotated[Follow, Tag("follow")]
    | Annotated[Assign, Tag("assign")]
    | Annotated[Zigzag, Tag("zigzag")]
    | Annotated[AsvTrack, Tag("track")]
    | Annotated[OwnPlacement, Tag("own")],
    Discriminator(_placed),
]


class Asvs(Part):
    """The surface vessels that carry the USBL arrays."""

    @property
    def told(self) -> str:
        """What they are in a word: their model, or how they move."""
        moves = isinstance(self.formation, Moving)
        return self.formation.choice if moves else str(self.vehicle)

    count: Whole = key(3, "1", "number of ASVs", PAPER, ge=1, le=10_000)
    vehicle: AsvVehicle = key(
        "moored", "", "vessel model, or {model: ..., coefficient: value, ...}"
    )
    formation: Placement = Field(
        default=Formation(), description="where the ASVs keep station, or go"
    )
    failures: tuple[Failure, ...] = key(
        (), "", "ASVs that fail: from at_s on, until until_s, they neither hear, call nor broadcast"
    )
