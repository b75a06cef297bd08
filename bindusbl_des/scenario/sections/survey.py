"""The keys of the survey: where the AUVs work."""

from typing import Annotated

from pydantic import Field, model_validator

from ..key_types import PAPER, Part, Point, Real, key

Side = Annotated[Real, Field(ge=0.1, le=1e5)]
Depth = Annotated[Real, Field(ge=0, le=11e3)]

# Keys each of which says what the area is; the first of them unless another is given.
SHAPES = ("side_m", "size_m", "polygon_m")


class Survey(Part):
    """The area of sea to be surveyed, a square, rectangle or polygon, and the depth to fly at."""

    side_m: Real | None = key(
        140.0, "m", "side L of the square survey area; null with another shape", PAPER, ge=0.1,
        le=1e5,
    )  # fmt: skip
    size_m: tuple[Side, Side] | None = key(
        None, "m", "[x, y]: sides of a rectangular survey area along x and y before it is turned"
    )
    rotation_deg: Real = key(
        0.0, "deg", "turn of square or rectangle about its centre, from +x towards +y",
        ge=-360, le=360,
    )  # fmt: skip
    polygon_m: tuple[Point, ...] | None = key(
        None, "m", "corners [x, y] of a survey area that is a simple polygon, going round"
    )
    depth_m: Real = key(10.0, "m", "depth at which the AUVs fly", PAPER, ge=0, le=11e3)
    depths_m: tuple[Depth, ...] | None = key(
        None, "m", "depth of each AUV; null = depth_m for all of them"
    )

    @model_validator(mode="after")
    def _one_shape(self) -> "Survey":
        """Let another shape replace the square that nobody has asked for."""
        given = [name for name in SHAPES[1:] if getattr(self, name) is not None]
        if given and "side_m" not in self.model_fields_set:
            self.__dict__["side_m"] = None
        return self

    @property
    def shapes(self) -> tuple[str, ...]:
        """The keys that say what the area is; one of them, or the scenario is refused."""
        return tuple(name for name in SHAPES if getattr(self, name) is not None)

    @property
    def deepest(self) -> float:
        """The greatest depth at which an AUV flies (m)."""
        return max(self.depths_m) if self.depths_m else self.depth_m

    def depth(self, auv: int) -> float:
        """Return the depth at which an AUV flies (m)."""
        return self.depths_m[auv] if self.depths_m else self.depth_m
