"""Every key of a scenario file: its type, unit, default, range, meaning and source.

The rows come from the models in :mod:`.scenario_keys`, so what `params` prints, messages and checks
cannot differ.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from ...support.plain_data import DIALECT
from ...support.plugins import Family
from ...support.wording import plain
from .families import FAMILIES
from .key_types import Part, Position
from .scenario_keys import ScenarioKeys
from .sections.navigation import Navigation
from .sections.survey import Survey
from .sections.vehicles import VehicleChoice

if TYPE_CHECKING:
    from pydantic import BaseModel
    from pydantic.fields import FieldInfo

REQUIRED = "(required)"

# The parts at each key: those that ship, and user-defined ones.
OWN_PART = "module:object"
PARTS = {family.name_key: (*family.siblings, *[OWN_PART] * family.is_open) for family in FAMILIES}
# Sections that are parts, and the key in each that names the part.
WORDS = {family.key: family.word for family in FAMILIES if family.word}


def as_for_all(key: str) -> str:
    """Return the key for all AUVs or ASVs that a group's key replaces; any other key unchanged.

    >>> as_for_all("asvs.groups.1.usbl.array"), as_for_all("asvs.groups.vehicle")
    ('usbl.array', 'asvs.vehicle')
    >>> as_for_all("auvs.groups.0.route.kind"), as_for_all("auvs.groups.drift"), as_for_all("x")
    ('auvs.route.kind', 'navigation.drift', 'x')
    """
    vessels = re.fullmatch(r"asvs\.groups\.(?:\d+\.)?([a-z]\w*.*)", key)
    if vessels is not None:
        return vessels[1] if vessels[1].startswith("usbl") else f"asvs.{vessels[1]}"
    found = re.fullmatch(r"auvs\.groups\.(?:\d+\.)?(([a-z]\w*).*)", key)
    if found is None:
        return key
    in_survey, in_navigation = found[2] in Survey.model_fields, found[2] in Navigation.model_fields
    section = "survey" if in_survey else "navigation" if in_navigation else "auvs"
    return f"{section}.{found[1]}"


@dataclass(frozen=True)
class Key:
    """One key of the scenario file.

    `only` names the route or placements that have the key, or the parts that have the setting; ""
    for all. `kind` is its type in words, `choices` are its allowed words, if any (`module:object`
    stands for a user-defined part); `default` and `range` are written as in a file.
    """

    key: str
    kind: str
    choices: tuple[str, ...]
    unit: str
    default: str
    range: str
    meaning: str
    source: str
    only: str = ""

    @property
    def section(self) -> str:
        """The dotted name of its section."""
        return self.key.rpartition(".")[0]

    @property
    def name(self) -> str:
        """Its last word."""
        return self.key.rpartition(".")[2]

    @property
    def condition(self) -> str:
        """The choice that it belongs to, such as `auvs.route.kind: hold`; "" if to all."""
        return f"{self.section}.{self.chooser}: {self.only}" if self.only else ""

    @property
    def chooser(self) -> str:
        """The key beside it that makes the choice to which it belongs."""
        return WORDS.get(self.section, "model")


@cache
def keys() -> tuple[Key, ...]:
    """Return every key in the order of the file, one row each."""
    return tuple(_rows(ScenarioKeys, "", ""))


@cache
def settings() -> tuple[Key, ...]:
    """Return every setting of the parts that ship, one row each; a part with settings is a mapping.

    A setting that several parts of a family share is one row, with all these parts in `only`.
    """
    found: dict[Key, list[str]] = {}
    for family in FAMILIES:
        for model, part in family.settings.items():
            for row in _rows(part, f"{family.key}.", ""):
                found.setdefault(row, []).append(model)
    return tuple(replace(row, only=", ".join(models)) for row, models in found.items())


def settable() -> tuple[Key, ...]:
    """Return what can be set and varied: every key, and every setting of the parts that ship."""
    return (*keys(), *settings())


@cache
def items() -> tuple[Key, ...]:
    """Return every key in items of lists, such as `asvs.failures.at_s`, one row each."""
    return tuple(_item_rows(ScenarioKeys, ""))


@cache
def sections() -> dict[str, str]:
    """Return the meaning of each section by its dotted name, in the order of the file."""
    found = _sections(ScenarioKeys, "")
    return {name: field.description or "" for name, field in found}


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a scenario file, for editors."""
    schema = ScenarioKeys.model_json_schema()
    schema["title"] = "bindusbl-des scenario"
    schema["description"] = "One mission of ASVs and AUVs: everything that decides it but the seed."
    # `route: {}` fits several kinds, which `oneOf` forbids; Scenario reads it as a lawnmower.
    route = schema["$defs"]["Auvs"]["properties"]["route"]
    route["anyOf"] = route.pop("oneOf")
    of_group = schema["$defs"]["AuvGroup"]["properties"]["route"]
    of_group["anyOf"] = [*route["anyOf"], {"type": "null"}]
    for family in (family for family in FAMILIES if not family.word):
        part = _property(schema, family.key)
        if "pattern" in part:  # its type allows any text
            del part["type"], part["pattern"]
            part["anyOf"] = list(_part_schemas(family))
        elif family.settings:  # beside coefficients
            part["anyOf"] += [
                _setting_schema([name], model) for name, model in family.settings.items()
            ]
    places = schema["$defs"]["Asvs"]["properties"]["formation"]
    places["anyOf"] = places.pop("oneOf")
    return {"$schema": DIALECT, **schema}


