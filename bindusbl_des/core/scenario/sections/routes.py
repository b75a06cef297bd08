"""The keys of each kind of route: lanes, held positions, waypoints, tracks, user-defined routes."""

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self, Union

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Tag,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ....support.plugins import Family, is_plugin
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


class OwnSection(BaseModel):
    """A section that names a user-defined part at its key `WORD`; its other keys are settings."""

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


def is_own(section: Any, word: str) -> bool:
    """Tell whether a section names a user-defined part at the key `word`."""
    if isinstance(section, OwnSection):
        return True
    name = section.get(word) if isinstance(section, Mapping) else None
    return callable(name) or (isinstance(name, str) and is_plugin(name))


def sections_of(family: Family[Any], own: type[OwnSection], tag: Callable[[Any], Any]) -> Any:
    """Return the type of a key at which a section names a part: one of the family's sections, or
    its `own` one, as the `tag` of what is given says.

    Raises:
        TypeError: when a section and the list of parts differ in the name of a part.
    """
    tags = {own: "own"}
    for name in family.parts:
        section = family.part(name)
        given = section.model_fields[family.word].default
        if given not in (name, None):
            raise TypeError(
                f"{family.name_key}: {name!r} in families.py is {section.__name__}, whose "
                f"{family.word} is {given!r}; give both the same name"
            )
        tags.setdefault(section, name)
    arms = [Annotated[section, Tag(name)] for section, name in tags.items()]
    return Annotated[Union[(*arms[1:], arms[0])], Discriminator(tag)]


# A function from positions (latitude, longitude, deg) to points x, y (m).
InMetres = Callable[[tuple[Position, ...]], tuple[Point, ...]]


