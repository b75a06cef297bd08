"""What a docstring says, as Markdown."""

import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

# A role of reST: what it names is told as code.
ROLE = re.compile(r":\w+:`[~.]*([^`]+)`")
RAISED = re.compile(r"    (\w+): (.*)")


@dataclass
class Told:
    """What a docstring says: paragraphs, what is raised and when, and an example."""

    paragraphs: list[str] = field(default_factory=list)
    raised: list[tuple[str, str]] = field(default_factory=list)
    example: str = ""

    def markdown(self) -> Iterator[str]:
        """Yield it as lines: paragraphs, a list, a block of code."""
        for paragraph in self.paragraphs:
            yield f"{paragraph}\n"
        if self.raised:
            yield from (f"* raises `{error}` {when}" for error, when in self.raised)
            yield ""
        if self.example:
            yield f"```pycon\n{self.example}\n```\n"

    def in_one(self) -> str:
        """Return its paragraphs as one, for a cell of a table."""
        return " ".join(self.paragraphs)


def told(thing: Any) -> Told:
    """Return what the docstring of something says.

    >>> def f(): "Give ``1`` of :func:`.g`.\\n\\nRaises:\\n    ValueError: never,\\n        ever."
    >>> told(f).in_one(), told(f).raised
    ('Give `1` of `g`.', [('ValueError', 'never, ever.')])
    """
    said = Told()
    for part in (inspect.getdoc(thing) or "").split("\n\n"):
        if part.startswith(">>>"):
            said.example = re.sub(r" *# doctest:.*", "", f"{said.example}\n{part}".strip())
        elif part.startswith("Raises:"):
            said.raised += _raised(part)
        else:
            said.paragraphs.append(_flowing(part))
    return said


def _raised(part: str) -> Iterator[tuple[str, str]]:
    """Yield errors and when they are raised; a line that is indented further goes on."""
    lines = re.sub(r"\n {8}", " ", part).splitlines()
    yield from (match.groups() for match in map(RAISED.fullmatch, lines) if match)  # type: ignore[misc]


def _flowing(text: str) -> str:
    """Return a paragraph in one line, without reST, and without what HTML would take for its own.

    >>> _flowing("``a`` < :class:`.b.C`\\n  is *args")
    '`a` &lt; `C` is \\\\*args'
    """
    flat = ROLE.sub(lambda role: f"`{role[1].split('.')[-1]}`", " ".join(text.split()))
    pieces = flat.replace("``", "`").split("`")
    prose = (piece.replace("<", "&lt;").replace("*", r"\*") for piece in pieces[::2])
    return "`".join(
        word
        for pair in zip(prose, [*pieces[1::2], None], strict=True)
        for word in pair
        if word is not None
    )
