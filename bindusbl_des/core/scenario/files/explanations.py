"""pydantic's errors about a scenario, reworded for the author of the file."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from ....support.plain_data import Path, dotted, value_at
from ....support.plain_yaml import scalar
from ....support.wording import described, did_you_mean, nearest, plain
from ..families import FAMILIES
from ..keys import REQUIRED, Key, as_for_all, items, keys, sections
from ..part_choice import SIGNS

ROUTE: Path = ("auvs", "route")
FORMATION: Path = ("asvs", "formation")
GROUPS: Path = ("auvs", "groups")
VESSELS: Path = ("asvs", "groups")
POLYGONS: tuple[Path, ...] = (("survey", "land"), ("survey", "keep_out"))

# (unit that a user wrote behind a number, unit of the key): the factor between them.
FACTORS = {
    **{("us", "s"): 1e-6, ("ms", "s"): 1e-3, ("min", "s"): 60.0, ("h", "s"): 3600.0},
    **{("mm", "m"): 1e-3, ("cm", "m"): 1e-2, ("km", "m"): 1e3, ("nmi", "m"): 1852.0},
    **{("kn", "m/s"): 1852 / 3600, ("km/h", "m/s"): 1 / 3.6, ("cm/s", "m/s"): 1e-2},
    **{("kHz", "Hz"): 1e3, ("Hz", "kHz"): 1e-3, ("kbps", "bit/s"): 1e3, ("kbit/s", "bit/s"): 1e3},
}

# The message about an unknown key lists at most so many keys.
MOST_LISTED = 12

# After so many unknown keys, messages no longer suggest similar keys, which takes 1 ms each.
MOST_EXPLAINED = 500


@dataclass(frozen=True)
class Finding:
    """One mistake in the data of a scenario: the path to it, and a message for the user.

    `at_key` tells that the key is wrong rather than its value.  `unsettled` are paths to other
    values that may be the wrong ones instead; contradictions with these are not reported.
    """

    path: Path
    message: str
    at_key: bool = False
    unsettled: tuple[Path, ...] = field(default=())


def in_words(error: ValidationError, data: Any) -> ValidationError:
    """Return the same error with our messages; each detail's context has its :class:`Finding`."""
    details = []
    for number, detail in enumerate(error.errors(include_url=False)):
        finding = explained(detail, data, briefly=number >= MOST_EXPLAINED)
        context = {"message": finding.message, "finding": finding}
        error_type = PydanticCustomError(detail["type"], "{message}", context)
        details.append(InitErrorDetails(type=error_type, loc=finding.path, input=detail["input"]))
    return ValidationError.from_exception_data(error.title, details)


def explained(error: Mapping[str, Any], data: Any, *, briefly: bool = False) -> Finding:
    """Return the meaning of one pydantic error; `data` is the scenario that was validated.

    `briefly` skips the search for similar keys.
    """
    path, kind, value = _path(error["loc"]), error["type"], error["input"]
    if kind == "extra_forbidden":
        return Finding(path, "unknown key", True) if briefly else _unknown(path, data)
    if kind == "missing" and not isinstance(path[-1], int):
        example = ", such as `name: my_mission`" if path == ("name",) else ""
        return Finding(path, f"missing; add it{example}", at_key=True)
    if kind in ("missing", "too_long"):  # a point of one number, or of three
        given = error["ctx"]["actual_length"] if kind == "too_long" else len(value)
        point = path[:-1] if kind == "missing" else path
        row = _row(point)
        pair = "[lat, lon]" if row and "[lat, lon]" in row.kind else "[x, y]"
        return Finding(point, f"needs two numbers {pair}; got a list of {given}")
    if kind == "union_tag_invalid":
        return _unknown_kind(path, value)
    if kind in ("model_type", "union_tag_not_found"):
        return Finding(path, _not_a_section(path, value))
    if kind == "moved":
        return Finding((*path, error["ctx"]["key"]), str(error["msg"]), at_key=True)
    if kind in ("vehicle", "part", "file", "place"):
        return Finding(path, str(error["msg"]))
    return Finding(path, _wrong_value(error, _row(path), path, value))


def guessed_kind(route: Mapping[str, Any]) -> str:
    """Return the kind of route that the author likely meant, by its spelling or else its keys."""
    kinds = next(row.choices for row in keys() if row.key == "auvs.route.kind")
    counts = [sum(row.only == kind and row.name in route for row in keys()) for kind in kinds]
    return nearest(str(route.get("kind")), kinds) or kinds[counts.index(max(counts))]


