"""What a scenario's keys are made of: strict numbers and texts, and words that had another name."""

from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    Strict,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

PAPER = "BIND-USBL paper"
THESIS = "Nitsch 2024, USBL-Simulator"
OURS = "this package"

# No control characters: they belong to no name, and a terminal would obey them.  U+FFFE and U+FFFF
# are no characters, and no YAML.
PRINTABLE = r"^[^\u0000-\u001f\u007f-\u009f\u2028\u2029\ufffe\uffff]*$"
LONGEST_NAME = 100

Real = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Whole = Annotated[int, Strict()]
Text = Annotated[str, Strict(), Field(pattern=PRINTABLE)]
Coordinate = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Point = tuple[Coordinate, Coordinate]
Latitude = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=-90, le=90)]
Longitude = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=-180, le=180)]
Position = tuple[Latitude, Longitude]


class Part(BaseModel):
    """A frozen part of a scenario; a key that is not listed is a mistake, never ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)

    @model_validator(mode="before")
    @classmethod
    def _without_numpy(cls, data: Any) -> Any:
        """Take numbers and arrays of numpy's for those of Python's, which alone are valid."""
        if not isinstance(data, dict) or not any(hasattr(it, "tolist") for it in data.values()):
            return data
        return {k: it.tolist() if hasattr(it, "tolist") else it for k, it in data.items()}

    def otherwise(self, **values: Any) -> None:
        """Give keys that were left out another default than their own, as other keys ask for it.

        They stay keys that nobody has given, so that a scenario that is written out and read again
        says the same, and one that is changed forgets them.
        """
        self.__dict__.update(
            {name: it for name, it in values.items() if name not in self.model_fields_set}
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
    """A word of a scenario that was given by its former name, which `written` remembers.

    It equals the word it stands for, and is kept and fingerprinted as that.

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
    """Return what lets a key be given by former names of its words as well: old name = new name."""

    def read(value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
        if isinstance(value, str) and value in names:
            return Renamed(validate(names[value]), value)
        return value if isinstance(value, Renamed) else validate(value)

    return WrapValidator(read)
