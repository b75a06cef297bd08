"""Options of the command line laid over an experiment: ``--vary key=v1,v2``, ``--seeds N``.

What is ``--set`` is laid over its scenario.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...scenario.files.mistakes import Mistake, Place
from ...scenario.files.plain_yaml import Document, Path, read_yaml
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


def written(vary: Mapping[str, Sequence[Any]]) -> tuple[str, ...]:
    """Return values to vary as one writes them after ``--vary``.

    >>> written({"asvs.count": [2, 3]})
    ('asvs.count=2, 3',)
    """
    return tuple(f"{key}={as_written(list(values))[1:-1]}" for key, values in vary.items())


def lay_over(document: Document, options: Options) -> None:
    """Lay options over the data of an experiment file; their mistakes go to the document."""
    for text in options.vary:
        _vary(document, text)
    for text in options.until_ci:
        _until_ci(document, text)
    for key in ("seeds", "detail"):
        value = getattr(options, key)
        if value is not None:
            document.data[key] = value
            _stand(document, (key,), Place(f"--{key} {as_written(value)}"))


def _vary(document: Document, text: str) -> None:
    form = "dotted.key=value,value,..., such as asvs.count=2,3"
    read = _read(document, "vary", text, form, "[{}]")
    if read is None:
        return
    key, values, place = read
    _put(document, "vary", key, values, place)
    for number in range(len(values)):
        _stand(document, ("vary", key, number), place)


def _until_ci(document: Document, text: str) -> None:
    form = "METRIC=WIDTH, such as position_error_m=5%"
    read = _read(document, "until_ci", text, form, "{}")
    if read is not None:
        _put(document, "until_ci", *read)


def _read(
    document: Document, section: str, text: str, form: str, yaml: str
) -> tuple[str, Any, Place] | None:
    """Return key, value and place of one option; None where it cannot be read."""
    place = Place(f"--{section.replace('_', '-')} {text}")
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


def _put(document: Document, name: str, key: str, value: Any, place: Place) -> None:
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


def _stand(document: Document, path: Path, place: Place) -> None:
    """Note that what is at a path, and below it, stands in an option now."""
    for places in (document.keys, document.values):
        for known in [known for known in places if known[: len(path)] == path]:
            del places[known]
        places[path] = place