def _path(location: tuple[str | int, ...]) -> Path:
    """Return an error's path in the file, without the union member that pydantic puts in it."""
    ends = [2] if location[:2] in POLYGONS else _chosen(location)
    parts = [part for part in ends if len(location) > part]
    return (*location[: parts[0]], *location[parts[0] + 1 :]) if parts else location


def _chosen(path: Path) -> list[int]:
    """Return the index behind the section of a route or placement that a path enters, if any."""
    if path[:2] in (ROUTE, FORMATION):
        return [2]
    return [4] if path[:2] == GROUPS and path[3:4] == ("route",) else []


def _row(path: Path) -> Key | None:
    name = ".".join(part for part in path if isinstance(part, str))
    known = {row.key: row for row in (*keys(), *items())}
    return known.get(name) or known.get(as_for_all(name))


@cache
def _names(section: str, kind: str) -> tuple[str, ...]:
    """Return the keys and subsections that a section may have."""
    section = ".".join(part for part in section.split(".") if not part.isdigit())
    section = section if section in ("auvs.groups", "asvs.groups") else as_for_all(section)
    known = (*keys(), *items())
    rows = [row.name for row in known if row.section == section and _belongs(row, kind)]
    inner = [name.rpartition(".") for name in sections()]
    return (*rows, *(name for outer, _, name in inner if outer == section))


def _belongs(row: Key, kind: str) -> bool:
    """Tell whether a key fits a kind of route or a model of placement."""
    return row.only == "" or kind in row.only.split(", ")


def _kind(path: Path, data: Any) -> str:
    """Return the kind of route, or model of placement, of the section that a path enters, or ""."""
    for end in _chosen(path):
        section, is_route = value_at(data, path[:end]), path[end - 1] == "route"
        return str(
            section.get("kind" if is_route else "model") or ("lawnmower" if is_route else "ring")
        )
    return ""


def _unknown(path: Path, data: Any) -> Finding:
    section, name = as_for_all(dotted(path[:-1])), str(path[-1])
    chooser = next(
        (family.word for family in FAMILIES if family.word and family.key == section), ""
    )
    if chooser and name in ("kind", "model"):
        message = f"unknown key; {section} is chosen by its `{chooser}`"
        return Finding(path, message, True, ((*path[:-1], chooser),))
    kind = _kind(path, data)
    here = _names(section, kind)
    others = [row for row in keys() if row.section == section and row.name == name]
    if others and path[:2] == VESSELS:
        message = f"no key of a group, as all vessels have the same; say it in {others[0].key}"
        return Finding(path, message, True)
    if others:
        noun, chooser = ("route" if "route" in path else "placement"), others[0].chooser
        home = " or ".join(others[0].only.split(", ")) if others[0].only else "ring or positions"
        message = f"no key of a {kind} {noun}; it belongs to `{chooser}: {home}`"
        return Finding(path, message, True, ((*path[:-1], chooser),))
    homes = [other for other in ("", *sections()) if other != section and name in _names(other, "")]
    near = nearest(name, here)
    if homes and not (near or "").startswith(f"{name}_"):
        words = " or ".join(home or "the top level" for home in homes)
        unsettled = tuple(tuple(f"{home}.{name}".strip(".").split(".")) for home in homes)
        return Finding(path, f"unknown key; it belongs under {words}", True, unsettled)
    if near:
        message = f"unknown key; did you mean {near!r}?"
        return Finding(path, message, True, ((*path[:-1], near),))
    return Finding(path, f"unknown key; {_elsewhere(name, section, here)}", True)


def _elsewhere(name: str, section: str, here: Sequence[str]) -> str:
    """Return the remedy for a key that this section does not have."""
    if name.isdigit():
        return f"a decimal comma? write a point, as in 1.{name}"
    near = nearest(name, [row.name for row in keys()])
    if near and near.startswith(f"{name}_"):
        full = " or ".join(repr(row.key) for row in keys() if row.name == near)
        return f"did you mean {full}?"
    listed = [*here[:MOST_LISTED], *["..."] * (len(here) > MOST_LISTED)]
    where = f"under {section}" if section else "at the top level"
    return f"remove it; the keys {where} are {', '.join(listed)}"


def _unknown_kind(section: Path, route: Mapping[str, Any]) -> Finding:
    path = (*section, "kind")
    row, value = _row(path), route.get("kind")
    assert row is not None
    return Finding(path, _one_of(row.choices, value), unsettled=(section,))


def _one_of(choices: tuple[str, ...], value: Any) -> str:
    # YAML reads an empty value as null; its author may have meant the word none.
    asked = value if isinstance(value, str) else "none" if value is None else plain(value)
    hint = did_you_mean(asked, choices)
    words = f"one of {', '.join(choices)}" if len(choices) > 1 else choices[0]
    return f"must be {words}; got {described(value)}{hint}"


