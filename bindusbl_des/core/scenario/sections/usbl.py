"""The keys of the USBL: array, noise, lasting errors, data sheet.  With passive ranging AUVs carry
it.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from math import dist
from typing import Annotated, Any, Literal, NoReturn

from pydantic import (
    AfterValidator,
    ModelWrapValidatorHandler,
    PlainSerializer,
    PlainValidator,
    Strict,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ....models.presets.catalogue import CATALOGUE, preset
from ..families import INSTRUMENT
from ..key_types import PAPER, THESIS, Part, Real, key, known_preset
from ..part_choice import SET, PartChoice
from ..shipped_settings import Datasheet

# An array thinner than this share of its size cannot tell one side of its plane from the other.
FLAT = 0.03

# How many elements named arrays have, and the greatest distance (m) between two of each
ELEMENTS_OF_NAMED, NAMED_SIZES_M = 5, {"oem5": 0.0799, "cross5": 0.06}

# Limits of a user's array: number of elements, and their distance (m) from the vessel's origin.
FEWEST_ELEMENTS, MOST_ELEMENTS, FARTHEST_M = 4, 64, 10.0

Element = tuple[float, float, float]


def _array(value: Any) -> str | tuple[Element, ...]:
    """Return the name of an array, or its element positions (m), which must not lie in a plane."""
    if isinstance(value, str):
        if value in NAMED_SIZES_M:
            return value
        _no_array(value)
    if not isinstance(value, list | tuple) or not all(map(_is_place, value)):
        _no_array(value)
    if not FEWEST_ELEMENTS <= len(value) <= MOST_ELEMENTS:
        message = f"has {len(value)} elements; give {FEWEST_ELEMENTS} to {MOST_ELEMENTS} of them"
        raise PydanticCustomError("array", "{text}", {"text": message})
    places = tuple((float(x), float(y), float(z)) for x, y, z in value)
    if thickness(places) < FLAT:
        message = (
            "lies in a plane, or nearly so: it cannot tell above from below; move an element out "
            f"of it, by {1e3 * size_m(places) / 4:.2g} mm or so"
        )
        raise PydanticCustomError("array", "{text}", {"text": message})
    return places


def _is_place(value: Any) -> bool:
    return (
        isinstance(value, list | tuple)
        and len(value) == 3
        and all(
            isinstance(number, int | float) and not isinstance(number, bool) for number in value
        )
        and all(abs(number) <= FARTHEST_M for number in value)  # not of nan either
    )


def _no_array(value: Any) -> NoReturn:
    message = (
        f"must be one of {', '.join(NAMED_SIZES_M)}, or the places of its elements in metres "
        f"(forward, to starboard, down), none beyond {FARTHEST_M:g} m: [[x, y, z], ...]; got "
        f"{str(value)[:60]!r}"
    )
    raise PydanticCustomError("array", "{text}", {"text": message})


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
    """Return the extent of elements out of their best plane, over that along its main axis.

    Both extents are standard deviations; `places` are x, y, z (m).
    """
    import numpy as np  # named arrays do not need it

    sizes = np.linalg.svd(np.array(places) - np.mean(places, axis=0), compute_uv=False)
    return float(sizes[-1] / sizes[0]) if sizes[0] > 0.0 else 0.0


def size_m(array: str | Sequence[Element]) -> float:
    """Return the greatest distance (m) between two elements of an array."""
    if isinstance(array, str):
        return NAMED_SIZES_M[array]
    return max(dist(one, other) for one in array for other in array)


# The section `usbl`.


USBLS = [entry.name for entry in CATALOGUE["usbl"]]

# Keys of the AHRS, whose errors a data sheet's figures already contain
AHRS = ("roll_sd_deg", "pitch_sd_deg", "heading_sd_deg")


# What a USBL is installed with, and the keys of the errors of that
INSTALLED = {
    "compass": ("heading_sd_deg",),
    "GNSS": ("gnss_sd_m", "gnss_correlated_sd_m"),
    "mounting": ("misalignment_sd_deg",),
}


NONE_BY_SHEET = (
    "; with model: datasheet none unless given, and then added to the data sheet's figures"
)


UsblName = Annotated[
    str,
    Strict(),
    AfterValidator(partial(known_preset, "usbl")),
    WithJsonSchema({"type": "string", "enum": USBLS}),
]


def usbl_values(name: str) -> dict[str, Any]:
    """Return the values that a USBL's preset gives for keys of this section."""
    values = preset("usbl", name).values
    sheet = {key: value for key, value in values.items() if key in Datasheet.model_fields}
    rest = {key: value for key, value in values.items() if key not in sheet}
    return {**rest, "model": {"model": "datasheet", **sheet} if sheet else "array"}