class RouteTraits:
    """What the program asks of a route.

    AUVs fly planned paths (`is_flown`), hold positions (`is_held`), or repeat tracks
    (`is_recorded`).  A route that `is_worked_out` from a plan answers by `ways`, as a user-defined
    one does.  `PLACES` is the key of the route's positions, without the unit; "" without
    positions.
    """

    PLACES: ClassVar[str] = ""
    is_flown: ClassVar[bool] = False
    is_held: ClassVar[bool] = False
    is_recorded: ClassVar[bool] = False
    is_worked_out: ClassVar[bool] = False

    def ways(self, view: Any) -> Any:
        """Return for each AUV its way points (n, 2), m, or its track (n, 4): time in s, x, y and
        depth in m, for a plan (:class:`..own_routes.PlanView`).
        """
        return None

    @property
    def lanes(self) -> "Lawnmower | None":
        """The keys of the lanes that sweep the survey; None without lanes."""
        return None

    @property
    def recording(self) -> "Track | None":
        """The keys of the files that AUVs repeat; None without."""
        return None

    @property
    def surfacing(self) -> "Flown | None":
        """The keys of ascents to the surface; None without."""
        return None

    @property
    def is_rounded(self) -> bool:
        """Whether AUVs cut the corners of their route instead of passing over each point."""
        return False

    @property
    def places_key(self) -> str:
        """The key of the route's positions, with the unit."""
        return f"{self.PLACES}_{'deg' if self.positions else 'm'}"

    @property
    def places(self) -> tuple[tuple[Point, ...], ...]:
        """For each AUV its waypoints, or the position it holds, [x, y] in m; else empty."""
        return ()

    @property
    def positions(self) -> tuple[tuple[Position, ...], ...]:
        """For each AUV the same as [lat, lon] in deg, where given so; else empty."""
        return ()

    def in_metres(self, metres: InMetres) -> Self:
        """Return the route with its positions in metres."""
        return self

    def miscounted(self, auvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield each list that has not one entry per AUV: its key, what an entry is, its length."""
        yield from ()


class OwnRoute(RouteTraits, OwnSection):
    """A user-defined route."""

    WORD = "kind"
    is_worked_out: ClassVar[bool] = True


class Planned(RouteTraits, Part):
    """A shipped kind of route."""

    kind: str

    @property
    def choice(self) -> PartChoice:
        """The route as a part."""
        return PartChoice(self.kind)


class Flown(Planned):
    """A kind of route that AUVs fly along paths; they may leave it to surface."""

    surface_every_s: Real | None = key(
        None,
        "s",
        "time on its route after which an AUV surfaces in circles, and then resumes the "
        "route; null = it stays at its depth",
        ge=1,
        le=1e6,
    )
    surface_for_s: Real = key(
        10.0, "s", "least time at the surface; it ends with a full circle", ge=0, le=1e5
    )
    climb_angle_deg: Real = key(20.0, "deg", "angle of climb and dive", ge=1, le=60)

    @property
    def surfacing(self) -> "Flown | None":
        """This section itself where AUVs come up to the surface; None otherwise."""
        return None if self.surface_every_s is None else self


class Lawnmower(Flown):
    """Boustrophedon lanes, along x or another heading; AUV0 has the lowest y across them."""

    is_flown: ClassVar[bool] = True

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
        "each AUV's part: a strip of equal height, or neighbouring lanes of about equal total "
        "length, which cover the whole survey",
    )
    start: Literal["strip_centre", "strip_corner"] = key(
        "strip_centre", "", "where an AUV begins: its strip's centre, or its first lane's end"
    )
    turns: Literal["shortest", "bulb", "skip_lane"] = key(
        "shortest", "", "lane order: neighbours with bulb turns, skipping lanes, or the shorter"
    )

    inside: bool | None = key(
        None,
        "",
        "whether lanes that leave the area and return are split at its edges; null = only if "
        "the area is not convex",
    )

    @property
    def lanes(self) -> "Lawnmower":
        """This section itself, since it has the keys of the lanes."""
        return self


class Hold(Planned):
    """AUVs hold given positions, heading along +x."""

    PLACES: ClassVar[str] = "positions"
    is_held: ClassVar[bool] = True

    kind: Literal["hold"] = key("hold", "", "route family")
    positions_m: tuple[Point, ...] = key((), "m", "one [x, y] per AUV")
    positions_deg: tuple[Position, ...] = key(
        (), "deg", "one [lat, lon] per AUV instead, with environment.origin (WGS-84)"
    )

    @property
    def places(self) -> tuple[tuple[Point, ...], ...]:
        """For each AUV the position that it holds, [x, y] in m."""
        return tuple((place,) for place in self.positions_m)

    @property
    def positions(self) -> tuple[tuple[Position, ...], ...]:
        """For each AUV the same as [lat, lon] in deg, where given so."""
        return tuple((position,) for position in self.positions_deg)

    def in_metres(self, metres: InMetres) -> Self:
        """Return the route with its positions in metres."""
        given = {"positions_m": metres(self.positions_deg), "positions_deg": ()}
        return self.model_copy(update=given)

    def miscounted(self, auvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield the list of positions, if it has not one per AUV."""
        name, each, given = "positions_m", "[x, y]", len(self.positions_m)
        if self.positions_deg:
            name, each, given = "positions_deg", "[lat, lon]", len(self.positions_deg)
        if given != auvs:
            yield name, each, given


# The description of `files`, a key of two kinds of routes.
RECORDED_OR_DRAWN = (
    "tracks, one per AUV: CSV with columns time_s, x_m, y_m (or lat_deg, lon_deg), depth_m, GPX or "
    "MCAP; of waypoints, instead of points, charts that together hold a line for each AUV: GPX (a "
    "route, rte, as in the plan.gpx of a plan), KML, KMZ, GeoJSON, QGroundControl .plan, "
    "shapefile, GeoPackage, DXF; relative to the scenario file"
)


class Waypoints(Flown):
    """Each AUV follows its waypoints along Dubins curves, there and back; or a line of a chart.

    Along a line of a chart it cuts the corners, as autopilots do.
    """

    PLACES: ClassVar[str] = "points"
    is_flown: ClassVar[bool] = True

    kind: Literal["waypoints"] = key("waypoints", "", "route family")
    points_m: tuple[tuple[Point, ...], ...] = key((), "m", "per AUV a list of [x, y]")
    points_deg: tuple[tuple[Position, ...], ...] = key(
        (), "deg", "per AUV a list of [lat, lon] instead, with environment.origin (WGS-84)"
    )
    crs: Text | None = key(
        None, "", "code of the grid of the files, such as EPSG:32760, where they name none"
    )
    routes: tuple[Text, ...] = key(
        (), "", "per AUV the name of its line in the files; none = all their lines in their order"
    )
    files: tuple[Text, ...] = key((), "", RECORDED_OR_DRAWN)

    @field_validator("files")
    @classmethod
    def _readable(cls, files: tuple[str, ...], others: ValidationInfo) -> tuple[str, ...]:
        _routes(files, others.data.get("crs"), others.data.get("routes", ()))
        return files

    # The points of the lines in the files: latitude and longitude (deg).
    _routes_deg: tuple[tuple[Position, ...], ...] = ()

    @model_validator(mode="after")
    def _read(self) -> Self:
        if self.files and (self.points_m or self.points_deg):
            raise PydanticCustomError("twice", "gives points beside files; keep one of them")
        self._routes_deg = _routes(self.files, self.crs, self.routes)
        return self

    @property
    def is_rounded(self) -> bool:
        """Whether AUVs cut the corners of their route instead of passing over each point."""
        return bool(self.files)

    @property
    def places_key(self) -> str:
        """The key of the waypoints, with the unit; or `files`."""
        return "files" if self.files else super().places_key

    @property
    def places(self) -> tuple[tuple[Point, ...], ...]:
        """For each AUV its waypoints, [x, y] in m."""
        return self.points_m

    @property
    def positions(self) -> tuple[tuple[Position, ...], ...]:
        """For each AUV the same as [lat, lon] in deg, where given so."""
        return self._routes_deg or self.points_deg

    def in_metres(self, metres: InMetres) -> Self:
        """Return the route with its waypoints in metres."""
        given = {"points_m": tuple(map(metres, self.positions)), "points_deg": ()}
        found = self.model_copy(update=given)
        found._routes_deg = ()
        return found

    def miscounted(self, auvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield the list of routes, if it has not one per AUV."""
        given = len(self.positions or self.points_m)
        if given != auvs:
            yield self.places_key, "line" if self.files else "list of points", given


def _routes(
    files: tuple[str, ...], crs: str | None, names: tuple[str, ...]
) -> tuple[tuple[Position, ...], ...]:
    """Return the lines of charts, all or those named, as latitude and longitude (deg)."""
    from ....models.charts.areas import named_route, read_routes  # which other routes do not need

    try:
        found = [route for file in files for route in read_routes(file, crs or "")]
        routes = [named_route(found, name) for name in names] if files and names else found
    except ValueError as error:
        raise PydanticCustomError("file", "{message}", {"message": str(error)}) from None
    return tuple(route.points for route in routes)


class Track(Planned):
    """Each AUV repeats the recorded track of a real vehicle."""

    is_recorded: ClassVar[bool] = True

    kind: Literal["track"] = key("track", "", "route family")
    files: tuple[Text, ...] = key((), "", RECORDED_OR_DRAWN)
    tracks: tuple[Text, ...] = which_tracks("AUV")
    time_offset_s: Real = TIME_OFFSET_S

    @property
    def sources(self) -> list[tuple[str, str]]:
        """Each file with the name of the track to read from it."""
        return sources(self.files, self.tracks)

    @property
    def recording(self) -> "Track":
        """This section itself, since it has the keys of the files that AUVs repeat."""
        return self

    def miscounted(self, auvs: int) -> Iterator[tuple[str, str, int]]:
        """Yield the lists of files and of track names that have not one entry per AUV."""
        if self.tracks and len(self.tracks) != auvs:
            yield "tracks", "name", len(self.tracks)
        if len(self.files) != auvs:
            yield "files", "file", len(self.files)


def kind_of(route: Any) -> Any:
    """Return the tag of a route: `own`, or its kind; by default `lawnmower`."""
    if is_own(route, "kind"):
        return "own"
    if isinstance(route, dict):
        return route.get("kind", "lawnmower")
    return getattr(route, "kind", None)
