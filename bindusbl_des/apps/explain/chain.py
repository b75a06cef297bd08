"""What a causal chain is made of: steps, each with its instant and the rule that decided it; and
how rows of the tables are found and compared.
"""

import math
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...support.wording import WIDEST

if TYPE_CHECKING:
    from ...core.results.result import Result

INDENT = 15

# Outcomes of what never came near: it was too far away, or land was between.
UNREACHED = ("out_of_range", "blocked")

# A distance this near to a limit (m) is told with all its digits.
MOST_DIGITS = 6

# How fast a way changes is told by where both were so long (s) before and after.
SHIFT_S = 0.25

# Lines of one step, and the numbers that it is told by.
Why = tuple[list[str], dict[str, Any]]


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
        words = [f"{self.who} {self.what}", *(self.why.split("; ") if self.why else [])]
        lines = [line for part in words for line in textwrap.wrap(part, WIDEST - INDENT - 1)]
        return "\n".join(
            [f"{first}  {lines[0]}", *(f"{'':>{INDENT + 1}}{line}" for line in lines[1:])]
        )


@dataclass(frozen=True)
class LatencyPart:
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
    parts: tuple[LatencyPart, ...] = ()
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


def lines(*words: str) -> str:
    """Return the reasons of a step as one text, without those that are empty."""
    return "; ".join(filter(None, words))


def known(value: Any) -> Any:
    """Return a value of a table, None where there is none."""
    return None if value is None or value != value else value


def compared(value: float, limit: float) -> str:
    """Return a distance and its limit (m) with as many digits as show which is larger.

    >>> compared(63.24, 50.0), compared(50.0004, 50.0)
    ('63.2 m > 50 m', '50.0004 m > 50 m')
    """
    digits = 1
    while digits < MOST_DIGITS and (round(value, digits) > limit) != (value > limit):
        digits += 1
    sign = ">" if value > limit else "<="
    return f"{value:.{digits}f} m {sign} {limit:g} m"


def apart(band: Any, here: Any, there: Any) -> float:
    """Return the distance (m) of two places (x, y, z in m) that is compared with a band's range."""
    axes = 3 if band.range_metric == "slant" else 2
    return math.dist(here[:axes], there[:axes])


def rows_where(table: Any, **values: Any) -> Any:
    """Return the rows of a table that have the given values."""
    kept = np.ones(len(table), dtype=bool)
    for name, value in values.items():
        kept &= (table[name] == value).to_numpy()
    return table[kept]


def row_of(result: "Result", table: str, key: str, number: int) -> Any:
    """Return one row of an event table by its number.

    Raises:
        LookupError: when the result holds no events, or no such row.
    """
    if table not in result.arrow:
        raise LookupError("the run recorded no events (record.detail: summary); run it with 'full'")
    rows = result.tables[table]
    found = rows_where(rows, **{key: number})
    if not len(found):
        last = f"it has 0..{len(rows) - 1}" if len(rows) else "it has none"
        raise LookupError(f"the run has no {key} {number}; {last}")
    # whole numbers stay whole, and what is missing is None
    return found.astype(object).where(found.notna(), None).iloc[0]


def place(result: "Result", vehicle: str, time: float) -> NDArray[np.float64]:
    """Return where a vehicle was (x, y, z in m) at an instant (s), between rows of its track."""
    track = rows_where(result.tables["tracks"], vehicle=vehicle)
    times = track.time_s.to_numpy(float)
    return np.array([np.interp(time, times, track[name].to_numpy(float))
                     for name in ("x_m", "y_m", "z_m")])  # fmt: skip


def too_fast(result: "Result", band: str, ends: tuple[str, str], time: float) -> str:
    """Tell that the way between two vehicles changed faster at an instant (s) than a band bears,
    and how fast by their tracks.
    """
    one, other = ends
    begin, end = [
        math.dist(place(result, one, at), place(result, other, at))
        for at in (max(time - SHIFT_S, 0.0), time + SHIFT_S)
    ]
    rate = (end - begin) / (time + SHIFT_S - max(time - SHIFT_S, 0.0))
    limit = result.scenario.acoustics.bands[band].doppler_limit_m_per_s
    return (
        f"the way between {one} and {other} changes by some {rate:+.2f} m/s, and more than "
        f"{limit:g} m/s either way is lost to Doppler (doppler_limit_m_per_s)"
    )


def behind(result: "Result", auv: str, asv: str, time: float) -> str:
    """Tell what land was between an AUV and an ASV at an instant (s)."""
    (x, y), (a, b) = (place(result, name, time)[:2].tolist() for name in (auv, asv))
    land, away = result.setup.land, math.dist((x, y), (a, b))
    assert land is not None, "without land nothing is blocked"
    begin, end = land.met((x, y), (a, b))
    return (
        f"{auv} is behind land: on the {away:.1f} m from {asv} that begins after {begin:.1f} m, "
        f"and ends after {end:.1f} m"
    )


def failed(result: "Result", time: float) -> list[int]:
    """Return the ASVs that do not work at an instant (s), by number."""
    failures = result.setup.failures
    return [] if failures is None else list(failures.failed(time))


def failed_at(result: "Result", asv: str, time: float) -> str:
    """Return when an ASV failed last before an instant (s), as in "ASV1 failed at 20 s"."""
    failures = result.scenario.asvs.failures
    begun = [each.at_s for each in failures if f"ASV{each.asv}" == asv and each.at_s <= time]
    return f"failed at {max(begun):g} s" if begun else "failed"


def lost_in_a_row(band: Any, table: Any, time: float) -> str:
    """Return in words that losses last (`burst_s`), and since when (s) a pair had lost all its
    signals as it lost that of an instant (s); its rows of a `table`, in order.
    """
    lasts = f"losses last {band.burst_s:g} s on average (burst_s)"
    before = table[table.arrived_at_s <= time]
    heard = before.arrived_at_s[before.outcome == "heard"].max()
    lost = before[(before.why == "burst") & ~(before.arrived_at_s <= heard)]
    if len(lost) < 2:
        return lasts
    begun = lost.arrived_at_s.min()
    return f"{lasts}, and this pair had lost its last {len(lost)} signals since {begun:.2f} s"
