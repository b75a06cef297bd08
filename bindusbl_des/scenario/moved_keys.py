"""Keys that are settings of one part now, and are still read at their former places.

A section names its own in `MOVED`.  In a file they are moved at their lines, with a warning
(:mod:`.files.former_keys`), before anything is read from it; in Python by the section itself.
"""

import warnings
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from ..core.wording import plain
from .key_types import Part


class Moved(NamedTuple):
    """A key that has become a setting, of the same name, of the part `owner` at the key `part`."""

    name: str
    part: str
    owner: str


def moved(data: Mapping[str, Any], it: Moved, usual: str) -> dict[str, Any]:
    """Return the data of a section with a key that it holds where this belongs now.

    `usual` is the part of a section that names none.

    Raises:
        LookupError: when the part chosen has no such setting, or has it already; with the remedy.
    """
    part = data.get(it.part, usual)
    if chosen(part) != it.owner:
        raise LookupError(
            f"is a setting of the {it.part} {it.owner}, and {it.part} is {plain(chosen(part))}; "
            f"remove it, or write `{it.part}: {{model: {it.owner}, {it.name}: "
            f"{plain(data[it.name])}}}`"
        )
    settings = settings_of(part)
    if it.name in settings:
        raise LookupError(f"is given twice, as {it.part}.{it.name} as well; remove this one")
    rest = {key: value for key, value in data.items() if key != it.name}
    return {**rest, it.part: {"model": it.owner, **settings, it.name: data[it.name]}}


def chosen(part: Any) -> str:
    """Return the name of the part that a value asks for, as plain data or as an object."""
    name = part.get("model") if isinstance(part, Mapping) else getattr(part, "model", part)
    return str(name)


def settings_of(part: Any) -> dict[str, Any]:
    """Return the settings that a value gives a part, as plain data or as an object."""
    plain_part = part if isinstance(part, Mapping) else getattr(part, "plain", dict)()
    given = plain_part if isinstance(plain_part, Mapping) else {}
    return {name: value for name, value in given.items() if name != "model"}


class Section(Part):
    """A section of which keys have become settings of the parts that it names."""

    MOVED: ClassVar[tuple[Moved, ...]] = ()

    @classmethod
    def usual(cls, part: str) -> str:
        """Return the name of the part at one of its keys where none is given."""
        return chosen(cls.model_fields[part].default)

    @model_validator(mode="before")
    @classmethod
    def _moved(cls, data: Any) -> Any:
        for it in cls.MOVED:
            if isinstance(data, dict) and it.name in data:
                try:
                    data = moved(data, it, cls.usual(it.part))
                except LookupError as error:
                    context = {"text": str(error), "key": it.name}
                    raise PydanticCustomError("moved", "{text}", context) from None
                warnings.warn(
                    f"{it.name} is a setting of the {it.part} {it.owner} now: write "
                    f"{{{it.part!r}: {data[it.part]}}}; its former place is read in this version",
                    FutureWarning,
                    stacklevel=2,
                )
        return data
