"""The keys of the USBL: what ASVs measure with, and all that is wrong with it.

With passive ranging AUVs measure with it.
"""

from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    ModelWrapValidatorHandler,
    Strict,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ...presets.catalogue import CATALOGUE, preset
from ..declared import instrument_named
from ..instruments.datasheet import Datasheet
from ..key_types import PAPER, THESIS, Part, Real, key
from ..part_choice import SET, PartChoice
from .array import ArrayChoice

USBLS = [it.name for it in CATALOGUE["usbl"]]

# The AHRS, of which a sheet's figures have their share already
AHRS = ("roll_sd_deg", "pitch_sd_deg", "heading_sd_deg")


NONE_BY_SHEET = "; with model: datasheet none unless given, and then added to the sheet's figures"


def _known(name: str) -> str:
    """Refuse the name of a USBL that no preset has."""
    try:
        return preset("usbl", name).name
    except ValueError as error:
        raise PydanticCustomError("usbl", "{text}", {"text": str(error)}) from None


UsblName = Annotated[
    str, Strict(), AfterValidator(_known), WithJsonSchema({"type": "string", "enum": USBLS})
]


def usbl_values(name: str) -> dict[str, Any]:
    """Return what the preset of a USBL says of the keys here: those of its array, or its sheet."""
    values = preset("usbl", name).values
    sheet = {key: it for key, it in values.items() if key in Datasheet.model_fields}
    rest = {key: it for key, it in values.items() if key not in sheet}
    return {**rest, "model": {"model": "datasheet", **sheet} if sheet else "array"}


class Usbl(Part):
    """The hydrophone array and the errors of what it measures."""

    preset: UsblName | None = key(
        None,
        "",
        "USBL whose figures (`bindusbl-des presets usbl`) stand for the keys here that are not "
        "given; one that is given wins, but for model",
    )
    model: PartChoice = key("array", "", "what an arrival measures, and how surely" + SET)
    array: ArrayChoice = key(
        "oem5",
        "",
        "hydrophone array: one that has a name, or the places of one's own elements, [[x, y, z], "
        "...] in m forward, to starboard and down, of which their mean is the vessel's place",
        THESIS,
    )
    tdoa_sd_s: Real = key(2.60296781e-7, "s", "noise of one TDOA pair", THESIS, ge=0, le=1)
    travel_time_sd_s: Real = key(6.66667e-6, "s", "noise of a travel time", THESIS, ge=0, le=1)
    quantum_s: Real = key(1.0e-6, "s", "quantum of travel times and TDOAs", THESIS, ge=0, le=1)
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
        "share of the variance of each acoustic error (range, direction) that changes slowly, for "
        "each AUV and ASV by themselves; the rest is drawn anew for each ping",
        ge=0,
        le=1,
    )
    correlation_s: Real = key(
        60.0, "s", "time constant of that share (Gauss-Markov)", ge=0.1, le=1e6
    )
    outlier_share: Real = key(
        0.0, "1", "share of the measurements of single arrays that are outliers", ge=0, le=0.5
    )
    outlier_sd_m: Real = key(
        10.0, "m", "standard deviation per horizontal axis of what outliers are off", gt=0, le=1e4
    )

    @model_validator(mode="wrap")
    @classmethod
    def _as_its_sheet_says(cls, data: Any, validate: ModelWrapValidatorHandler["Usbl"]) -> "Usbl":
        """Let the figures of the preset stand for keys that are not given, and do not become so;
        and an AHRS that is not given add nothing to a sheet.
        """
        name = data.get("preset") if isinstance(data, dict) else None
        usbl = validate({**usbl_values(name), **data} if name in USBLS else data)
        if name in USBLS:
            object.__setattr__(usbl, "__pydantic_fields_set__", set(data))
        if instrument_named(usbl.model).is_stated:
            usbl.otherwise(**dict.fromkeys(AHRS, 0.0))
        return usbl