class UsblSection(Part):
    """The hydrophone array, and the errors of its measurements."""

    preset: UsblName | None = key(
        None,
        "",
        "USBL whose data sheet (`bindusbl-des presets usbl`) sets the keys here that are not "
        "given, and the model",
    )
    model: PartChoice = key("array", "", "what an arrival measures, and how surely" + SET)
    array: ArrayChoice = key(
        "oem5",
        "",
        "hydrophone array: its name, or the positions of its elements, [[x, y, z], ...] in m "
        "forward, to starboard and down; their mean is at the vessel's position",
        THESIS,
    )
    tdoa_sd_s: Real = key(2.60296781e-7, "s", "noise of one TDOA pair", THESIS, ge=0, le=1)
    travel_time_sd_s: Real = key(6.66667e-6, "s", "noise of a travel time", THESIS, ge=0, le=1)
    quantum_s: Real = key(
        1.0e-6,
        "s",
        "step of the clock that measures travel times, which adds a step / sqrt(12) of noise",
        THESIS,
        ge=0,
        le=1,
    )
    roll_sd_deg: Real = key(0.2, "deg", f"AHRS roll noise{NONE_BY_SHEET}", THESIS, ge=0, le=45)
    pitch_sd_deg: Real = key(0.2, "deg", f"AHRS pitch noise{NONE_BY_SHEET}", THESIS, ge=0, le=45)
    heading_sd_deg: Real = key(
        1.0, "deg", f"AHRS heading noise{NONE_BY_SHEET}", THESIS, ge=0, le=45
    )
    gnss_sd_m: Real = key(0.0, "m", "GNSS noise per axis", PAPER, ge=0, le=1e3)
    misalignment_sd_deg: Real = key(
        0.0,
        "deg",
        "standard deviation of a constant heading error, drawn for each ASV (passive: AUV) and "
        "seed",
        ge=0,
        le=45,
    )
    gnss_correlated_sd_m: Real = key(
        0.0, "m", "standard deviation per axis of each ASV's slow GNSS error", ge=0, le=1e3
    )
    gnss_time_constant_s: Real = key(
        300.0, "s", "time constant of that error (Gauss-Markov)", ge=1, le=1e6
    )
    slow_share: Real = key(
        0.0,
        "1",
        "share of the variance of each acoustic error (range, direction) that changes slowly, "
        "independently for each pair of AUV and ASV; the rest is drawn anew for each ping",
        ge=0,
        le=1,
    )
    correlation_s: Real = key(
        60.0, "s", "time constant of that share (Gauss-Markov)", ge=0.1, le=1e6
    )
    range_rate_sd_m_per_s: Real | None = key(
        None,
        "m/s",
        "noise of a ping's range rate, measured by Doppler shift; null = not measured",
        ge=0,
        le=100,
    )
    outlier_share: Real = key(
        0.0, "1", "share of the measurements of single arrays that are outliers", ge=0, le=0.5
    )
    outlier_sd_m: Real = key(
        10.0, "m", "standard deviation of outliers per horizontal axis", gt=0, le=1e4
    )

    @model_validator(mode="wrap")
    @classmethod
    def _as_its_sheet_says(
        cls, data: Any, validate: ModelWrapValidatorHandler["UsblSection"]
    ) -> "UsblSection":
        """Let the preset's figures replace defaults; they do not count as given.

        A data sheet contains the errors of the AHRS, which are then 0 unless given.
        """
        name = data.get("preset") if isinstance(data, dict) else None
        usbl = validate({**usbl_values(name), **data} if name in USBLS else data)
        if name in USBLS:
            object.__setattr__(usbl, "__pydantic_fields_set__", set(data))
        if INSTRUMENT.declared(usbl.model).is_stated:
            usbl.otherwise(**dict.fromkeys(AHRS, 0.0))
        return usbl

    def changed(self, values: Mapping[str, Any]) -> "UsblSection":
        """Return the section with other values of some keys; its preset gives way to a model."""
        given = {name: getattr(self, name) for name in self.model_fields_set}
        for name in ("preset", "model") if {"preset", "model"} & {*values} else ():
            given.pop(name, None)
        return type(self).model_validate({**given, **values})

    @property
    def taken_for_perfect(self) -> dict[str, tuple[str, ...]]:
        """What a preset USBL is installed with and no key gives an error of, with those keys."""
        if self.preset is None:
            return {}
        known = preset("usbl", self.preset)
        said = {*self.model_fields_set, *known.figures, *known.covers}
        return {
            what: keys
            for what, keys in INSTALLED.items()
            if not said & {*keys} and not any(getattr(self, key) for key in keys)
        }
