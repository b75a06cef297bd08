"""The keys of both fleets: number, vehicle models, routes, stations, failures, groups."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from ....support.plugins import is_plugin
from ....support.wording import described, did_you_mean
from ..families import ASV, AUV, PLACEMENT, ROUTE, HullTraits
from ..key_types import PAPER, Moved, Part, Point, Real, Section, Whole, key
from ..part_choice import PartChoice
from ..shipped_settings import Sailboat
from .navigation import Drift, Navigation
from .placements import Formation, OwnPlacement, Shipped, placed
from .routes import Lawnmower, OwnRoute, Planned, kind_of, sections_of
from .survey import Survey
from .usbl import ArrayChoice, UsblName, UsblSection

if TYPE_CHECKING:
    Route = Planned | OwnRoute
    Placement = Formation | Shipped | OwnPlacement
else:
    Route = sections_of(ROUTE, OwnRoute, kind_of)
    Placement = sections_of(PLACEMENT, OwnPlacement, placed)


@dataclass(frozen=True)
class VehicleChoice:
    """A vehicle model by name, with coefficients that differ from the published ones.

    In a file it is the name, or a mapping: ``{model: remus100, yaw_time_constant_s: 5}``.  `part`
    is a vehicle with settings: one without dynamics, or a user-defined one, named
    ``module:object``.
    """

    MODELS: ClassVar[Mapping[str, HullTraits]] = {}

    model: str
    coefficients: tuple[tuple[str, float], ...] = ()
    part: PartChoice | None = None

    def __str__(self) -> str:
        return self.model + ("*" if self.coefficients or (self.own and self.own.settings) else "")

    @property
    def own(self) -> PartChoice | None:
        """The vehicle as a part if it is user-defined; else None."""
        return self.part if self.part is not None and self.part.is_own else None

    @property
    def choice(self) -> PartChoice:
        """The vehicle as a part."""
        return self.part or PartChoice(self.model)

    @property
    def is_steered(self) -> bool:
        """Whether the vehicle only roughly follows its plan: by dynamics, or as user-defined."""
        return self.has_dynamics or self.sails or self.own is not None

    @property
    def has_dynamics(self) -> bool:
        """Whether the vehicle moves by equations of motion."""
        return self.own is None and self.MODELS[self.model].has_dynamics

    @property
    def sails(self) -> bool:
        """Whether the wind drives the vehicle."""
        return self.own is None and self.MODELS[self.model].sails

    @property
    def sailing(self) -> Sailboat:
        """The settings of a vehicle that sails."""
        return self.choice.settings_as(Sailboat, Sailboat)

    @property
    def top_speed(self) -> float:
        """The speed (m/s) straight ahead through still water at full command, or by sail."""
        if self.sails:
            return self.sailing.most_m_per_s
        from ...vehicles.guidance.departure import top_speed

        return top_speed(self.model, dict(self.coefficients))

    def steepest_climb(self, speed: float) -> float:
        """Return how steeply (m/m) a hull climbs at a speed (m/s) in still water."""
        from ...vehicles.guidance.climbing import steepest_climb

        return steepest_climb(self.model, speed, self.coefficients)

    def carried_away(
        self, speeds: Sequence[float], currents: Sequence[float]
    ) -> tuple[int, str] | None:
        """Return the first vehicle (index) that its current (m/s) carries away, and why; else None.

        `speeds` (m/s) are those asked of the vehicles.
        """
        from ...vehicles.guidance.departure import too_strong

        return too_strong(self.model, dict(self.coefficients), speeds, currents)

    @classmethod
    def read(cls, value: Any) -> Self:
        """Return the choice that a value of a file means.

        Raises:
            PydanticCustomError: naming the rule, the value and the remedy.
        """
        if isinstance(value, cls):
            return value
        if _is_own(value):
            own = PartChoice.read(value, str)
            return cls(str(own), part=own)
        if isinstance(value, str):
            return cls(cls._known(value))
        if not isinstance(value, Mapping) or "model" not in value:
            raise _mistake(
                f"must be one of {', '.join(cls.MODELS)}, or a mapping with `model` and "
                f"coefficients; got {described(value)}"
            )
        model = cls._known(value["model"])
        changes = {str(name): number for name, number in value.items() if name != "model"}
        if not cls.MODELS[model].has_dynamics:  # nor coefficients
            return cls(
                model, part=PartChoice.read({**value, "model": model}, str) if changes else None
            )
        for name, number in changes.items():
            others = [
                other for other, hull in cls.MODELS.items() if name in hull.settings.model_fields
            ]
            if others:
                raise _mistake(
                    f"{name}: remove it, or choose {others[0]}, {model} has no such setting"
                )
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise _mistake(f"{name} must be a number; got {described(number)}")
            if not math.isfinite(number):
                raise _mistake(f"{name} must be finite; got {described(number)}")
        if changes:
            from ...vehicles.hulls.fleet import parameters

            try:
                parameters(model, changes)
            except ValueError as error:
                raise _mistake(str(error)) from None
        return cls(model, tuple((name, float(number)) for name, number in changes.items()))

    @classmethod
    def _known(cls, name: Any) -> str:
        if not isinstance(name, str) or name not in cls.MODELS:
            hint = did_you_mean(str(name), cls.MODELS)
            raise _mistake(f"must be one of {', '.join(cls.MODELS)}; got {described(name)}{hint}")
        return name

    def plain(self) -> "str | dict[str, Any]":
        """Return the choice as a file has it."""
        if self.part is not None:
            return self.part.plain()
        return {"model": self.model, **dict(self.coefficients)} if self.coefficients else self.model

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            cls.read,
            serialization=core_schema.plain_serializer_function_ser_schema(lambda v: v.plain()),
        )

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: Any) -> dict[str, Any]:
        names = {"enum": list(cls.MODELS), "type": "string"}
        mapping = {
            "type": "object",
            "properties": {"model": names},
            "required": ["model"],
            "additionalProperties": {"type": "number"},
        }
        own = {"type": "string", "pattern": "^[^:]+:[^:]+$"}
        mine = {"type": "object", "properties": {"model": own}, "required": ["model"]}
        return {"anyOf": [names, mapping, own, mine]}


class AuvVehicle(VehicleChoice):
    """The model of an underwater vehicle."""

    MODELS = AUV.traits


class AsvVehicle(VehicleChoice):
    """The model of a surface vessel."""

    MODELS = ASV.traits


def _is_own(value: Any) -> bool:
    name = value.get("model") if isinstance(value, Mapping) else value
    return callable(name) or (isinstance(name, str) and is_plugin(name))


def _mistake(text: str) -> PydanticCustomError:
    return PydanticCustomError("vehicle", "{text}", {"text": text})


Instant = Annotated[Real, Field(ge=0, le=1e9)]


class Failure(Part):
    """A failure of an ASV: it neither hears, calls nor broadcasts, for a time or for good.

    The ASV stays at its station.
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
    until_s: Instant | None = key(None, "s", "instant from which it works again; null = never")

    def lasts(self, time: float) -> bool:
        """Tell whether the ASV is failed at an instant (s)."""
        return self.at_s <= time and (self.until_s is None or time < self.until_s)


