"""What is wrong with a file that somebody wrote, and where: one line for each mistake."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from .wording import printable


class Problem(NamedTuple):
    """A contradiction: the key it is told at, what is wrong, and the other keys that lead to it."""

    key: str
    message: str
    others: tuple[str, ...] = ()


class ScenarioWarning(Problem):
    """A warning about a key: the key, what it warns of, and the keys behind it."""

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


@dataclass(frozen=True)
class FilePlace:
    """A place in a file, counted from 1; line 0 is the file as a whole (or a ``--set`` option)."""

    file: str
    line: int = 0
    column: int = 0


@dataclass(frozen=True)
class Mistake:
    """One mistake: where it stands, the dotted key it concerns ("" for none), what to do."""

    file: str
    line: int
    column: int
    key: str
    message: str

    @classmethod
    def at(cls, place: FilePlace, key: str, message: str) -> "Mistake":
        """Return the mistake at a place; a file or option with control characters is escaped."""
        return cls(printable(place.file), place.line, place.column, printable(key), message)

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return f"{where}: {self.key}: {self.message}" if self.key else f"{where}: {self.message}"


class ScenarioError(ValueError):
    """A scenario file cannot be used; `mistakes` lists everything that is wrong with it."""

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        self.mistakes = list(mistakes)
        super().__init__(self.mistakes)

    def __str__(self) -> str:
        return "\n".join(str(mistake) for mistake in self.mistakes)
