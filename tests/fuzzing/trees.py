"""Nested data, such as of a scenario, with something wrong in it; and as YAML."""

import copy
import json
from collections.abc import Iterator
from random import Random
from typing import Any

from .values import NUMBERS, VALUES, YAML


class Raw(str):
    """YAML that is written as it is."""


def mutated(data: Any, draw: Random, *, raw: bool = False) -> Any:
    """Return the data with one thing changed in place; `raw` allows for odd YAML as well."""
    places = list(_places(data))
    if not places:
        return odd(draw)
    where, key = draw.choice(places)
    how = draw.choice((_put, _put, _put, _number, _drop, _rename, _wrap, _swap, _resize))
    if raw and draw.random() < 0.15:
        where[key] = Raw(draw.choice(YAML))
    else:
        how(where, key, draw, places)
    return data


def odd(draw: Random) -> Any:
    """Return a value that does not belong; lists are new ones, since others change them."""
    return copy.deepcopy(draw.choice(VALUES))


def put(data: Any, dotted: str, value: Any) -> None:
    """Put a value at a dotted key, through whatever sections there are."""
    *above, name = dotted.split(".")
    for part in above:
        if not isinstance(data.get(part), dict):
            data[part] = {}
        data = data[part]
    data[name] = value


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each container in the data with each of its keys."""
    keys = list(data) if isinstance(data, dict) else range(len(data)) if _is_list(data) else ()
    for key in keys:
        yield data, key
        yield from _places(data[key])


def _is_list(data: Any) -> bool:
    return isinstance(data, list)


def _put(where: Any, key: Any, draw: Random, _: Any) -> None:
    where[key] = odd(draw)


def _number(where: Any, key: Any, draw: Random, _: Any) -> None:
    where[key] = draw.choice(NUMBERS)


def _drop(where: Any, key: Any, draw: Random, _: Any) -> None:
    del where[key]


def _rename(where: Any, key: Any, draw: Random, _: Any) -> None:
    name = str(key)
    others = (name[:-1], name.upper(), f" {name}", f"{name}_m", "x" * 400, "", "\0", "0", "count")
    if isinstance(where, dict):
        where[draw.choice(others)] = where.pop(key)
    else:
        where[key] = draw.choice(others)


def _wrap(where: Any, key: Any, draw: Random, _: Any) -> None:
    value = where[key]
    for _ in range(draw.choice((1, 1, 2, 30))):
        value = [value] if draw.random() < 0.5 else {draw.choice(("", "a", str(key))): value}
    where[key] = value


def _swap(where: Any, key: Any, draw: Random, places: list[tuple[Any, Any]]) -> None:
    """Put a copy of another part in its place."""
    there, other = draw.choice(places)
    try:
        where[key] = json.loads(json.dumps(there[other]))
    except (RecursionError, ValueError):
        where[key] = None


def _resize(where: Any, key: Any, draw: Random, _: Any) -> None:
    value = where[key]
    if not _is_list(value):
        where[key] = [copy.deepcopy(value) for _ in range(draw.choice((0, 1, 2, 3, 100)))]
    elif draw.random() < 0.5:
        value += copy.deepcopy(value[-1:]) * draw.choice((1, 30))
    else:
        del value[draw.randrange(len(value) + 1) :]


def as_yaml(data: Any, indent: int = 0) -> str:
    """Return nested data as YAML: sections in lines, lists and whatever is in them in brackets."""
    if not isinstance(data, dict) or not data:
        return _flow(data) + "\n"
    lines = []
    for key, value in data.items():
        name = key if isinstance(key, str) and key.replace(".", "_").isidentifier() else _flow(key)
        section = isinstance(value, dict) and value
        text = "\n" + as_yaml(value, indent + 2) if section else f" {_flow(value)}\n"
        lines.append(f"{' ' * indent}{name}:{text}")
    return "".join(lines)


def _flow(data: Any) -> str:
    if isinstance(data, Raw):
        return str(data)
    if isinstance(data, dict):
        return "{" + ", ".join(f"{_flow(key)}: {_flow(data[key])}" for key in data) + "}"
    if _is_list(data):
        return "[" + ", ".join(map(_flow, data)) + "]"
    if isinstance(data, float):
        return {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}.get(repr(data), repr(data))
    return json.dumps(data, ensure_ascii=False)
