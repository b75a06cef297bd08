"""The keys of each kind of route: lanes over the survey, places to hold, way points, tracks; and of
placements and routes of somebody's own: sections whose other keys are the part's settings.
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Tag, model_serializer, model_validator

from ...core.plugins import is_plugin
from ..key_types import OURS, PAPER, Part, Point, Position, Real, Text, key
from ..part_choice import PartChoice

# Placements and routes of somebody's own: sections whose other keys are the part's settings.


class OwnSection(BaseModel):
    """A part named ``module:object`` at one of the section's keys, `WORD`; the others set it."""

    WORD: ClassVar[str]

    model_config = ConfigDict(frozen=True, extra="forbid")

    choice: PartChoice

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or cls.WORD not in data:
            return data
        settings = {name: value for name, value in data.items() if name != cls.WORD}
        return {"choice": PartChoice.read({"model": data[cls.WORD], **settings}, str)}

    @model_serializer
    def _written(self) -> dict[str, Any]:
        return {self.WORD: str(self.choice), **self.choice.settings}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> dict[str, Any]:
        own = {"type": "string", "pattern": "^[^:]+:[^:]+$"}
        return {"type": "object", "properties": {cls.WORD: own}, "required": [cls.WORD]}


class OwnPlacement(OwnSection):
    """Where the ASVs keep station, as somebody's own function says."""

    WORD = "model"


class OwnRoute(OwnSection):
    """Where the AUVs go, as somebody's own function says."""

    WORD = "kind"
    kind: ClassVar[Literal["own"]] = "own"
    is_flown: ClassVar[bool] = False
    is_held: ClassVar[bool] = False
    is_recorded: ClassVar[bool] = False


def is_own(section: Any, word: str) -> bool:
    """Tell whether a section names somebody's own part at one of its words."""
    if isinstance(section, OwnSection):
        return True
    name = section.get(word) if isinstance(section, Mapping) else None
    return callable(name) or (isinstance(name, str) and is_plugin(name))


# The keys of each kind of route: lanes over the survey, places to hold, way points, tracks.


class Planned(Part):
    """A kind of route that ships: AUVs fly paths that are planned (`is_flown`), lie still
    (`is_held`), or repeat what was recorded (`is_recorded`).
    """

    is_flown: ClassVar[bool] = False
    is_held: ClassVar[bool] = False
    is_recorded: ClassVar[bool] = False

    kind: str

    @property
    def choice(self) -> PartChoice:
        """The route as a part of the mission."""
        return PartChoice(self.kind)


class Flown(Planned):
    """A kind of route that AUVs fly along paths, and may leave to come up to the surface."""

    surface_every_s: Real | None = key(
        None,
        "s",
        "time on its route after which an AUV breaks off to come up to the surface in circles, and "
        "then takes it up again; null = it stays at its depth",
        ge=1,
        le=1e6,
    )
    surface_for_s: Real = key(
        10.0, "s", "how long it stays there at least: until its circles are whole", ge=0, le=1e5
    )
    climb_angle_deg: Real = key(
        20.0, "deg", "angle at which it comes up and dives again", ge=1, le=60
    )


class Lawnmower(Flown):
    """Boustrophedon lanes along x, or another heading, AUV0 at the lowest y across them."""

    is_flown = True

    kind: Literal["lawnmower"] = key("lawnmower", "", "route family", PAPER)
    lane_spacing_m: Real = key(10.0, "m", "distance between lanes", OURS, ge=0.01, le=1e5)
    end_margin_m: Real | None = key(
        None,
        "m",
        "distance from lane ends to the survey's edge; null = half the spacing",
        ge=0,
        le=1e5,
    )
    lane_heading_deg: Real | None = key(
        None,
        "deg",
        "heading of the lanes, from +x towards +y; null = along the survey's own x axis",
        ge=-360,
        le=360,
    )
    division: Literal["strips", "equal_length"] = key(
        "strips",
        "",
        "what each AUV gets: a strip of the same height, or neighbouring lanes of about the same "
        "length in all, which sweep the whole survey",
    )
    start: Literal["strip_centre", "strip_corner"] = key(
        "strip_centre", "", "where an AUV begins: its strip's centre, or its first lane's end"
    )
    turns: Literal["shortest", "bulb", "skip_lane"] = key(
        "shortest", "", "lane order: neighbours with bulb turns, skipping lanes, or the shorter"
    )


class Hold(Planned):
    """Vehicles hold still at given positions, heading along +x."""

    is_held = True

    kind: Literal["hold"] = key("hold", "", "route family")
    positions_m: tuple[Point, ...] = key((), "m", "one [x, y] per AUV")
    positions_deg: tuple[Position, ...] = key(
        (), "deg", "one [lat, lon] per AUV instead, with environment.origin (WGS-84)"
    )


class Waypoints(Flown):
    """Each AUV follows its own list of waypoints along Dubins curves, there and back."""

    is_flown = True

    kind: Literal["waypoints"] = key("waypoints", "", "route family")
    points_m: tuple[tuple[Point, ...], ...] = key((), "m", "per AUV a list of [x, y]")
    points_deg: tuple[tuple[Position, ...], ...] = key(
        (), "deg", "per AUV a list of [lat, lon] instead, with environment.origin (WGS-84)"
    )


class Track(Planned):
    """Each AUV repeats the recorded track of a real vehicle."""

    is_recorded = True

    kind: Literal["track"] = key("track", "", "route family")
    files: tuple[Text, ...] = key(
        (),
        "",
        "per AUV a CSV with columns time_s, x_m, y_m (or lat_deg, lon_deg), depth_m, a GPX or an "
        "MCAP file; relative to the scenario file",
    )
    tracks: tuple[Text, ...] = key(
        (),
        "",
        "per AUV which track of its file, where that holds several: a vehicle of a CSV, the name "
        "of a GPX track, the topic of an MCAP",
    )
    time_offset_s: Real = key(
        0.0,
        "s",
        "subtracted from the time_s of the files, such as the Unix time of the mission's start",
        ge=-1e12,
        le=1e12,
    )


def _kind(route: Any) -> Any:
    """Tell the family of a route; a route that does not say is a lawnmower."""
    if is_own(route, "kind"):
        return "own"
    if isinstance(route, dict):
        return route.get("kind", "lawnmower")
    return getattr(route, "kind", None)


Route = Annotated[
    Annotated[Lawnmower, Tag("lawnmower")]
    | Annotated[Hold, Tag("hold")]
    | Annotated[Waypoints, Tag("waypoints")]
    | Annotated[Track, Tag("track")]
    | Annotated[OwnRoute, Tag("own")],
    Discriminator(_kind),
]
