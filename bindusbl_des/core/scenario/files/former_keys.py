"""Keys that moved into the settings of parts: files, options and records of former versions."""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from ....support.mistakes import FilePlace, Mistake
from ....support.plain_data import Path, dotted
from ....support.plain_yaml import Document
from ....support.wording import plain
from ..families import FAMILIES
from ..key_types import Moved, Section, chosen, moved
from ..scenario_keys import ScenarioKeys

READ_YET = "the former spelling is read in this version only"

# Keys (section, name) that every record of a mission held before any key moved
OF_OLD = (
    *(("auvs", "turning_radius_m"), ("navigation", "gain"), ("protocol", "turnaround_s")),
    ("record", "detail"),
)


@cache
def _sections() -> dict[str, type[Section]]:
    found = {name: field.annotation for name, field in ScenarioKeys.model_fields.items()}
    return {
        name: kind
        for name, kind in found.items()
        if isinstance(kind, type) and issubclass(kind, Section)
    }


def _moved(path: Path) -> Moved | None:
    """Return the moved key at a path; None if there is none."""
    section = _sections().get(str(path[0])) if len(path) == 2 else None
    return next((move for move in section.MOVED if move.name == path[1]), None) if section else None


def is_former(key: str) -> bool:
    """Tell whether a dotted key is now a setting of a part."""
    return _moved(tuple(key.strip().split("."))) is not None


def key_now(key: str) -> str:
    """Return a dotted key in the present spelling.

    >>> key_now("navigation.gain"), key_now("navigation.filter")
    ('navigation.filter.gain', 'navigation.filter')
    """
    section, _, name = key.partition(".")
    move = _moved((section, name))
    return f"{section}.{move.part}.{name}" if move else key


def option_now(option: str) -> str:
    """Return an option ``dotted.key=value`` in the present spelling."""
    key, equals, value = option.partition("=")
    return f"{key_now(key.strip())}{equals}{value}" if is_former(key) else option


def path_now(data: Any, path: Path) -> Path:
    """Return the present path of a value: a setting of the part chosen in the data of a scenario.

    It is the same path where the chosen part has no such setting.
    """
    move = _moved(path)
    section = data.get(path[0], {}) if move and isinstance(data, dict) else None
    if move is None or not isinstance(section, dict):
        return path
    part = section.get(move.part, _sections()[str(path[0])].usual(move.part))
    return (path[0], move.part, move.name) if chosen(part) == move.owner else path


def move_keys(document: Document) -> None:
    """Move former keys of a document into the settings of parts, with a warning at each line.

    Keys of parts that are not chosen stay, and are mistakes once the scenario is validated.
    """
    for name, kind in _sections().items():
        found: list[Moved] = []
        for move in kind.MOVED:
            section = document.data.get(name)
            if isinstance(section, dict) and move.name in section:
                try:
                    document.data[name] = moved(section, move, kind.usual(move.part))
                except LookupError:
                    continue
                found.append(move)
        for move in found:
            former, now = (name, move.name), (name, move.part, move.name)
            place = document.keys.pop(former, FilePlace(document.file))
            document.keys[now] = place
            document.values[now] = document.values.pop(former, place)
            for places in (document.keys, document.values):
                places.setdefault((name, move.part), place)
            written = f"{move.part}: {plain(document.data[name][move.part])}"
            message = f"is a setting of {move.owner} now: write `{written}`; {READ_YET}"
            document.warnings.append(Mistake.at(place, dotted(former), message))


def as_now(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario that a former version recorded, in the present spelling.

    Records hold every key, also those of parts that were not chosen: these are left out, and so are
    moved keys with their default.
    """
    return {**record, **dict(_as_now(record))}


def is_of_old(data: Any) -> bool:
    """Tell whether a former version of the program recorded this scenario."""
    return isinstance(data, Mapping) and all(
        isinstance(data.get(section), Mapping) and name in data[section] for section, name in OF_OLD
    )


def _as_now(record: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    models = {family.key: family.settings for family in FAMILIES}
    for name, kind in _sections().items():
        section = record.get(name)
        if not isinstance(section, Mapping):
            continue
        for move in kind.MOVED:
            if move.name not in section:
                continue
            usual = models[f"{name}.{move.part}"][move.owner].model_fields[move.name].default
            rest = {key: value for key, value in section.items() if key != move.name}
            try:
                own = moved(section, move, kind.usual(move.part))
            except LookupError:
                own = rest
            section = rest if section[move.name] == usual else own
        yield name, dict(section)
