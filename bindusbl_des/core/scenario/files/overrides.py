"""Options ``--set dotted.key=value`` applied to the data of a scenario file."""

from collections.abc import Collection
from copy import deepcopy
from functools import cache
from typing import Any

from ....support.mistakes import FilePlace, Mistake
from ....support.plain_data import (
    Path,
    dotted,
    path_of,
    value_at,
)
from ....support.plain_yaml import Document, read_yaml
from ....support.wording import described
from ..families import FAMILIES
from ..keys import as_for_all, keys, settings
from ..scenario import Scenario
from .former_keys import READ_YET, path_now

# Keys that choose a part within a section, and keys whose value is a part or a mapping with one.
CHOOSERS = frozenset({"model", "kind"})
PARTS = tuple(family.key for family in FAMILIES if not family.word)


def override(document: Document, option: str) -> None:
    """Apply one ``dotted.key=value`` to a document; its mistakes go to the document.

    Values follow the rules of the file: `[1, 2]` is a list.  Items of lists are numbered from 0:
    ``asvs.formation.positions_m.0.1=5``.  A newly chosen model begins without the settings of the
    former one, except those that an earlier option gave.
    """
    place = FilePlace(f"--set {option}")
    name, equals, text = option.partition("=")
    path = path_of(name.strip())
    if not equals or "" in path:
        message = "needs the form dotted.key=value, such as acoustics.hf.range_m=100"
        document.mistakes.append(Mistake.at(place, "", message))
        return
    if (now := path_now(document.data, path)) != path:
        message = f"is a setting now: write --set {dotted(now)}={text}; {READ_YET}"
        document.warnings.append(Mistake.at(place, dotted(path), message))
        path = now
    value = read_yaml(text, place.file)
    if value.mistakes:
        message = value.mistakes[0].message
        document.mistakes.append(Mistake.at(place, dotted(path), message))
        document.unsettled.add(path)
        return
    beside = (item for item in document.keys.items() if item[0][:-1] == path[:-1])
    given = [known[-1] for known, at in beside if at.file.startswith("--")]
    problem = _put(document.data, path, value.data, given)
    if problem:
        document.report(place, path, problem)
        return
    for places in (document.keys, document.values):
        for known in [known for known in places if known[: len(path)] == path]:
            del places[known]
        places.update(((*path, *below), place) for below in value.values)
        # A section that this option creates has the place of the option in messages.
        for length in range(1, len(path) + 1):
            places.setdefault(path[:length], place)


def put(data: dict[str, Any], key: str, value: Any) -> str:
    """Put a value at a dotted key of a scenario's data; return what prevents it, or ""."""
    return _put(data, path_now(data, path_of(key)), value)


def _put(data: Any, path: Path, value: Any, kept: Collection[str | int] = ()) -> str:
    """Put a value at a path, creating sections as needed; return what prevents it, or "".

    A newly chosen part drops settings that it does not have, but for those `kept`; a part that is
    chosen again keeps its settings.
    """
    if not isinstance(data, dict):
        return ""
    spot: Any = data
    for depth, part in enumerate(path):
        last = depth == len(path) - 1
        problem = _misfit(spot, part, path[:depth])
        if problem:
            return problem
        if last:
            if part in CHOOSERS and isinstance(spot, dict) and spot.get(part) != value:
                for name in _not_of(as_for_all(dotted(path[:-1])), value) - set(kept):
                    spot.pop(name, None)
            is_same = as_for_all(dotted(path)) in PARTS and value == _named(spot.get(part))
            spot[part] = spot[part] if is_same else value
        else:
            spot = _inside(spot, part, path[: depth + 1])
            if not isinstance(spot, dict | list):
                return f"{dotted(path[: depth + 1])} has no keys; it is {described(spot)}"
    return ""


def _named(part: Any) -> str | None:
    """Return the name of the part in a mapping with settings; else None."""
    return part.get("model") if isinstance(part, dict) else None


def _not_of(section: str, chosen: Any) -> set[str]:
    """Return the settings in a section that do not belong to the part chosen there."""
    rows = [row for row in (*keys(), *settings()) if row.section == section]
    of_it = [row for row in rows if row.only and chosen in row.only.split(", ")]
    # Settings without an owner belong to a part without settings, such as a ring of moored ASVs.
    of_it += [row for row in rows if not row.only and not of_it]
    return {row.name for row in rows if row not in of_it} - CHOOSERS


def _misfit(spot: Any, part: str | int, path: Path) -> str:
    """Return why the dict or list at a path cannot have such a key or index; "" if it can."""
    if isinstance(part, str):
        fits = not isinstance(spot, list)
    else:
        fits = isinstance(spot, list) and part < len(spot)
    if fits:
        return ""
    name = dotted(path) or "the scenario"
    if isinstance(part, str):
        return f"{name} is a list; its items are numbered from 0"
    if not isinstance(spot, list):
        return f"{name} is no list, so it has no item {part}"
    items = f"the items are 0 to {len(spot) - 1}" if spot else "it is empty"
    return f"{name} has no item {part}; {items}"


def _inside(spot: Any, part: str | int, path: Path) -> Any:
    """Return the value at a key or index; a value that the file leaves out begins as its default.

    A part given by name alone becomes a mapping, which can take settings.
    """
    is_part = as_for_all(dotted(path)) in PARTS
    if isinstance(spot, dict) and part not in spot:
        default = value_at(_defaults(), as_for_all(dotted(path)).split("."))
        spot[part] = deepcopy(default) if is_part or isinstance(default, list) else {}
    if is_part and isinstance(spot[part], str):
        spot[part] = {"model": spot[part]}
    return spot[part]


@cache
def _defaults() -> dict[str, Any]:
    return Scenario(name="default").model_dump(mode="json")
