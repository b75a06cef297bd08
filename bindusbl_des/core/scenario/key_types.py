"""Types of scenario keys: strict numbers and texts; former names and places of keys.

A section lists in `MOVED` the keys that are now settings of a part, and are still read at their
former places: in a file by :mod:`.files.former_keys`, with a warning at the line, before anything
else is read; in Python by the section itself.
"""

import warnings
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from ...models.presets.catalogue import preset
from ...support.plain_data import PRINTABLE
from ...support.wording import plain

PAPER = "BIND-USBL paper"
THESIS = "Nitsch 2024, USBL-Simulator"
OURS = "this package"

Real = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Whole = Annotated[int, Strict()]
Text = Annotated[str, Strict(), Field(pattern=PRINTABLE)]
Coordinate = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Point = tuple[Coordinate, Coordinate]


def angle_of(sides: str) -> BeforeValidator:
    """Return a validator that reads texts such as "33 51.4 S" as degrees."""

    def read(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        from ...models.charts.positions import angle  # not needed for numbers

        try:
            return angle(value, sides)
        except ValueError as error:
            raise PydanticCustomError("place", "{text}", {"text": str(error)}) from None

    return BeforeValidator(read)


def _place(value: Any) -> Any:
    """Read texts such as "33 51.4 S, 151 12.5 E" as latitude and longitude."""
    if not isinstance(value, str):
        return value
    from ...models.charts.positions import place

    try:
        return place(value)
    except ValueError as error:
        raise PydanticCustomError("place", "{text}", {"text": str(error)}) from None


def or_text(most: int, *others: str) -> WithJsonSchema:
    """Return the JSON schema of an angle (deg) of at most `most`, a text, or other types."""
    number = {"type": "number", "minimum": -most, "maximum": most}
    return WithJsonSchema({"anyOf": [number, *({"type": kind} for kind in ("string", *others))]})


Latitude = Annotated[
    float, Strict(), Field(allow_inf_nan=False, ge=-90, le=90), angle_of("NS"), or_text(90)
]
Longitude = Annotated[
    float, Strict(), Field(allow_inf_nan=False, ge=-180, le=180), angle_of("EW"), or_text(180)
]
Position = Annotated[tuple[Latitude, Longitude], BeforeValidator(_place)]


def known_preset(kind: str, name: str) -> str:
    """Return a preset's name; refuse one that no preset of the kind has."""
    try:
        return preset(kind, name).name
    except ValueError as error:
        raise PydanticCustomError(kind, "{text}", {"text": str(error)}) from None


class Part(BaseModel):
    """A frozen part of a scenario; an unlisted key is a mistake, never ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)

    @model_validator(mode="before")
    @classmethod
    def _without_numpy(cls, data: Any) -> Any:
        """Replace numbers and arrays of numpy by Python's, since only these are valid."""
        if not isinstance(data, dict) or not any(
            hasattr(value, "tolist") for value in data.values()
        ):
            return data
        return {
            k: value.tolist() if hasattr(value, "tolist") else value for k, value in data.items()
        }

    def otherwise(self, **values: Any) -> None:
        """Set other defaults for keys that were left out, because of other keys.

        They still count as not given, so that a scenario that is written and read again is the
        same, and one that is changed gets its own defaults.
        """
        self.__dict__.update(
            {name: value for name, value in values.items() if name not in self.model_fields_set}
        )


def key(default: Any, unit: str, meaning: str, source: str = OURS, **bounds: Any) -> Any:
    """Describe one scenario key: its default, unit, meaning, source and allowed range."""
    return Field(
        default=default,
        description=meaning,
        json_schema_extra={"unit": unit, "source": source},
        **bounds,
    )


class Renamed(str):
    """A word of a scenario given by its former name, which is kept as `written`.

    It equals the word that it stands for, and is stored and fingerprinted as that word.

    >>> Renamed("last_fix", "estimate") == "last_fix", Renamed("last_fix", "estimate").written
    (True, 'estimate')
    """

    written: str

    def __new__(cls, name: str, written: str) -> "Renamed":
        word = super().__new__(cls, name)
        word.written = written
        return word

    def __reduce__(self) -> "tuple[type[Renamed], tuple[str, str]]":
        return Renamed, (str(self), self.written)


def formerly(**names: str) -> WrapValidator:
    """Return a validator that also accepts former names of a key's words: old name = new name."""

    def read(value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
        if isinstance(value, str) and value in names:
            return Renamed(validate(names[value]), value)
        return value if isinstance(value, Renamed) else validate(value)

    return WrapValidator(read)


class Moved(NamedTuple):
    """A key that is now a setting, of the same name, of the part `owner` at the key `part`."""

    name: str
    part: str
    owner: str


def moved(data: Mapping[str, Any], move: Moved, usual: str) -> dict[str, Any]:
    """Return the data of a section with a moved key at its new place.

    `usual` is the part in a section that names none.

    Raises:
        LookupError: when the chosen part has no such setting, or has it already; with the remedy.
    """
    part = data.get(move.part, usual)
    if chosen(part) != move.owner:
        raise LookupError(
            f"is a setting of the {move.part} {move.owner}, and {move.part} is "
            f"{plain(chosen(part))}; remove it, or write `{move.part}: "
            f"{{model: {move.owner}, {move.name}: {plain(data[move.name])}}}`"
        )
    settings = _settings_of(part)
    if move.name in settings:
        raise LookupError(f"is given twice, as {move.part}.{move.name} as well; remove this one")
    rest = {key: value for key, value in data.items() if key != move.name}
    return {**rest, move.part: {"model": move.owner, **settings, move.name: data[move.name]}}


def chosen(part: Any) -> str:
    """Return the name of the part in a value, which is plain data or an object."""
    name = part.get("model") if isinstance(part, Mapping) else getattr(part, "model", part)
    return str(name)


def _settings_of(part: Any) -> dict[str, Any]:
    """Return the settings of the part in a value, which is plain data or an object."""
    plain_part = part if isinstance(part, Mapping) else getattr(part, "plain", dict)()
    given = plain_part if isinstance(plain_part, Mapping) else {}
    return {name: value for name, value in given.items() if name != "model"}


class Section(Part):
    """A section some of whose keys are now settings of the parts that it names."""

    MOVED: ClassVar[tuple[Moved, ...]] = ()

    @classmethod
    def usual(cls, part: str) -> str:
        """Return the default part at one of its keys."""
        return chosen(cls.model_fields[part].default)

    @model_validator(mode="before")
    @classmethod
    def _moved(cls, data: Any) -> Any:
        for move in cls.MOVED:
            if isinstance(data, dict) and move.name in data:
                try:
                    data = moved(data, move, cls.usual(move.part))
                except LookupError as error:
                    context = {"text": str(error), "key": move.name}
                    raise PydanticCustomError("moved", "{text}", context) from None
                warnings.warn(
                    f"{move.name} is a setting of the {move.part} {move.owner} now: write "
                    f"{{{move.part!r}: {data[move.part]}}}; its former place is read in this "
                    "version",
                    FutureWarning,
                    stacklevel=2,
                )
        return data


def which_tracks(whose: str) -> Any:
    """Return the declaration of the key that names, for each vehicle, one track in its file;
    `whose` is "AUV" or "ASV".
    """
    return key(
        (),
        "",
        f"per {whose} which track of its file, where that holds several: a vehicle of a CSV, the "
        "name of a GPX track, the topic of an MCAP",
    )


# The origin of times in files
TIME_OFFSET_S = key(
    0.0,
    "s",
    "subtracted from the time_s of the files, such as the Unix time of the mission's start",
    ge=-1e12,
    le=1e12,
)


def sources(files: tuple[str, ...], tracks: tuple[str, ...]) -> list[tuple[str, str]]:
    """Return (file, track) for each file.  `tracks` names one track per file, or is empty: then
    each track is "", the only one in its file.
    """
    return list(zip(files, tracks or ("",) * len(files), strict=False))