def _property(schema: dict[str, Any], key: str) -> dict[str, Any]:
    """Return the schema of a dotted key."""
    *sections, name = key.split(".")
    spot = schema
    for section in sections:
        spot = schema["$defs"][spot["properties"][section]["$ref"].rpartition("/")[2]]
    found: dict[str, Any] = spot["properties"][name]
    return found


def _part_schemas(family: Family[Any]) -> Iterator[dict[str, Any]]:
    """Yield the schemas of values at the key of a family: a name, or a mapping with settings."""
    own = {"type": "string", "pattern": "^[^:]+:[^:]+$"}
    bare = [name for name in family.siblings if name not in family.settings]
    yield {"type": "string", "enum": list(family.siblings)}
    if family.is_open:
        yield own
        common = {} if family.common is None else family.common.model_json_schema()["properties"]
        yield {"type": "object", "properties": {"model": own, **common}, "required": ["model"]}
    if bare:
        yield _setting_schema(bare, None)
    yield from (_setting_schema([name], model) for name, model in family.settings.items())


def _setting_schema(names: list[str], model: "type[BaseModel] | None") -> dict[str, Any]:
    """Return the schema of a mapping that names one of these parts, with its settings."""
    fields = model.model_json_schema()["properties"] if model else {}
    return {
        "type": "object",
        "properties": {"model": {"enum": names}, **fields},
        "required": ["model"],
        "additionalProperties": False,
    }


