"""The part that a scenario names at a key, with its settings; and the part made of both.

The settings of a user-defined part are its keyword-only parameters, with their annotations and
defaults; or the part has an attribute `Settings`, a pydantic model, and is called with an instance
of it as `settings`.  Settings of a shipped part are declared with the part.
"""

import json
import warnings
from collections.abc import Callable, Hashable, Iterator, Mapping
from functools import lru_cache, partial
from inspect import Parameter, signature
from math import isfinite
from types import MappingProxyType
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, create_model
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from ...support.plugins import Family, OwnPart, PluginError, asked, is_plugin, load, name_of
from ...support.wording import described, did_you_mean, nearest, plain
from .key_types import Text

# End of the meaning of keys that name a part.
SET = ", or {model: ..., setting: value, ...}"

Model = TypeVar("Model", bound=BaseModel)


class PartChoice(str):
    """A part by its shipped name or as `module:object`, with its settings.

    In a file it is that name, or a mapping: ``{model: name, setting: value, ...}``; in Python the
    name may be the object itself.  It equals its bare name, and another choice only if their
    settings are equal, too.  Settings are plain data, as they were given.

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
        """Return the settings of this part as an instance of its `own` settings class, if that is a
        subclass of `model`; otherwise, or if they are invalid, the defaults of `model` or `own`.
        """
        made, given = (own, dict(self.settings)) if issubclass(own, model) else (model, {})
        if getattr(self, "_read", None).__class__ is not made:
            try:
                self._read = made.model_validate(given)
            except ValidationError:
                self._read = made()
        return self._read  # type: ignore[return-value]  # of `made`, which is a `model`

    @property
    def is_own(self) -> bool:
        """Whether it is a user-defined part, ``module:object``."""
        return is_plugin(self)

    @property
    def words(self) -> str:
        """The choice in words, such as ``my_parts:fast (depth 2)``."""
        given = ", ".join(f"{name} {plain(value)}" for name, value in self.settings.items())
        return f"{self} ({given})" if given else str(self)

    def plain(self) -> "str | dict[str, Any]":
        """Return the choice as a file has it."""
        return {"model": str(self), **self.settings} if self.settings else str(self)

    @classmethod
    def read(cls, value: Any, text: Callable[[Any], Any]) -> "PartChoice":
        """Return the choice in a file's value, whether or not such a part exists.

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
    """Return the value of a setting as plain data; numpy's numbers become Python's."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(name, inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(name, inner) for inner in value]
    if value is None or isinstance(value, int) or (isinstance(value, float) and isfinite(value)):
        return value
    if isinstance(value, str) and value.isprintable():
        return str(value)
    raise _mistake(
        f"takes settings of numbers, texts, lists and mappings; {name} is {described(value)}"
    )


def _told_apart(value: Any) -> Any:
    """Return plain data in which each bool is a pair (bool, value): Python has True == 1, but in a
    file they differ.
    """
    if isinstance(value, Mapping):
        return {key: _told_apart(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_told_apart(inner) for inner in value]
    return (bool, value) if isinstance(value, bool) else value


def _mistake(text: str) -> PydanticCustomError:
    return PydanticCustomError("part", "{text}", {"text": text})


# Messages for types of pydantic's errors, where its own words do not fit a file.
_NEEDED = {
    "int_type": "needs a whole number",
    "int_from_float": "needs a whole number",
    "float_type": "needs a number",
    "bool_type": "needs true or false",
    "string_type": "needs a text",
    "tuple_type": "needs a list",
    "list_type": "needs a list",
    "dict_type": "needs keys and values",
    "extra_forbidden": "is no such key",
    "finite_number": "must be a finite number",
}
SIGNS = {
    "greater_than": ">",
    "greater_than_equal": ">=",
    "less_than": "<",
    "less_than_equal": "<=",
}


class Settings(BaseModel):
    """The settings of a shipped part, whose fields are made by :func:`.key_types.key`."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, protected_namespaces=(), allow_inf_nan=False
    )


def own_part(family: Family[Any], choice: str) -> OwnPart:
    """Return a user-defined part with its settings bound, to be called with its family's arguments.

    Raises:
        PluginError: when it is not allowed, cannot be loaded or called, or its settings are wrong.
    """
    found, model, wrong = _looked_at(family, choice)
    if wrong:
        raise wrong[0]
    part = found
    if model is not None:
        values = asked(family.key, str(choice), _validated, model, _own_settings(family, choice))
        given = {name: getattr(values, name) for name in values.model_fields_set}
        is_whole = model is getattr(found, "Settings", None)
        part = partial(found, settings=values) if is_whole else partial(found, **given)
    return OwnPart(family.key, str(choice), part)


def own_mistakes(family: Family[Any], choice: str) -> Iterator[PluginError]:
    """Yield errors of a user-defined part: that it cannot be loaded, or each wrong setting."""
    try:
        yield from _looked_at(family, choice)[2]
    except PluginError as error:
        yield error


def _looked_at(
    family: Family[Any], choice: str
) -> tuple[Any, type[BaseModel] | None, list[PluginError]]:
    """Load a user-defined part; return it, the model of its settings, and errors in them."""
    key, name = family.key, str(choice)
    found = load(family, name)
    when = " as its settings were read"
    look = _kept_model_of if isinstance(found, Hashable) else _model_of
    model = asked(key, name, look, found, when=when)
    wrong = asked(key, name, lambda: list(_own_mistakes(family, choice, model)), when=when)
    return found, model, [PluginError(f"{key}.{word}", message) for word, message in wrong]


