"""YAML read as plain data, with the position of every key: no tags, no anchors, no guessing.

PyYAML by itself resolves `on`, `12:30` and dates to surprising values, accepts repeated keys
silently and can be made to build objects.  Here the events of its parser become dicts, lists and
the scalars of YAML 1.2: a word that is not null, true, false or a decimal number stays text.
Aliases are refused, so the cost of a file is proportional to its length.  Errors of syntax are
explained in plain words.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import yaml

from .mistakes import FilePlace, Mistake, Problem, ScenarioError
from .plain_data import Path, dotted, path_of
from .wording import shortened

# Messages of the parsers (libyaml, PyYAML), and what they mean to the author of the file.
_PROBLEMS = {
    "mapping values are not allowed": "a ':' where none can be; check the indentation and the line "
    "above, or put text that holds ': ' in quotes",
    "could not find expected ':'": "a key without ':'; write `key: value`, with a space",
    "did not find expected ','": "[ or { is not closed, or a comma is missing",
    "expected ',' or": "[ or { is not closed, or a comma is missing",
    "did not find expected node content": "[ or { is not closed, or a value is missing",
    "unexpected end of stream": "a quote is not closed",
    "did not find expected key": "the indentation fits no key above; align it",
    "expected <block end>": "the indentation fits no key above; align it",
    "did not find expected '-'": "the indentation fits no list item above; align it",
    "expected <document start>": "the indentation fits no key above; align it",
    "invalid Unicode character escape": "an escape of half a character (\\ud83d); write "
    "the character itself, or its one escape such as \\U0001f41f",
    "cannot start any token": "a character that starts no value (such as @ ` %); use quotes",
}


def syntax_mistake(error: yaml.YAMLError, text: str, file: str) -> tuple[FilePlace, str]:
    """Return the position of a syntax error in YAML, and a message in plain words."""
    if isinstance(error, yaml.reader.ReaderError):
        before = text[: error.position]
        column = error.position - before.rfind("\n")
        place = FilePlace(file, before.count("\n") + 1, column)
        return place, "YAML syntax: a control character; is this a text file?"
    mark = getattr(error, "problem_mark", None)
    problem = str(getattr(error, "problem", None) or error).splitlines()[0]
    if mark is None:
        return FilePlace(file), f"YAML syntax: {problem}"
    place = FilePlace(file, mark.line + 1, mark.column + 1)
    lines = text.splitlines()
    line = lines[mark.line] if mark.line < len(lines) else ""
    indentation = line[: len(line) - len(line.lstrip())]
    if "\t" in indentation or line[mark.column : mark.column + 1] == "\t":
        return place, "YAML syntax: a tab in the indentation; use spaces"
    for part, words in _PROBLEMS.items():
        if part in problem:
            return place, f"YAML syntax: {words}"
    return place, f"YAML syntax: {problem}"


LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# A scenario of thousands of vehicles has some 100 kB.
LARGEST_FILE = 1_000_000

# No scenario is nested deeper than six; a limit keeps `[[[[...` from exhausting the stack.
DEEPEST = 20

# Python converts longer whole numbers in quadratic time or not at all; they become floats.
LONGEST_WHOLE_NUMBER = 300

# A leading zero is octal to YAML 1.1 and decimal to YAML 1.2, so it is neither here.
WHOLE = re.compile(r"[-+]?(0|[1-9][0-9]*)")
REAL = re.compile(r"[-+]?(\.[0-9]+|[0-9]+\.[0-9]*)([eE][-+]?[0-9]+)?|[-+]?[0-9]+[eE][-+]?[0-9]+")
INFINITE = re.compile(r"[-+]?\.(inf|Inf|INF)")
NOT_A_NUMBER = re.compile(r"\.(nan|NaN|NAN)")
WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}


def scalar(text: str) -> Any:
    """Return the value of an unquoted word in YAML 1.2: a number, a truth value, None or text.

    >>> scalar("1e3"), scalar("12:30"), scalar("on"), scalar("~")
    (1000.0, '12:30', 'on', None)
    """
    if text in WORDS:
        return WORDS[text]
    if WHOLE.fullmatch(text):
        return int(text) if len(text) <= LONGEST_WHOLE_NUMBER else float(text)
    if REAL.fullmatch(text):
        return float(text)
    if INFINITE.fullmatch(text) or NOT_A_NUMBER.fullmatch(text):
        return float(text.replace(".", ""))
    return text


@dataclass
class Document:
    """The data of a YAML text, the position of each key and value, and its mistakes.

    `warnings` are of valid keys that are spelt otherwise now. `unsettled` are paths whose values
    are not in the data as the author meant them.
    """

    file: str
    data: Any = None
    keys: dict[Path, FilePlace] = field(default_factory=dict)
    values: dict[Path, FilePlace] = field(default_factory=dict)
    mistakes: list[Mistake] = field(default_factory=list)
    warnings: list[Mistake] = field(default_factory=list)
    unsettled: set[Path] = field(default_factory=set)

    def place(self, path: Path, at_key: bool = False) -> FilePlace:
        """Return the position of a path, or of the section in which it is missing."""
        places = self.keys if at_key else self.values
        for length in range(len(path), 0, -1):
            if path[:length] in places:
                return places[path[:length]]
        return self.keys.get((), FilePlace(self.file, 1, 1))

    def mistake(self, problem: Problem) -> Mistake:
        """Return a problem as a mistake at its key, or at another key of it that the file has."""
        paths = [path_of(key) for key in (problem.key, *problem.others)]
        at = self.place(next((path for path in paths if path in self.values), paths[0]))
        return Mistake.at(at, problem.key, problem.message)

    def report(self, place: FilePlace, path: Path, message: str) -> None:
        """Add a mistake at a position, and mark the value at its path as unsettled."""
        self.mistakes.append(Mistake.at(place, dotted(path), message))
        self.unsettled.add(path)

    def note(self, path: Path, message: str, at_key: bool = False) -> None:
        """Add a mistake at a path's value, or key; at the top of the file if that is missing."""
        places = self.keys if at_key else self.values
        self.report(places.get(path, FilePlace(self.file, 1, 1)), path, message)