class Altitude(Part):
    """A height above the bottom that AUVs keep, beside the depth that `survey.depth_m` is."""

    altitude_m: Real | None = key(
        None,
        "m",
        "height above the bottom (environment.bathymetry) at which AUVs go; null = at "
        "survey.depth_m",
        ge=0.1,
        le=11e3,
    )
    shallowest_m: Real = key(
        1.0, "m", "depth above which AUVs do not rise to keep it", ge=0, le=1e3
    )
    climb_angle_deg: Real = key(
        20.0,
        "deg",
        "steepest climb and dive of AUVs without dynamics, which know the bottom and climb early; "
        "others follow what is below them, as their autopilots can",
        ge=1,
        le=60,
    )


Speed = Annotated[Real, Field(ge=0.001, le=20)]
Late = Annotated[Real, Field(ge=0, le=10)]


class Auvs(Section):
    """The underwater vehicles: how many, which model, where they go."""

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
    depth: Altitude = Field(
        default=Altitude(), description="an altitude that AUVs keep, instead of a depth"
    )
    join_angle_deg: Real = key(
        20.0, "deg", "angle at which an AUV rejoins a line after it has turned about", ge=0.1, le=45
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
        "[x, y] where AUVs are recovered, one for all or one per AUV: at the end of their "
        "route they go there and wait; null = they repeat the route there and back",
    )
    endurance_s: Real | None = key(
        None,
        "s",
        "how long AUVs can be in the water, for instance by their batteries; a longer mission "
        "only causes a warning; null = no limit",
        ge=1,
        le=1e7,
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

    groups: tuple["AuvGroup", ...] = key(
        (),
        "",
        "groups of AUVs that differ, in the order of their numbers; a group has the common "
        "values of keys that it does not give",
    )

    @field_validator("depth", mode="before")
    @classmethod
    def _no_altitude(cls, depth: Any) -> Any:
        """Read `depth: null` as no altitude."""
        return {} if depth is None else depth

    @property
    def words(self) -> str:
        """The vehicle model in words, or how many AUVs are of which model."""
        counts = Counter[str]()
        for group in self.groups:
            counts[str(group.vehicle or self.vehicle)] += group.count
        if len(counts) < 2:
            return next(iter(counts), str(self.vehicle))
        return ", ".join(f"{count} {model}" for model, count in counts.items())

    @model_validator(mode="after")
    def _counted(self) -> Self:
        """Set the number of AUVs to that of the groups, unless it is given."""
        if self.groups:
            self.otherwise(count=sum(group.count for group in self.groups))
        return self


def _as_of(section: type[Part], name: str) -> Any:
    """Return the field of a group for a key of `section`; its default, null, means as for all."""
    of = section.model_fields[name]
    bounds = {
        sign: getattr(limit, sign)
        for limit in of.metadata
        for sign in ("gt", "ge", "lt", "le")
        if getattr(limit, sign, None) is not None
    }
    return Field(
        default=None,
        description=f"{(of.description or '').partition('; null = ')[0]}; null = as for all",
        json_schema_extra=of.json_schema_extra,
        **bounds,
    )


class AuvGroup(Part):
    """Equal AUVs of a fleet; a null key has the value for all AUVs."""

    count: Whole = Field(
        ge=1,
        le=100_000,
        description="number of AUVs of the group",
        json_schema_extra={"unit": "1", "source": "this package"},
    )
    vehicle: AuvVehicle | None = _as_of(Auvs, "vehicle")
    speed_m_per_s: Real | None = _as_of(Auvs, "speed_m_per_s")
    depth_m: Real | None = _as_of(Survey, "depth_m")
    depth: Altitude | None = Field(
        default=None,
        description="an altitude that the AUVs of the group keep; null = as for all, or depth_m, "
        "if the group has one",
    )
    join_angle_deg: Real | None = _as_of(Auvs, "join_angle_deg")
    route: Route | None = Field(
        default=None,
        description="where the AUVs of the group go; null = they share the route of all the others "
        "that have none of their own",
    )
    launch_m: tuple[Point, ...] | None = _as_of(Auvs, "launch_m")
    recovery_m: tuple[Point, ...] | None = _as_of(Auvs, "recovery_m")
    endurance_s: Real | None = _as_of(Auvs, "endurance_s")
    feedback: Literal["truth", "estimate"] | None = _as_of(Auvs, "feedback")
    drift: Drift | None = Field(
        default=None,
        description="drift as an inertial system's data sheet has it; null = as for all",
    )
    velocity_bias_m_per_s: Point | None = _as_of(Navigation, "velocity_bias_m_per_s")
    velocity_bias_sd_m_per_s: Real | None = _as_of(Navigation, "velocity_bias_sd_m_per_s")
    velocity_bias_time_constant_s: Real | None = _as_of(Navigation, "velocity_bias_time_constant_s")
    scale_factor_sd: Real | None = _as_of(Navigation, "scale_factor_sd")
    heading_sd_deg: Real | None = _as_of(Navigation, "heading_sd_deg")
    random_walk_m_per_sqrt_s: Real | None = _as_of(Navigation, "random_walk_m_per_sqrt_s")


Auvs.model_rebuild()


class AsvUsbl(Part):
    """The USBL of the vessels of a group; a null key has the value for all vessels."""

    preset: UsblName | None = _as_of(UsblSection, "preset")
    model: PartChoice | None = _as_of(UsblSection, "model")
    array: ArrayChoice | None = _as_of(UsblSection, "array")
    tdoa_sd_s: Real | None = _as_of(UsblSection, "tdoa_sd_s")
    travel_time_sd_s: Real | None = _as_of(UsblSection, "travel_time_sd_s")
    quantum_s: Real | None = _as_of(UsblSection, "quantum_s")
    roll_sd_deg: Real | None = _as_of(UsblSection, "roll_sd_deg")
    pitch_sd_deg: Real | None = _as_of(UsblSection, "pitch_sd_deg")
    heading_sd_deg: Real | None = _as_of(UsblSection, "heading_sd_deg")
    gnss_sd_m: Real | None = _as_of(UsblSection, "gnss_sd_m")


class AsvGroup(Part):
    """Equal vessels of a fleet; a null key has the value for all vessels."""

    count: Whole = Field(
        ge=1,
        le=10_000,
        description="number of ASVs of the group",
        json_schema_extra={"unit": "1", "source": "this package"},
    )
    vehicle: AsvVehicle | None = Field(
        default=None,
        description="vessel model; null = as for all",
        json_schema_extra={"unit": "", "source": "this package"},
    )
    speed_m_per_s: Speed | None = key(
        None, "m/s", "speed of the vessels of the group, of a placement that moves; null = as it "
        "says for all",
    )  # fmt: skip
    usbl: AsvUsbl | None = Field(
        default=None,
        description="what of their USBL differs from `usbl`; null = nothing",
    )


class Asvs(Part):
    """The surface vessels that carry the USBL arrays."""

    @property
    def words(self) -> str:
        """The vessel model in words, or how the ASVs move."""
        placement, counts = self.formation, Counter[str]()
        for group in self.groups:
            counts[str(group.vehicle or self.vehicle)] += group.count
        if not placement.moves and len(counts) > 1:
            return ", ".join(f"{count} {model}" for model, count in counts.items())
        return placement.choice if placement.moves else next(iter(counts), str(self.vehicle))

    def alive(self, time: float) -> tuple[bool, ...]:
        """Return for each ASV whether it works at an instant (s)."""
        failed = {failure.asv for failure in self.failures if failure.lasts(time)}
        return tuple(asv not in failed for asv in range(self.count))

    count: Whole = key(3, "1", "number of ASVs; 0 = AUVs alone", PAPER, ge=0, le=10_000)
    vehicle: AsvVehicle = key(
        "moored", "", "vessel model, or {model: ..., coefficient: value, ...}"
    )
    formation: Placement = Field(
        default=Formation(), description="where the ASVs keep station, or go"
    )
    failures: tuple[Failure, ...] = key(
        (), "", "ASVs that fail: from at_s on, until until_s, they neither hear, call nor broadcast"
    )
    groups: tuple[AsvGroup, ...] = key(
        (),
        "",
        "ASVs that differ, group by group in the order of their numbers; what a group does not say "
        "is as it is for all",
    )

    @model_validator(mode="after")
    def _counted(self) -> Self:
        """Set the number of ASVs to that of the groups, unless it is given."""
        if self.groups:
            self.otherwise(count=sum(group.count for group in self.groups))
        return self
