"""The kinds of figure that the folder of a run offers."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from .anatomy import anatomy
from .coverage import coverage
from .error import error
from .fixes import fixes
from .latency import latency
from .timeline import timeline
from .trajectory import trajectory

if TYPE_CHECKING:
    from ..results.result import Result

# Each takes a result, the width of the figure (in) and options of its own.
KINDS: dict[str, Callable[..., Figure]] = {
    "trajectory": trajectory,
    "error": error,
    "fixes": fixes,
    "coverage": coverage,
    "timeline": timeline,
    "round": anatomy,
    "latency": latency,
}

EVENTS = ("rounds", "pings", "receptions", "broadcasts", "fixes")
TABLES: dict[str, tuple[str, ...]] = {
    "trajectory": ("tracks",),
    "error": ("tracks", *EVENTS),
    "fixes": ("pings", "fixes"),
    "coverage": (),
    "timeline": EVENTS,
    "round": EVENTS,
    "latency": ("fixes",),
}


def missing(result: "Result", kind: str) -> list[str]:
    """Return the tables that a figure needs and a result does not hold."""
    return [table for table in TABLES[kind] if table not in result.arrow]
