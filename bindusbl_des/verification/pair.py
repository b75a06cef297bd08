"""A kind of pairs of signals that may meet at a receiver, and what was decided of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from ..acoustics.propagation import TOUCH

Plan = dict[str, Any]

ACCEPTED, REFUSED, UNDECIDED = "accepted", "refused", "undecided"


@dataclass(frozen=True)
class Pair:
    """Whether signals of a kind may overlap, and by how much they fail to.

    `margin_s` is the least time between the end of one and the beginning of the other, `margin_m`
    how much farther the conflict graph looks than it must; either is None where it is not what
    decides.  `witnesses` yields scenarios (plain data) in which two of them overlap, the likeliest
    first.
    """

    kind: str
    what: str
    verdict: str
    why: str
    margin_s: float | None = None
    margin_m: float | None = None
    witnesses: Callable[[], Iterator[Plan]] | None = None

    @property
    def is_safe(self) -> bool:
        """Whether no two signals of the kind may overlap."""
        return self.verdict == ACCEPTED


def by_time(
    kind: str,
    what: str,
    margin_s: float,
    why: str,
    witnesses: Callable[[], Iterator[Plan]],
) -> Pair:
    """Return a pair that a time between two signals decides; touching is no overlap."""
    if margin_s > -TOUCH:
        return Pair(kind, what, ACCEPTED, why, margin_s)
    return Pair(kind, what, REFUSED, why, margin_s, None, witnesses)


def undecided(
    kind: str,
    what: str,
    why: str,
    witnesses: Callable[[], Iterator[Plan]] | None = None,
) -> Pair:
    """Return a pair that nothing here proves safe; a witness, if there is one, proves it unsafe."""
    return Pair(kind, what, UNDECIDED, why, witnesses=witnesses)