class _Stop(Exception):
    """The rest of the text cannot be read."""


class _Rejected:
    """A placeholder for a value that is left out."""


def read_text(path: str | FilePath) -> str:
    """Return the text of a scenario file.

    Raises:
        ScenarioError: when it is missing, a folder, too large or not UTF-8 text.
    """
    try:
        with open(path, "rb") as file:
            raw = file.read(LARGEST_FILE + 1)
        if len(raw) > LARGEST_FILE:
            raise _failure(path, f"larger than {LARGEST_FILE:,} bytes; is this a scenario file?")
        return raw.decode("utf-8-sig")
    except FileNotFoundError:
        raise _failure(path, "no such file; `bindusbl-des init` writes a starter") from None
    except IsADirectoryError:
        raise _failure(path, "is a folder; name a scenario file in it") from None
    except OSError as error:
        raise _failure(path, f"cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        byte = f"byte 0x{raw[error.start]:02x} at {error.start}"
        message = f"not UTF-8 text ({byte}); save it as UTF-8"
        raise _failure(path, message) from None


def _failure(path: str | FilePath, message: str) -> ScenarioError:
    return ScenarioError([Mistake.at(FilePlace(str(path)), "", message)])


def read_yaml(text: str, file: str) -> Document:
    """Return the data of a YAML text; mistakes are in the document, none is raised."""
    document = Document(file)
    try:
        _Reader(document, text).read()
    except UnicodeEncodeError as error:  # an argument of a shell need not be text
        message = f"not UTF-8 text ({text[error.start]!r} at {error.start})"
        document.mistakes.append(Mistake.at(FilePlace(file), "", message))
        document.data = None
    except yaml.YAMLError as error:
        place, message = syntax_mistake(error, text, file)
        document.mistakes.append(Mistake.at(place, "", message))
        document.data = None
    except _Stop:
        document.data = None
    return document


class _Reader:
    """Turns the events of PyYAML's parser into plain data."""

    def __init__(self, document: Document, text: str) -> None:
        self.document = document
        self.events: Iterator[Any] = yaml.parse(text, Loader=LOADER)

    def read(self) -> None:
        next(self.events)  # the stream
        if isinstance(next(self.events), yaml.StreamEndEvent):
            return
        data = self._value(next(self.events), ())
        next(self.events)  # the document's end
        follower = next(self.events)
        if isinstance(follower, yaml.DocumentStartEvent):
            self._stop(follower, "a second document (---) begins here; keep one per file")
        self.document.data = None if isinstance(data, _Rejected) else data

    def _place(self, event: Any) -> FilePlace:
        mark = event.start_mark
        return FilePlace(self.document.file, mark.line + 1, mark.column + 1)

    def _stop(self, event: Any, message: str, path: Path = ()) -> None:
        self.document.report(self._place(event), path, message)
        raise _Stop

    def _value(self, event: Any, path: Path) -> Any:
        place = self._place(event)
        self.document.values.setdefault(path, place)
        self.document.keys.setdefault(path, place)
        if len(path) > DEEPEST:
            self._stop(event, f"nested deeper than {DEEPEST} levels", path[:3])
        if isinstance(event, yaml.AliasEvent):
            message = f"alias *{shortened(str(event.anchor))} is not allowed; write the value out"
            self.document.report(place, path, message)
            return _Rejected()
        if event.anchor is not None:
            message = f"anchor &{shortened(event.anchor)} is not allowed; remove it"
            self.document.mistakes.append(Mistake.at(place, dotted(path), message))
        if event.tag is not None:
            tag = shortened(event.tag.replace("tag:yaml.org,2002:", "!!"))
            message = f"tag {tag} is not allowed; write the plain value"
            self.document.report(place, path, message)
            self._skip(event)
            return _Rejected()
        if isinstance(event, yaml.ScalarEvent):
            return scalar(event.value) if event.implicit[0] else event.value
        return self._list(path) if isinstance(event, yaml.SequenceStartEvent) else self._dict(path)

    def _skip(self, event: Any) -> None:
        depth = int(isinstance(event, yaml.CollectionStartEvent))
        while depth:
            event = next(self.events)
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)

    def _list(self, path: Path) -> list[Any] | _Rejected:
        items: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self._value(event, (*path, len(items))))
        # A list without the rejected item would have a wrong length, so all of it is rejected.
        rejected = any(isinstance(item, _Rejected) for item in items)
        return _Rejected() if rejected else items

    def _dict(self, path: Path) -> dict[str, Any]:
        data: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                self.document.report(self._place(event), path, "a key must be a plain word")
                self._skip(event)
                self._value(next(self.events), (*path, "?"))
                continue
            self._entry(event, data, (*path, event.value))
        return data

    def _entry(self, key: Any, data: dict[str, Any], path: Path) -> None:
        name, place, first = key.value, self._place(key), self.document.keys.get(path)
        if name == "<<" and key.implicit[0]:
            message = "merge keys (<<) are not allowed; write the keys out"
            self.document.report(place, path[:-1], message)
            self._skip(next(self.events))
            return
        self.document.keys.setdefault(path, place)
        if key.anchor is not None or key.tag is not None:
            self.document.report(place, path, "anchors and tags are not allowed on keys; remove it")
        value = self._value(next(self.events), path)
        if name in data and first is not None:
            self.document.report(place, path, f"given twice, first in line {first.line}; keep one")
            if isinstance(value, dict) and isinstance(data[name], dict):
                data[name] = value | data[name]
        elif not isinstance(value, _Rejected):
            data[name] = value
