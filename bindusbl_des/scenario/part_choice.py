"""Which part of the mission a scenario asks for at a key, and the settings that it gives it."""

from collections.abc import Callable, Mapping
from math import isfinite
from types import MappingProxyType
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from ..core.plugins import name_of
from ..core.wording import described, plain
from .key_types import Text

# What is said of keys that name a part of the mission.
SET = ", or {model: ..., setting: value, ...}"

Model = TypeVar("Model", bound=BaseModel)


class PartChoice(str):
    """A part by its shipped name or as `module:object`, with the settings that it is given.

    In a file it is that name, or a mapping: ``{model: name, setting: value, ...}``; in Python the
    name may be the object itself.  It equals its bare name, and another choice only if their
    settings are equal as well.  Settings are plain data, as they were given.

    >>> PartChoice("dsatur") == "dsatur", PartChoice("dsatur") == PartChoice("dsatur", {"k": 1})
    (True, False)
    >>> PartChoice("dsatur", {"k": 1}) == PartChoice("dsatur", {"k": True})
    False
    """

    settings: Mapping[str, Any]
    _read: BaseModel

    def __new__(cls, name: str, settings: Mapping[str, Any] | None = None) -> "PartChoice":
        choice = super().__new__(cls, name)
        choice.settings = MappingProxyType(dict(settings or {}))
        return choice

    def __eq__(self, other: object) -> bool:
        same = super().__eq__(other)
        if not isinstance(other, PartChoice):
            return same
        return same and _told_apart(dict(self.settings)) == _told_apart(dict(other.settings))

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = str.__hash__

    def __reduce__(self) -> "tuple[type[PartChoice], tuple[str, dict[str, Any]]]":
        return type(self), (str(self), dict(self.settings))

    def settings_as(self, model: type[Model], own: type[BaseModel]) -> Model:
        """Return its settings by their `own` model, if that is a `model`; else, or where some of
        them are wrong, the defaults.
        """
        made, given = (own, dict(self.settings)) if issubclass(own, model) else (model, {})
        if getattr(self, "_read", None).__class__ is not made:
            try:
                self._read = made.model_validate(given)
            except ValidationError:
                self._read = made()
        return self._read  # type: ignore[return-value]  # of `made`, which is a `model`

    @property
    def words(self) -> str:
        """The choice in words, such as ``my_parts:fast (depth 2)``."""
        given = ", ".join(f"{name} {plain(value)}" for name, value in self.settings.items())
        return f"{self} ({given})" if given else str(self)

    def plain(self) -> "str | dict[str, Any]":
        """Return the choice as it is written in a file."""
        return {"model": str(self), **self.settings} if self.settings else str(self)

    @classmethod
    def read(cls, value: Any, text: Callable[[Any], Any]) -> "PartChoice":
        """Return the choice that a file's value stands for, whether or not there is such a part.

        Raises:
            PydanticCustomError: naming the rule, the value and the remedy.
        """
        if isinstance(value, cls):
            return value
        if not isinstance(value, Mapping):
            return cls(_name(value, text))
        if "model" not in value:
            got = ", ".join(map(str, value)) or "nothing"
            raise _mistake(f"needs `model`, the part that its settings are for; got {got}")
        given = [name for name in value if name != "model"]
        settings = {_word(name): _plain(name, value[name]) for name in given}
        return cls(_name(value["model"], text), settings)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_wrap_validator_function(
            cls.read,
            handler.generate_schema(Text),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda part: part.plain() if isinstance(part, PartChoice) else part
            ),
        )


def _name(value: Any, text: Callable[[Any], Any]) -> str:
    return name_of(value) if callable(value) else str(text(value))


def _word(name: Any) -> str:
    if not isinstance(name, str) or not name.isidentifier() or name.startswith("_"):
        raise _mistake(f"names settings by words such as `depth`; got {described(name)}")
    return name


def _plain(name: str, value: Any) -> Any:
    """Return the value of a setting as plain data that a file can hold; numpy's is Python's."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(name, it) for key, it in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(name, it) for it in value]
    if value is None or isinstance(value, int) or (isinstance(value, float) and isfinite(value)):
        return value
    if isinstance(value, str) and value.isprintable():
        return str(value)
    raise _mistake(
        f"takes settings of numbers, texts, lists and mappings; {name} is {described(value)}"
    )


def _told_apart(value: Any) -> Any:
    """Return plain data in which true is not 1, as it is to Python and is not in a file."""
    if isinstance(value, Mapping):
        return {key: _told_apart(it) for key, it in value.items()}
    if isinstance(value, list):
        return [_told_apart(it) for it in value]
    return (bool, value) if isinstance(value, bool) else value


def _mistake(text: str) -> PydanticCustomError:
    return PydanticCustomError("part", "{text}", {"text": text})
