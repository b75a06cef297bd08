"""The kinds of figure that a result folder offers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from .anatomy import anatomy
from .coverage import coverage
from .error import error
from .fixes import fixes
from .latency import latency
from .style import ONE_COLUMN, TWO_COLUMNS
from .timeline import timeline
from .trajectory import trajectory

if TYPE_CHECKING:
    from ..result import Result


@dataclass(frozen=True)
class Kind:
    """One kind of figure: how it is drawn, how wide (in), and from which tables."""

    draw: Callable[..., Figure]
    width: float
    tables: tuple[str, ...] = ()


EVENTS = ("rounds", "pings", "receptions", "broadcasts", "fixes")

KINDS: dict[str, Kind] = {
    "trajectory": Kind(trajectory, ONE_COLUMN * 1.4, ("tracks",)),
    "error": Kind(error, TWO_COLUMNS, ("tracks", "fixes")),
    "fixes": Kind(fixes, ONE_COLUMN * 1.2, ("pings", "fixes")),
    "coverage": Kind(coverage, ONE_COLUMN * 1.2),
    "timeline": Kind(timeline, TWO_COLUMNS, EVENTS),
    "round": Kind(anatomy, TWO_COLUMNS, EVENTS),
    "latency": Kind(latency, TWO_COLUMNS, ("fixes",)),
}


def missing(result: "Result", kind: str) -> list[str]:
    """Return the tables that a figure needs and a result does not hold."""
    return [table for table in KINDS[kind].tables if table not in result.arrow]


def draw(result: "Result", kind: str, width: float | None = None, **options: Any) -> Figure:
    """Return a figure of a result; `options` are those of its kind."""
    return KINDS[kind].draw(result, width or KINDS[kind].width, **options)