def _own_mistakes(
    family: Family[Any], choice: str, model: type[BaseModel] | None
) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a user-defined part's settings, and with those of its family."""
    own = _own_settings(family, choice)
    yield from mistakes(model, own, str(choice))
    if family.common is not None:
        given = {name: value for name, value in _settings(choice).items() if name not in own}
        yield from mistakes(family.common, given, str(choice))


def shipped_part(family: Family[Any], choice: str) -> Any:
    """Return a shipped part with its settings bound, which were validated with the scenario."""
    part, has_settings = family.part(str(choice)), choice in family.settings
    return partial(part, settings=settings_of(family, choice)) if has_settings else part


def checked_part(family: Family[Any], choice: str, check: Callable[..., Any]) -> Any:
    """Return a part with its settings bound, to be called with the arguments of its family.

    A shipped one is returned as it is.  A user-defined one is called as ``check(part,
    *arguments)``: `check` calls the part and raises PluginError for an invalid answer.

    Raises:
        PluginError: as of :func:`own_part`.
    """
    if choice in family.parts:
        return shipped_part(family, choice)
    return partial(check, own_part(family, choice))


def settings_of(family: Family[Any], choice: str) -> Any:
    """Return the settings of a shipped part, with defaults.

    Raises:
        ValidationError: when they are wrong, which a scenario's are not.
    """
    return _validated(family.settings[str(choice)], _settings(choice))


def settings_with(family: Family[Any], choice: PartChoice, name: str) -> Any:
    """Return the settings of the chosen part if it has a field `name`; else, or if they are
    invalid, the defaults of the first part that has it.
    """
    own = family.settings.get(str(choice), Settings)
    if name in own.model_fields:
        return choice.settings_as(own, own)
    usual = next(model for model in family.settings.values() if name in model.model_fields)
    return choice.settings_as(usual, own)


def shipped_mistakes(family: Family[Any], choice: str) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with the settings of a shipped part, each with its name."""
    yield from mistakes(family.settings.get(str(choice)), _settings(choice), str(choice), family)


def mistakes(
    model: type[BaseModel] | None,
    settings: Mapping[str, Any],
    name: str,
    family: Family[Any] | None = None,
) -> Iterator[tuple[str, str]]:
    """Yield the name and fault of each wrong setting; a part without a `model` has no settings.

    A misspelt setting is not also reported as missing; for a setting of another part of the family
    that part is named.
    """
    known = model.model_fields if model else {}
    strict = model is None or model.model_config.get("extra") != "allow"
    unknown = [word for word in settings if strict and word not in known]
    for word in unknown:
        listed = f"; remove it, {name} has {', '.join(known)}"
        remedy = did_you_mean(word, known) or (listed if known else f"; remove it, {name} has none")
        models = family.settings if family else {}
        owners = [part for part, other in models.items() if word in other.model_fields]
        if owners:
            remedy = f"; remove it, or choose {' or '.join(owners)}, {name} has no such setting"
        yield word, f"unknown setting{remedy}"
    try:
        _validated(
            model or Settings, {k: value for k, value in settings.items() if k not in unknown}
        )
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            key, missing = ".".join(map(str, detail["loc"])), detail["type"] == "missing"
            if not (missing and any(nearest(word, known) == key for word in unknown)):
                yield key or "model", _message(detail)


def _validated(model: type[BaseModel], settings: Mapping[str, Any]) -> BaseModel:
    """Return settings as their model, read as JSON: lists become tuples, words enumerations."""
    return model.model_validate_json(json.dumps(dict(settings)))


def _message(detail: Any) -> str:
    kind, context = detail["type"], detail.get("ctx", {})
    if kind == "missing":
        return "missing; add it"
    if kind == "value_error" and not detail["loc"]:  # settings contradict each other
        return str(context["error"])
    needed = _NEEDED.get(kind)
    if kind in SIGNS:
        needed = f"must be {SIGNS[kind]} {plain(next(iter(context.values())))}"
    elif kind == "literal_error":
        needed = f"must be {context['expected']}"
    return f"{needed or detail['msg']}; got {described(detail['input'])}"


def _settings(choice: str) -> Mapping[str, Any]:
    return choice.settings if isinstance(choice, PartChoice) else {}


def _own_settings(family: Family[Any], choice: str) -> Mapping[str, Any]:
    """Return the settings with which a user-defined part is called."""
    common = family.common.model_fields if family.common is not None else {}
    return {name: value for name, value in _settings(choice).items() if name not in common}


def _model_of(found: Any) -> type[BaseModel] | None:
    own = getattr(found, "Settings", None)
    if isinstance(own, type) and issubclass(own, BaseModel):
        if not _takes_settings(found):
            raise TypeError("it has Settings, but takes no `settings`")
        return own
    try:
        form = signature(found, eval_str=True)
    except (TypeError, ValueError):  # what is compiled need not tell
        return None
    fields = {
        parameter.name: (
            Any if parameter.annotation is Parameter.empty else parameter.annotation,
            ... if parameter.default is Parameter.empty else parameter.default,
        )
        for parameter in form.parameters.values()
        if parameter.kind is Parameter.KEYWORD_ONLY and not parameter.name.startswith("_")
    }
    if not fields:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a setting may be called `copy`
        made: type[BaseModel] = create_model(  # type: ignore[call-overload]  # keys by name
            "Settings", __base__=Settings, **fields
        )
    return made


def _takes_settings(found: Any) -> bool:
    try:
        taken = signature(found).parameters
    except (TypeError, ValueError):  # what is compiled need not tell
        return True
    return "settings" in taken or any(
        parameter.kind is Parameter.VAR_KEYWORD for parameter in taken.values()
    )


_kept_model_of = lru_cache(maxsize=64)(_model_of)  # a campaign asks for each of its points
