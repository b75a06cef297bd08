"""Options of the command line laid over an experiment: ``--vary key=v1,v2``, ``--seeds N``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...mistakes import Mistake, Place
from ...plain_yaml import Document, Path, read_yaml
from .experiment import as_written


@dataclass(frozen=True)
class Options:
    """What was asked for besides the file; None and () leave the file as it is."""

    vary: tuple[str, ...] = ()
    seeds: Any = None
    detail: Any = None

    def __bool__(self) -> bool:
        return bool(self.vary) or any(value is not None for value in (self.seeds, self.detail))


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
    for key in ("seeds", "detail"):
        value = getattr(options, key)
        if value is not None:
            document.data[key] = value
            _stand(document, (key,), Place(f"--{key} {as_written(value)}"))


def _vary(document: Document, text: str) -> None:
    place = Place(f"--vary {text}")
    key, equals, listed = text.partition("=")
    key = key.strip()
    if not equals or not key:
        message = "needs the form dotted.key=value,value,..., such as asvs.count=2,3"
        document.mistakes.append(Mistake.at(place, "", message))
        return
    values = read_yaml(f"[{listed}]", place.file)
    if values.mistakes or not isinstance(values.data, list):
        message = values.mistakes[0].message if values.mistakes else "needs values"
        document.report(place, ("vary", key), message)
        return
    section = document.data.setdefault("vary", {})
    document.keys.setdefault(("vary",), place)
    document.values.setdefault(("vary",), place)
    if not isinstance(section, dict):  # which is told where the file is checked
        return
    if document.keys.get(("vary", key), Place("")).file.startswith("--vary"):
        document.report(place, ("vary", key), "given twice; name all its values after one --vary")
        return
    section[key] = values.data
    _stand(document, ("vary", key), place)
    for number in range(len(values.data)):
        _stand(document, ("vary", key, number), place)


def _stand(document: Document, path: Path, place: Place) -> None:
    """Note that what is at a path, and below it, stands in an option now."""
    for places in (document.keys, document.values):
        for known in [known for known in places if known[: len(path)] == path]:
            del places[known]
        places[path] = place
