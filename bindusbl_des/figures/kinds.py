"""The kinds of figure that the folder of a run offers."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from ..core.wording import did_you_mean
from .anatomy import anatomy
from .coverage import coverage
from .error import error
from .fixes import fixes
from .latency import latency
from .style import styled
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


def drawn(result: "Result", kind: str, width: float, **options: Any) -> Figure:
    """Return a figure of a result by its kind, `width` inches wide.

    Raises:
        ValueError: when there is no such kind, or the result lacks the tables that it needs.
    """
    if kind not in KINDS:
        hint = did_you_mean(kind, KINDS) or f"; there are {', '.join(KINDS)}"
        raise ValueError(f"no figure {kind!r} of a run{hint}")
    lacking = missing(result, kind)
    if lacking:
        raise ValueError(
            f"no {kind}: it needs the tables {', '.join(lacking)}, which the run did not record; "
            "run it again with record.detail full"
        )
    with styled():
        return KINDS[kind](result, width, **options)


def missing(result: "Result", kind: str) -> list[str]:
    """Return the tables that a figure needs and a result does not hold."""
    return [table for table in TABLES[kind] if table not in result.arrow]
