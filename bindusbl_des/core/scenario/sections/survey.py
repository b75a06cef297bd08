"""The keys of the survey: area, land, depth; and the duration of a mission."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import (
    Discriminator,
    Field,
    PlainSerializer,
    PrivateAttr,
    Tag,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ..key_types import PAPER, Part, Point, Position, Real, Text, key

Side = Annotated[Real, Field(ge=0.1, le=1e5)]
Depth = Annotated[Real, Field(ge=0, le=11e3)]
PositionRings = tuple[tuple[Position, ...], ...]

# Polygons, or a file of them
Polygons = Annotated[
    Annotated[Text, Tag("file")] | Annotated[tuple[tuple[Point, ...], ...], Tag("polygons")],
    Discriminator(lambda value: "file" if isinstance(value, str) else "polygons"),
]

# The keys that define the area: exactly one applies, by default the first.
SHAPES = ("side_m", "size_m", "polygon_m", "polygon_deg", "area")


# Keys that name charts of polygons
CHARTS = ("area", "land", "keep_out")


class Survey(Part):
    """The area to be surveyed, a square, rectangle or polygon, and the depth of the AUVs."""

    side_m: Real | None = key(
        140.0, "m", "side L of the square survey area; null with another shape", PAPER, ge=0.1,
        le=1e5,
    )  # fmt: skip
    size_m: tuple[Side, Side] | None = key(
        None, "m", "[x, y]: sides of a rectangular survey area along x and y before its rotation"
    )
    rotation_deg: Real = key(
        0.0, "deg", "rotation of square or rectangle about its centre, from +x towards +y",
        ge=-360, le=360,
    )  # fmt: skip
    polygon_m: tuple[Point, ...] | None = key(
        None, "m", "corners [x, y] of a survey area that is a simple polygon, in order"
    )
    polygon_deg: tuple[Position, ...] | None = key(
        None,
        "deg",
        "corners [lat, lon] of a survey area that is a simple polygon, going round; x and y are "
        "about environment.origin, or else about its centroid",
    )
    crs: Text | None = key(
        None, "", "code of the grid of the file `area`, such as EPSG:32760, where that names none"
    )
    area_name: Text | None = key(
        None, "", "name of the polygon in the file `area` that is the survey, if it has several"
    )
    area: Text | None = key(
        None,
        "",
        "chart with the polygon of the survey area: GeoJSON, KML, KMZ, GPX (a route around it), "
        "shapefile, GeoPackage, DXF, QGroundControl .plan; relative to the scenario file; x and y "
        "are about environment.origin, or else about its centroid",
    )
    land: Polygons | None = key(
        None,
        "",
        "land, besides holes of the area: polygons, each a list of corners [x, y] in m, or a "
        "chart of them as for the area; it stops vehicles and sound",
    )
    keep_out: Polygons | None = key(
        None,
        "",
        "water that vehicles must not enter, such as a fairway, given like land; sound passes it",
    )
    depth_m: Real = key(10.0, "m", "depth at which the AUVs fly", PAPER, ge=0, le=11e3)
    depths_m: tuple[Depth, ...] | None = key(
        None, "m", "depth of each AUV; null = depth_m for all of them"
    )
    swath_m: Annotated[Real, Field(ge=0.01, le=1e5)] | None = key(
        None,
        "m",
        "width of the strip that an AUV surveys, which gives the area covered; null = the "
        "spacing of the lanes",
    )

    # The polygons of each key, latitude and longitude (deg), as given or read from a chart
    _charted: Mapping[str, tuple[PositionRings, ...]] = PrivateAttr(default_factory=dict)

    @field_validator("area", "land", "keep_out")
    @classmethod
    def _readable(cls, given: Any, others: ValidationInfo) -> Any:
        if isinstance(given, str):
            _read(others.field_name or "", given, others.data)
        return given

    @model_validator(mode="after")
    def _one_shape(self) -> "Survey":
        """Let another shape replace the default square, and read charts."""
        given = [name for name in SHAPES[1:] if getattr(self, name) is not None]
        if given and "side_m" not in self.model_fields_set:
            self.__dict__["side_m"] = None
        keys = {name: getattr(self, name) for name in ("crs", "area_name", *CHARTS)}
        files = [name for name in CHARTS if isinstance(keys[name], str)]
        charted = {name: _read(name, keys[name], keys) for name in files}
        for name in {*files} - {"area"}:  # a chart with several polygons has the area as well
            own = charted.get("area", ())
            others = [polygon for polygon in charted[name] if polygon not in own]
            charted[name] = tuple(others) or charted[name]
        if self.area is None and self.polygon_deg is not None:
            charted["area"] = ((self.polygon_deg,),)
        self._charted = charted
        return self

    @property
    def corners_deg(self) -> tuple[Position, ...]:
        """The corners of the area, latitude and longitude (deg); none of an area in metres."""
        area = self.charted("area")
        return area[0][0] if area else ()

    def charted(self, name: str) -> tuple[PositionRings, ...]:
        """Return the polygons in degrees at a key: `area`, `land` or `keep_out`.

        Each is its corners and those of its holes, latitude and longitude (deg).  Polygons given in
        metres are left out.
        """
        return self._charted.get(name, ())

    @property
    def shapes(self) -> tuple[str, ...]:
        """The keys given that define the area; a scenario with any number but one is refused."""
        return tuple(name for name in SHAPES if getattr(self, name) is not None)

    @property
    def deepest(self) -> float:
        """The greatest depth (m) of an AUV by these keys."""
        return max(self.depths_m) if self.depths_m else self.depth_m

    def depth(self, auv: int) -> float:
        """Return the depth (m) of an AUV by these keys."""
        return self.depths_m[auv] if self.depths_m else self.depth_m


def _read(key: str, file: str, others: Mapping[str, Any]) -> tuple[PositionRings, ...]:
    """Return the polygons in the chart at a key; `others` holds the keys `crs` and `area_name`."""
    from ....models.charts.areas import read_land, read_rings  # not for other surveys

    crs, name = others.get("crs") or "", others.get("area_name") or ""
    try:
        return (read_rings(file, crs, name),) if key == "area" else read_land(file, crs)
    except ValueError as error:
        raise PydanticCustomError("file", "{message}", {"message": str(error)}) from None


SURVEY = "survey"
SHORTEST_S, LONGEST_S = 0.001, 1e7


class SurveyEnd(float):
    """The duration (s) of a mission that ends with its survey; in a file, the word `survey`.

    It is NaN until the survey is planned.
    """


def _read_duration(value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
    if isinstance(value, str) and value == SURVEY:
        return SurveyEnd("nan")
    return value if isinstance(value, SurveyEnd) else validate(value)


Duration = Annotated[
    Real,
    Field(ge=SHORTEST_S, le=LONGEST_S),
    WrapValidator(_read_duration),
    PlainSerializer(lambda value: SURVEY if isinstance(value, SurveyEnd) else value),
    WithJsonSchema(
        {"anyOf": [{"type": "number", "minimum": SHORTEST_S, "maximum": LONGEST_S},
                   {"const": SURVEY}]}
    ),
]  # fmt: skip
