"""Options ``--set dotted.key=value`` laid over the data of a scenario file."""

from typing import Any

from .mistakes import Mistake, Place
from .plain_yaml import Document, Path, dotted, read_yaml
from .scenario import Scenario
from .wording import described


def override(document: Document, option: str) -> None:
    """Lay one ``dotted.key=value`` over a document; its mistakes go to the document.

    Values follow the rules of the file, `[1, 2]` is a list, and items of lists are numbered from 0:
    ``asvs.formation.positions_m.0.1=5``.
    """
    place = Place(f"--set {option}")
    name, equals, text = option.partition("=")
    parts = name.strip().split(".")
    if not equals or not all(parts):
        message = "needs the form dotted.key=value, such as acoustics.hf.range_m=100"
        document.mistakes.append(Mistake.at(place, "", message))
        return
    path: Path = tuple(int(part) if part.isascii() and part.isdigit() else part for part in parts)
    value = read_yaml(text, place.file)
    if value.mistakes:
        message = value.mistakes[0].message
        document.mistakes.append(Mistake.at(place, dotted(path), message))
        document.unsettled.add(path)
        return
    problem = _put(document, path, value.data)
    if problem:
        document.report(place, path, problem)
        return
    for places in (document.keys, document.values):
        for known in [known for known in places if known[: len(path)] == path]:
            del places[known]
        # A section that this option created stands where the option stands.
        for length in range(1, len(path) + 1):
            places.setdefault(path[:length], place)


def _put(document: Document, path: Path, value: Any) -> str:
    """Put a value at a path, creating sections on the way; return what prevents it, or ""."""
    if not isinstance(document.data, dict):
        return ""
    spot: Any = document.data
    for depth, part in enumerate(path):
        last = depth == len(path) - 1
        problem = _misfit(spot, part, dotted(path[:depth]) or "the scenario")
        if problem:
            return problem
        if last:
            spot[part] = value
        else:
            spot = _inside(spot, part, path[: depth + 1])
            if not isinstance(spot, dict | list):
                return f"{dotted(path[: depth + 1])} has no keys; it is {described(spot)}"
    return ""


def _misfit(spot: Any, part: str | int, name: str) -> str:
    """Return why a dict or list cannot have such a key or item, or ""."""
    if isinstance(part, str):
        return f"{name} is a list; its items are numbered from 0" if isinstance(spot, list) else ""
    if not isinstance(spot, list):
        return f"{name} is no list, so it has no item {part}"
    if part >= len(spot):
        items = f"the items are 0 to {len(spot) - 1}" if spot else "it is empty"
        return f"{name} has no item {part}; {items}"
    return ""


def _inside(spot: Any, part: str | int, path: Path) -> Any:
    """Return what is at a key of a dict or list; what the file leaves out begins as its default."""
    if isinstance(spot, dict) and part not in spot:
        default = _default(path)
        spot[part] = list(default) if isinstance(default, list | tuple) else {}
    return spot[part]


def _default(path: Path) -> Any:
    value: Any = Scenario(name="default").model_dump(mode="json")
    for part in path:
        value = value.get(part) if isinstance(value, dict) else None
    return value
