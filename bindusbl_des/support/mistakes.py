"""Mistakes in a file that a user wrote, one line for each, with its place."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from .wording import printable


class Problem(NamedTuple):
    """A contradiction between keys: the key at which it is reported, a message, the other keys."""

    key: str
    message: str
    others: tuple[str, ...] = ()


class ScenarioWarning(Problem):
    """A warning about a key: the key, the message, and the keys that lead to it."""

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


@dataclass(frozen=True)
class FilePlace:
    """A position in a file, counted from 1; line 0 means the whole file (or a ``--set`` option)."""

    file: str
    line: int = 0
    column: int = 0


@dataclass(frozen=True)
class Mistake:
    """One mistake: its position, its dotted key ("" for none), and a message with a remedy."""

    file: str
    line: int
    column: int
    key: str
    message: str

    @classmethod
    def at(cls, place: FilePlace, key: str, message: str) -> "Mistake":
        """Return the mistake at a position; control characters in names are escaped."""
        return cls(printable(place.file), place.line, place.column, printable(key), message)

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return f"{where}: {self.key}: {self.message}" if self.key else f"{where}: {self.message}"


class ScenarioError(ValueError):
    """A scenario file cannot be used; `mistakes` lists all its mistakes."""

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        self.mistakes = list(mistakes)
        super().__init__(self.mistakes)

    def __str__(self) -> str:
        return "\n".join(str(mistake) for mistake in self.mistakes)
