"""What is laid over an experiment: ``--vary key=v1,v2`` or, in Python, ``vary={key: [v1, v2]}``;
what is ``--set`` is laid over its scenario.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ...core.mistakes import FilePlace, Mistake
from ...core.plain_data import Path
from ...core.plain_yaml import Document, read_yaml
from ...core.plugins import name_of
from ...core.wording import described, shortened
from .experiment import as_written


@dataclass(frozen=True)
class Options:
    """What was asked for besides the file; None and () leave the file as it is."""

    vary: tuple[str, ...] = ()
    until_ci: tuple[str, ...] = ()
    seeds: Any = None
    detail: Any = None
    overrides: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return self != Options()


@dataclass(frozen=True)
class PythonArguments:
    """The same as arguments of Python's, checked to be of the right kind; None asks for nothing.

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


def _check_mapping(name: str, value: Any, form: str) -> None:
    if value is not None and not isinstance(value, Mapping):
        raise TypeError(f"{name} needs a mapping such as {form}; got {described(value)}")
    for key in value or ():
        if not isinstance(key, str):
            raise TypeError(f"{name} needs text as keys, as in {form}; got {described(key)}")


def lay_over(document: Document, options: Options | PythonArguments) -> None:
    """Lay options over the data of an experiment file; their mistakes go to the document."""
    if isinstance(options, PythonArguments):
        _lay_asked(document, options)
    else:
        _lay_written(document, options)


def _lay_asked(document: Document, asked: PythonArguments) -> None:
    if asked.vary == {}:
        document.data["vary"] = {}
        _stand(document, ("vary",), _said("vary", {}))
    for key, values in (asked.vary or {}).items():
        plain = _plain(values)
        place = _said("vary", {key: plain})
        _put(document, "vary", key, plain, place)
        _stand_each(document, ("vary", key), plain, place)
    if asked.points is not None:
        points = document.data["points"] = [_plain(point) for point in asked.points]
        _stand(document, ("points",), _said("points", points[:1]))
        for number, point in enumerate(points):
            place = _said(f"points[{number}]", point)
            for path in (("points", number), *(("points", number, key) for key in point)):
                document.keys[path] = document.values[path] = place
    for metric, width in (asked.until_ci or {}).items():
        _put(document, "until_ci", metric, _plain(width), _said("until_ci", {metric: width}))
    for name in ("seeds", "detail"):
        value = getattr(asked, name)
        if value is not None:
            plain, place = _plain(value), _said(name, value)
            document.data[name] = plain
            _stand(document, (name,), place)
            _stand_each(document, (name,), plain, place)


def _said(name: str, value: Any) -> FilePlace:
    return FilePlace(shortened(f"{name}={value!r}"))


def _plain(value: Any) -> Any:
    """Return plain data: ranges, arrays and the like as lists, parts of one's own by their names.

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


def _lay_written(document: Document, options: Options) -> None:
    for text in options.vary:
        _vary(document, text)
    for text in options.until_ci:
        _until_ci(document, text)
    for key in ("seeds", "detail"):
        value = getattr(options, key)
        if value is not None:
            document.data[key] = value
            _stand(document, (key,), FilePlace(f"--{key} {as_written(value)}"))


def _vary(document: Document, text: str) -> None:
    form = "dotted.key=value,value,..., such as asvs.count=2,3"
    read = _read(document, "vary", text, form, "[{}]")
    if read is None:
        return
    key, values, place = read
    _put(document, "vary", key, values, place)
    _stand_each(document, ("vary", key), values, place)


def _until_ci(document: Document, text: str) -> None:
    form = "METRIC=WIDTH, such as position_error_m=5%"
    read = _read(document, "until_ci", text, form, "{}")
    if read is not None:
        _put(document, "until_ci", *read)


def _read(
    document: Document, section: str, text: str, form: str, yaml: str
) -> tuple[str, Any, FilePlace] | None:
    """Return key, value and place of one option; None where it cannot be read."""
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
    _stand(document, (name, key), place)


def _stand_each(document: Document, path: Path, values: Any, place: FilePlace) -> None:
    """Note that the items of a list at a path stand in an option now."""
    for number in range(len(values) if isinstance(values, list) else 0):
        _stand(document, (*path, number), place)


def _stand(document: Document, path: Path, place: FilePlace) -> None:
    """Note that what is at a path, and below it, stands in an option now."""
    for places in (document.keys, document.values):
        for known in [known for known in places if known[: len(path)] == path]:
            del places[known]
        places[path] = place
