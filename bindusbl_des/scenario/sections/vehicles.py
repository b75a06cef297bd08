"""The keys of ASVs that fail during a mission."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from ..key_types import PAPER, Part, Point, Real, Whole, key
from ..moved_keys import Moved, Section
from ..part_settings import Settings
from ..shipped_settings import Kinematic
from .placements import Formation, Placement
from .routes import Lawnmower, Route
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
        own = Settings if self.vehicle.own else self.vehicle.MODELS[self.vehicle.model].settings
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


class Asvs(Part):
    """The surface vessels that carry the USBL arrays."""

    @property
    def words(self) -> str:
        """What they are in a word: their model, or how they move."""
        placement = self.formation
        return placement.choice if placement.moves else str(self.vehicle)

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
