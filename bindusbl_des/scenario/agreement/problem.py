"""A contradiction between keys of a scenario."""

from typing import NamedTuple


class Problem(NamedTuple):
    """A contradiction: the key it is told at, what is wrong, and the other keys that lead to it."""

    key: str
    message: str
    others: tuple[str, ...] = ()