def _parts(annotation: Any) -> tuple[type[Part], ...]:
    """Return the sections that a field's type allows: none, one, or the arms of a union."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return (annotation,)
    if get_origin(annotation) in (Union, UnionType):
        return tuple(part for arm in get_args(annotation) for part in _parts(arm))
    return _parts(get_args(annotation)[0]) if get_origin(annotation) is Annotated else ()


def _sections(model: type[Part], prefix: str) -> Iterator[tuple[str, "FieldInfo"]]:
    """Yield each section by its dotted name, followed by the sections within it."""
    for name, field in model.model_fields.items():
        parts = _parts(field.annotation)
        if parts:
            yield f"{prefix}{name}", field
            yield from _sections(parts[0], f"{prefix}{name}.")


@cache
def optional_sections() -> frozenset[str]:
    """Return the sections that are null unless one of their keys is given."""
    found = _sections(ScenarioKeys, "")
    return frozenset(name for name, field in found if field.default is None)


def _rows(model: "type[BaseModel]", prefix: str, only: str) -> Iterator[Key]:
    for name, field in model.model_fields.items():
        parts = _parts(field.annotation)
        if len(parts) > 1:
            yield from _union_rows(parts, f"{prefix}{name}.")
        elif parts:
            yield from _rows(parts[0], f"{prefix}{name}.", only)
        else:
            yield _row(f"{prefix}{name}", field, only)


def _item_rows(model: type[Part], prefix: str) -> Iterator[Key]:
    for name, field in model.model_fields.items():
        for part in _parts(field.annotation):
            yield from _item_rows(part, f"{prefix}{name}.")
        for item in _items(field.annotation):
            for inner, own in item.model_fields.items():
                yield _row(f"{prefix}{name}.{inner}", own, "")


def _items(annotation: Any) -> tuple[type[Part], ...]:
    """Return the section that each item of a list is; none if items are no sections."""
    return _parts(get_args(annotation)[0]) if get_origin(annotation) is tuple else ()


def _union_rows(parts: tuple[type[Part], ...], prefix: str) -> Iterator[Key]:
    """Yield one row of `kind` or `model` with all its choices, then the keys of each choice.

    If that need not be named, keys of the first choice have no `only`.
    """
    word = WORDS[prefix.removesuffix(".")]
    first = parts[0].model_fields[word]
    yield _row(f"{prefix}{word}", first, "")
    found: dict[str, Key] = {}
    for part in parts:
        named = part.model_fields[word].default
        for row in _rows(part, prefix, named or ""):
            before = found.get(row.name)
            found[row.name] = replace(row, only=f"{before.only}, {named}") if before else row
    yield from (row for row in found.values() if row.name != word)


def _extra(field: "FieldInfo") -> dict[str, str]:
    extra = field.json_schema_extra
    known = extra if isinstance(extra, dict) else {}
    return {name: str(known.get(name, "")) for name in ("unit", "source")}


def _row(key: str, field: "FieldInfo", only: str) -> Key:
    extra = _extra(field)
    return Key(
        key,
        "choice" if as_for_all(key) in PARTS else _type(field.annotation),
        PARTS.get(as_for_all(key)) or _choices(field.annotation),
        extra["unit"],
        REQUIRED if field.is_required() else plain(field.default),
        _range(field.metadata),
        field.description or "",
        extra["source"],
        only,
    )


def _choices(annotation: Any) -> tuple[str, ...]:
    if isinstance(annotation, type) and issubclass(annotation, VehicleChoice):
        return tuple(annotation.MODELS)
    if get_origin(annotation) in (Union, UnionType):  # of names and something else
        return next(filter(None, map(_choices, get_args(annotation))), ())
    return get_args(annotation) if get_origin(annotation) is Literal else ()


def _type(annotation: Any) -> str:
    """Return a type in words, such as "list of [x, y], or null"."""
    origin, arms = get_origin(annotation), get_args(annotation)
    if annotation == Position:
        return "[lat, lon]"
    if len(_parts(annotation)) > 1:
        return "keys and values, or null"
    if origin is Annotated:
        return _type(arms[0])
    if origin in (Union, UnionType):
        kinds = [_type(arm) for arm in arms if arm is not type(None)]
        return ", or ".join([*kinds, "null"] if type(None) in arms else kinds)
    if origin is Literal or _choices(annotation):
        return "choice"
    if origin is tuple:
        if arms[-1] is Ellipsis:
            return f"list of {' | '.join(_choices(arms[0])) or _type(arms[0])}"
        return f"[{', '.join('xyz'[: len(arms)])}]"
    if parts := _parts(annotation):
        return f"{{{', '.join(parts[0].model_fields)}}}"
    if origin is Mapping:
        return "keys and values"
    return {bool: "true or false", int: "whole number", float: "number", str: "text"}[annotation]


def _range(metadata: list[Any]) -> str:
    """Return bounds in words, such as "> 0 and <= 20"."""
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    bounds = [
        f"{sign} {plain(float(getattr(item, name)))}"
        for name, sign in signs.items()
        for item in metadata
        if getattr(item, name, None) is not None
    ]
    lengths = {
        name: getattr(item, name)
        for name in ("min_length", "max_length")
        for item in metadata
        if getattr(item, name, None) is not None
    }
    if "max_length" in lengths:
        bounds.append(f"{lengths.get('min_length', 0)} to {lengths['max_length']} characters")
    elif "min_length" in lengths:
        bounds.append(f"at least {lengths['min_length']} character(s)")
    return " and ".join(bounds)
