"""XML read as a tree of plain elements, each with its line; what could be an attack is refused.

Entities are declared in a document type, and neither KML nor GPX needs one: without them a file
costs no more than its length, and reads no other (CWE-776, CWE-611).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from ..core.regular_files import regular
from .shapes import BadChart

LARGEST_FILE = 32_000_000

# A file of a few megabytes can have millions of empty ones, each with its line and its lists.
MOST_ELEMENTS = 400_000

# KML nests folders, but not like this; a limit keeps walks over the tree short.
DEEPEST = 60


@dataclass
class Element:
    """An element: its name without namespace, its line, attributes, text and children."""

    name: str
    line: int
    attributes: dict[str, str]
    text: str = ""
    children: list["Element"] = field(default_factory=list)

    def within(self, *names: str) -> Iterator["Element"]:
        """Yield the elements of some name in it, at any depth, in the order of the file."""
        for child in self.children:
            if child.name in names:
                yield child
            yield from child.within(*names)

    def child(self, name: str) -> "Element | None":
        """Return its first child of a name."""
        return next((it for it in self.children if it.name == name), None)

    def said(self, name: str) -> str:
        """Return the text of its first child of a name, "" if there is none."""
        child = self.child(name)
        return child.text.strip() if child else ""


def read_xml(path: str | Path, root: str) -> Element:
    """Return the root element of an XML file, which must have a name such as `kml`.

    Raises:
        BadChart: naming file, line and remedy.
    """
    try:
        with open(regular(path), "rb") as file:
            raw = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None
    if len(raw) > LARGEST_FILE:
        raise BadChart(f"{path}: is larger than {LARGEST_FILE:,} bytes; leave in it what is needed")
    if raw.startswith(b"PK"):
        raise BadChart(f"{path}: is a zip archive such as KMZ; unpack it and name the .kml in it")
    found = _Tree(str(path)).read(raw)
    if found.name != root:
        raise BadChart(f"{path}:{found.line}: begins with <{found.name}>; expected <{root}>")
    return found


class _Tree:
    """What an XML parser tells, put together."""

    def __init__(self, path: str) -> None:
        self.path, self.top, self.open = path, Element("", 0, {}), list[Element]()
        self.count = 0
        self.parser: Any = expat.ParserCreate(namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.StartElementHandler = self._begin
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._add

    def read(self, raw: bytes) -> Element:
        self.open = [self.top]
        try:
            self.parser.Parse(raw, True)
        except (expat.ExpatError, LookupError, ValueError) as error:  # BadChart is a ValueError
            if isinstance(error, BadChart):
                raise
            raise BadChart(f"{self.path}: is no XML: {error}") from None
        return self.top.children[0]

    def _refuse(self, *_: object) -> None:
        raise BadChart(
            f"{self.path}:{self.parser.CurrentLineNumber}: declares a document type, which may "
            "hide other files in it; remove the line <!DOCTYPE ...>"
        )

    def _begin(self, name: str, attributes: dict[str, str]) -> None:
        if len(self.open) > DEEPEST:
            raise BadChart(f"{self.path}: is nested deeper than {DEEPEST} levels")
        plain = {key.rpartition(" ")[2]: value for key, value in attributes.items()}
        self.count += 1
        if self.count > MOST_ELEMENTS:
            raise BadChart(
                f"{self.path}: has more than {MOST_ELEMENTS:,} elements; leave in it what is needed"
            )
        element = Element(name.rpartition(" ")[2], self.parser.CurrentLineNumber, plain)
        self.open[-1].children.append(element)
        self.open.append(element)

    def _end(self, _: str) -> None:
        self.open.pop()

    def _add(self, text: str) -> None:
        self.open[-1].text += text
