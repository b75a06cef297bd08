"""The kinds of figure that the folder of a run offers."""

from collections.abc import Callable, Mapping
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from ...support.wording import described, did_you_mean
from .anatomy import anatomy
from .coverage import coverage, without_stations
from .error import error
from .fixes import fixes, latency
from .style import finished
from .timeline import timeline
from .trajectory import trajectory

if TYPE_CHECKING:
    from ...core.results.result import Result

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

# Width (in) unless another is asked for
USUAL_WIDTHS = {
    "trajectory": 4.9, "error": 7.16, "fixes": 4.2, "coverage": 4.2, "timeline": 7.16,
    "round": 7.16, "latency": 7.16,
}  # fmt: skip

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
OF_ROUNDS = ("timeline", "round")


def drawn(
    result: "Result", kind: str, width: float, path: str | Path | None = None, **options: Any
) -> Figure:
    """Return a figure of a result by its kind, `width` inches wide; also write it to a path.

    Raises:
        ValueError: when there is no such kind, format, option or round, or the result lacks what
            it needs.
        OSError: when it cannot be written.
    """
    if kind not in KINDS:
        hint = did_you_mean(kind, KINDS) or f"; there are {', '.join(KINDS)}"
        raise ValueError(f"no figure {kind!r} of a run{hint}")
    if why := lacking(result, kind):
        raise ValueError(f"no {kind}: {why}")
    _check(result, kind, options)
    return finished(lambda inches: KINDS[kind](result, inches, **options), width, path)


def _check(result: "Result", kind: str, options: Mapping[str, Any]) -> None:
    """Refuse options that a figure does not have, and rounds that the mission did not have."""
    known = tuple(signature(KINDS[kind]).parameters)[2:]
    for name, number in options.items():
        if name not in known:
            hint = did_you_mean(name, known) or f"; it has {', '.join(known) or 'none'}"
            raise ValueError(f"{kind} has no option {name!r}{hint}")
        count = result.arrow["rounds"].num_rows
        if number is not None and not (isinstance(number, int) and 0 <= number < count):
            raise ValueError(f"{name} needs a round, 0 to {count - 1}; got {described(number)}")
    first, last = options.get("first"), options.get("last")
    if first is not None and last is not None and first > last:
        raise ValueError(f"first={first} comes after last={last}")


def lacking(result: "Result", kind: str) -> str:
    """Return why a figure of a result cannot be drawn; "" where it can."""
    tables = [table for table in TABLES[kind] if table not in result.arrow]
    if tables:
        return (
            f"it needs the tables {', '.join(tables)}, which the run did not record; run it again "
            "with --set record.detail=full"
        )
    if kind in OF_ROUNDS and not result.arrow["rounds"].num_rows:
        return "the mission had no round"
    return without_stations(result) if kind == "coverage" else ""
