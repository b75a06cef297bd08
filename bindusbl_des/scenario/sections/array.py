"""The key `usbl.array`: a hydrophone array that has a name, or the places of one's own elements."""

from collections.abc import Sequence
from math import dist
from typing import Annotated, Any, Literal, NoReturn

from pydantic import PlainSerializer, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

# An array that reaches less than this share of its size out of some plane cannot tell one side of
# that from the other.
FLAT = 0.03

# The greatest distance (m) between two elements of arrays that have a name
NAMED_SIZES_M = {"oem5": 0.0799, "cross5": 0.06}

# Elements of an array of one's own, and how far (m) from its vessel's place they may be.
FEWEST_ELEMENTS, MOST_ELEMENTS, FARTHEST_M = 4, 64, 10.0

Element = tuple[float, float, float]


def _array(value: Any) -> str | tuple[Element, ...]:
    """Return an array by its name, or the places of its elements, which no plane has."""
    if isinstance(value, str):
        if value in NAMED_SIZES_M:
            return value
        _no_array(value)
    if not isinstance(value, list | tuple) or not all(map(_is_place, value)):
        _no_array(value)
    if not FEWEST_ELEMENTS <= len(value) <= MOST_ELEMENTS:
        told = f"has {len(value)} elements; give {FEWEST_ELEMENTS} to {MOST_ELEMENTS} of them"
        raise PydanticCustomError("array", "{text}", {"text": told})
    places = tuple((float(x), float(y), float(z)) for x, y, z in value)
    if thickness(places) < FLAT:
        told = (
            "lies in a plane, or nearly so: it cannot tell above from below; move an element out "
            f"of it, by {1e3 * size_m(places) / 4:.2g} mm or so"
        )
        raise PydanticCustomError("array", "{text}", {"text": told})
    return places


def _is_place(value: Any) -> bool:
    return (
        isinstance(value, list | tuple)
        and len(value) == 3
        and all(isinstance(it, int | float) and not isinstance(it, bool) for it in value)
        and all(abs(it) <= FARTHEST_M for it in value)  # not of nan either
    )


def _no_array(value: Any) -> NoReturn:
    told = (
        f"must be one of {', '.join(NAMED_SIZES_M)}, or the places of its elements in metres "
        f"(forward, to starboard, down), none beyond {FARTHEST_M:g} m: [[x, y, z], ...]; got "
        f"{str(value)[:60]!r}"
    )
    raise PydanticCustomError("array", "{text}", {"text": told})


def _plainly(array: str | tuple[Element, ...]) -> str | list[list[float]]:
    return array if isinstance(array, str) else [list(place) for place in array]


ArrayChoice = Annotated[
    Literal["oem5", "cross5"] | tuple[Element, ...],
    PlainValidator(_array),
    PlainSerializer(_plainly, return_type=Any),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "enum": list(NAMED_SIZES_M)},
                {
                    "type": "array",
                    "items": {
                        "type": "array",
                        "items": {"type": "number", "minimum": -FARTHEST_M, "maximum": FARTHEST_M},
                        "minItems": 3,
                        "maxItems": 3,
                    },
                    "minItems": FEWEST_ELEMENTS,
                    "maxItems": MOST_ELEMENTS,
                },
            ]
        }
    ),
]


def thickness(places: Sequence[Element]) -> float:
    """Return how far elements reach out of the plane that they lie in best, over their extent in it
    (standard deviations).
    """
    import numpy as np  # which arrays that have a name do not need

    sizes = np.linalg.svd(np.array(places) - np.mean(places, axis=0), compute_uv=False)
    return float(sizes[-1] / sizes[0]) if sizes[0] > 0.0 else 0.0


def size_m(array: str | Sequence[Element]) -> float:
    """Return the greatest distance (m) between two elements of an array."""
    if isinstance(array, str):
        return NAMED_SIZES_M[array]
    return max(dist(one, other) for one in array for other in array)


def spacing_m(array: Sequence[Element]) -> float:
    """Return the distance (m) to its nearest neighbour of the element that is the farthest from
    others.
    """
    return max(
        min(dist(one, other) for there, other in enumerate(array) if there != here)
        for here, one in enumerate(array)
    )
