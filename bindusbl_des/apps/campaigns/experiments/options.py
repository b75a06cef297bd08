"""Options laid over an experiment (``--vary key=v1,v2``; in Python ``vary={key: [v1, v2]}``) and
over its scenario (``--set``).
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ....support.mistakes import FilePlace, Mistake
from ....support.plain_data import Path
from ....support.plain_yaml import Document, read_yaml
from ....support.plugins import name_of
from ....support.wording import described, shortened
from .experiment import as_written

# A section, a key of it, its value, and where that stands.
Keyed = tuple[str, str, Any, FilePlace]


@dataclass(frozen=True)
class Options:
    """Values given beside the file; None and () leave the file's values."""

    vary: tuple[str, ...] = ()
    until_ci: tuple[str, ...] = ()
    seeds: Any = None
    detail: Any = None
    overrides: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return self != Options()

    def place(self, name: str, value: Any) -> FilePlace:
        """Return the place of an option's value."""
        return FilePlace(f"--{name} {as_written(value)}")

    def keyed(self, document: Document) -> Iterator[Keyed]:
        """Yield the values given by key; unreadable ones go to the document."""
        for section, texts, form, yaml in (
            ("vary", self.vary, "dotted.key=value,value,..., such as asvs.count=2,3", "[{}]"),
            ("until_ci", self.until_ci, "METRIC=WIDTH, such as position_error_m=5%", "{}"),
        ):
            found = (_read(document, section, text, form, yaml) for text in texts)
            yield from ((section, *read) for read in found if read is not None)


@dataclass(frozen=True)
class PythonArguments:
    """The same options as Python arguments, with checked types; None asks for nothing.

    Raises:
        TypeError: when `vary`, `until_ci` or one of the `points` is no mapping of texts.
    """

    vary: Mapping[str, Iterable[Any]] | None = None
    until_ci: Mapping[str, float | str] | None = None
    seeds: Any = None
    detail: Any = None
    points: Iterable[Mapping[str, Any]] | None = None
    overrides: tuple[()] = ()

    def __post_init__(self) -> None:
        _check_mapping("vary", self.vary, '{"asvs.count": [1, 2, 3]}')
        _check_mapping("until_ci", self.until_ci, '{"worst_position_error_m": "5%"}')
        if self.points is None:
            return
        form = '[{"asvs.count": 2}, {"asvs.count": 3}]'
        if hasattr(self.points, "to_dict"):  # a frame, a point in each row
            object.__setattr__(self, "points", self.points.to_dict("records"))
        if isinstance(self.points, str | Mapping) or not isinstance(self.points, Iterable):
            raise TypeError(f"points needs a list such as {form}; got {described(self.points)}")
        object.__setattr__(self, "points", list(self.points))
        for number, point in enumerate(self.points):
            _check_mapping(f"points[{number}]", point or {}, form)

    def __bool__(self) -> bool:
        asked = self.vary, self.until_ci, self.seeds, self.detail, self.points
        return any(option is not None for option in asked)

    def place(self, name: str, value: Any) -> FilePlace:
        """Return the text that names the place of an argument."""
        return FilePlace(shortened(f"{name}={value!r}"))

    def keyed(self, document: Document) -> Iterator[Keyed]:
        """Yield the values given by key."""
        if self.vary == {}:
            document.data["vary"] = {}
            _stand(document, ("vary",), None, self.place("vary", {}))
        for section in ("vary", "until_ci"):
            for key, value in (getattr(self, section) or {}).items():
                plain = _plain(value)
                yield section, key, plain, self.place(section, {key: plain})


def _check_mapping(name: str, value: Any, form: str) -> None:
    if value is not None and not isinstance(value, Mapping):
        raise TypeError(f"{name} needs a mapping such as {form}; got {described(value)}")
    for key in value or ():
        if not isinstance(key, str):
            raise TypeError(f"{name} needs text as keys, as in {form}; got {described(key)}")


def lay_over(document: Document, options: Options | PythonArguments) -> None:
    """Lay options over the data of an experiment file; their mistakes go to the document."""
    for section, key, value, place in options.keyed(document):
        _put(document, section, key, value, place)
    for name in ("seeds", "detail"):
        value = _plain(getattr(options, name))
        if value is not None:
            document.data[name] = value
            _stand(document, (name,), value, options.place(name, getattr(options, name)))
    if isinstance(options, PythonArguments) and options.points is not None:
        points = document.data["points"] = [_plain(point) for point in options.points]
        _stand(document, ("points",), None, options.place("points", points[:1]))
        for number, point in enumerate(points):
            place = options.place(f"points[{number}]", point)
            for path in (("points", number), *(("points", number, key) for key in point)):
                document.keys[path] = document.values[path] = place


def _plain(value: Any) -> Any:
    """Return plain data: ranges, arrays and the like as lists, user-defined parts by their names.

    >>> _plain(range(3)), _plain("dsatur"), _plain((1, (2, 3)))
    ([0, 1, 2], 'dsatur', [1, [2, 3]])
    """
    if hasattr(value, "tolist"):  # of numpy's or pandas'
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if callable(value):
        return name_of(value)
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        return [_plain(item) for item in value]
    return value


def _read(
    document: Document, section: str, text: str, form: str, yaml: str
) -> tuple[str, Any, FilePlace] | None:
    """Return key, value and place of an option ``key=value``; None where it cannot be read."""
    place = FilePlace(f"--{section.replace('_', '-')} {text}")
    key, equals, value = text.partition("=")
    key = key.strip()
    if not equals or not key:
        document.mistakes.append(Mistake.at(place, "", f"needs the form {form}"))
        return None
    read = read_yaml(yaml.format(value), place.file)
    if read.mistakes:
        document.report(place, (section, key), read.mistakes[0].message)
        return None
    return key, read.data, place


def _put(document: Document, name: str, key: str, value: Any, place: FilePlace) -> None:
    section = document.data.setdefault(name, {})
    for places in (document.keys, document.values):
        places.setdefault((name,), place)
    if not isinstance(section, dict):  # which is told where the file is checked
        return
    if document.keys.get((name, key), place).file.startswith("--") and key in section:
        document.report(place, (name, key), "given twice; keep one option with all of it")
        return
    section[key] = value
    _stand(document, (name, key), value, place)


def _stand(document: Document, path: Path, value: Any, place: FilePlace) -> None:
    """Record that the value at a path, and each item of a list, now comes from an option."""
    items = [(*path, number) for number in range(len(value) if isinstance(value, list) else 0)]
    for places in (document.keys, document.values):
        for known in [known for known in places if known[: len(path)] == path]:
            del places[known]
        places |= dict.fromkeys((path, *items), place)