def _not_a_section(path: Path, value: Any) -> str:
    section = dotted(path)
    names = ", ".join(_names(section, "lawnmower")[:3])
    if value is None:
        return f"is empty; indent its keys ({names}, ...) under it, or remove it"
    return f"needs keys and values ({names}, ...); got {described(value)}"


def _wrong_value(error: Mapping[str, Any], row: Key | None, path: Path, value: Any) -> str:
    kind, context = error["type"], error.get("ctx", {})
    unit = f" {row.unit}" if row and row.unit not in ("", "1") else ""
    got = f"got {described(value)}"
    if row and row.choices and kind in ("literal_error", "string_type"):
        return _one_of(row.choices, value)
    if kind in SIGNS and row:
        limit = f"{SIGNS[kind]} {plain(next(iter(context.values())))}"
        return f"must be {limit if path_in_list(path) else row.range}{unit}; {got}"
    if kind in ("string_pattern_mismatch", "string_unicode"):
        return f"must hold no control characters; {got}"
    if kind.startswith("string_too") and row:
        return f"must have {row.range}; {got}"
    if kind == "finite_number":
        return f"must be a finite number{_range(row)}; {got}"
    if kind == "string_type":
        return f"needs a text; {got}{_in_quotes(value) or _when_empty(row, value)}"
    if kind == "tuple_type":
        return f"needs {_list_words(row, path)}; {got}{_when_empty(row, value)}"
    if kind in ("float_type", "int_type"):
        words = "a whole number" if kind == "int_type" else "a number"
        if isinstance(value, float):
            got = f"got {value}"  # 3.0 is no whole number
        limits = "" if path_in_list(path) else _range(row)
        return f"needs {words}{limits}; {got}{_remedy(row, value)}"
    return f"{error['msg']}; {got}"


def _in_quotes(value: Any) -> str:
    number = isinstance(value, bool | int | float)
    return f"; put it in quotes: '{plain(value)}'" if number else ""


def path_in_list(path: Path) -> bool:
    """Tell whether a path enters a list."""
    return any(isinstance(part, int) for part in path)


def _range(row: Key | None) -> str:
    unit = f" {row.unit}" if row and row.unit not in ("", "1") else ""
    return f" ({row.range}{unit})" if row and row.range else ""


def _list_words(row: Key | None, path: Path) -> str:
    """Return the type expected at a path into nested lists: each index removes one "list of"."""
    words = row.kind.removesuffix(", or null").rpartition("text, or ")[2] if row else "list"
    for _ in range(sum(isinstance(part, int) for part in path)):
        words = words.removeprefix("list of ")
    return words if words.startswith("[") else f"a {words}"


def _when_empty(row: Key | None, value: Any) -> str:
    if value is None and row:
        default = f" or remove the key (default {row.default})"
        return f"; give a value{'' if row.default == REQUIRED else default}"
    return ""


def _remedy(row: Key | None, value: Any) -> str:
    """Return how to write the number that the author meant."""
    if not isinstance(value, str):
        return _when_empty(row, value)
    text = value.strip()
    if isinstance(scalar(text), int | float) and not isinstance(scalar(text), bool):
        return "; remove the quotes"
    if re.fullmatch(r"[-+]?\d+,\d+", text):
        return f"; write the decimal point as {text.replace(',', '.')}"
    if re.fullmatch(r"[-+]?(0[xXob][0-9a-fA-F_]+|[0-9][0-9_]*)", text):
        return f"; write {_whole(text)}"
    if re.fullmatch(r"\d+(:\d+)+(\.\d*)?", text):
        return "; clock times are not read, write one number"
    if ends := re.fullmatch(r"(\d+)\s*(?:-|\.\.+)\s*(\d+)", text):
        return f"; a range to vary is written {ends[1]}:{ends[2]}"
    if number := re.match(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([a-zA-Z%/]+)", text):
        unit = row.unit if row else ""
        with suppress(KeyError, ValueError):
            meant = float(f"{float(number[1]) * FACTORS[number[2], unit]:.9g}")
            return f"; write {plain(meant)}, it is in {unit}"
        return f"; write {number[1]} alone, the unit is part of the key"
    return ""


def _whole(text: str) -> str:
    """Return the decimal number for text such as 0o17, 0x1f or 1_000."""
    try:
        return str(int(text, 0))
    except ValueError:
        return text.replace("_", "").lstrip("0") or "0"
