"""What a causal chain is made of: steps, each with its instant and the rule that decided it."""

import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

WIDEST = 80
INDENT = 15


@dataclass(frozen=True)
class Step:
    """One thing that happened: when (s), to whom, what, by which rules (parted by "; ").

    `facts` are the numbers it is told by, named as columns of tables are, with their units.
    """

    time_s: float
    who: str
    what: str
    why: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)

    def text(self) -> str:
        """Return the step in lines of at most 80 characters."""
        first = f"{self.time_s:>12.4f} s"
        told = [f"{self.who} {self.what}", *(self.why.split("; ") if self.why else [])]
        lines = [line for part in told for line in textwrap.wrap(part, WIDEST - INDENT - 1)]
        return "\n".join([f"{first}  {lines[0]}", *(f"{'':>{INDENT + 1}}{it}" for it in lines[1:])])


@dataclass(frozen=True)
class Part:
    """A part of the latency of a fix: what the time (s) went into."""

    name: str
    duration_s: float


@dataclass(frozen=True)
class Chain:
    """What became of one ping: the outcome in words, its steps, and where the latency comes from.

    The parts of the latency add up to it, as they are and as they are printed.  With passive
    ranging `asv` has pinged, and the chain is that of all AUVs (`auv` None) or of one.
    """

    ping: int
    auv: str | None
    fix: int | None
    outcome: str
    told: str
    steps: tuple[Step, ...]
    parts: tuple[Part, ...] = ()
    asv: str | None = None

    def text(self) -> str:
        """Return the chain for a terminal."""
        whose = self.auv
        if self.asv is not None:
            whose = f"{self.asv} at {self.auv}" if self.auv else self.asv
        head = textwrap.wrap(f"Ping {self.ping} of {whose}: {self.told}.", WIDEST)
        return "\n".join([*head, *(step.text() for step in self.steps), *self._latency()])

    def _latency(self) -> Iterator[str]:
        if not self.parts:
            return
        total = sum(part.duration_s for part in self.parts)
        yield f"Latency {total:.4f} s:"
        printed, until = 0.0, 0.0
        for part in self.parts:
            until += part.duration_s
            # Differences of rounded instants: what is printed adds up as well.
            yield f"{round(until, 4) - printed:>12.4f} s  {part.name}"
            printed = round(until, 4)

    def data(self) -> dict[str, Any]:
        """Return the chain as plain data."""
        return asdict(self)
