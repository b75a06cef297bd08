"""Steps of a causal chain, each with its instant and its rule; search in the rows of tables."""

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

# Outcomes of signals that never arrived: the listener was out of range, or behind land.
UNREACHED = ("out_of_range", "blocked")

# The most decimals of a distance that is printed beside its limit.
MOST_DIGITS = 6

# A range rate is the difference of ranges this long (s) before and after an instant.
SHIFT_S = 0.25

# The lines of text of one step, and its facts.
Why = tuple[list[str], dict[str, Any]]


@dataclass(frozen=True)
class Step:
    """One event of a chain: its instant (s), the vehicle, what happened, by which rules.

    `why` separates rules by "; ".  `facts` maps names, as of table columns with units, to numbers.
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
    """One part of the latency of a fix, with its duration (s)."""

    name: str
    duration_s: float


@dataclass(frozen=True)
class Chain:
    """The outcome of one ping, as a word and in words (`told`), its steps, and its latency.

    `parts` of the latency add up to it, also as printed.  With passive ranging `asv` pinged, and
    the chain covers all AUVs (`auv` None) or one.
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
            # Differences of rounded instants, so that the printed parts add up as well.
            yield f"{round(until, 4) - printed:>12.4f} s  {part.name}"
            printed = round(until, 4)

    def data(self) -> dict[str, Any]:
        """Return the chain as plain data."""
        return asdict(self)


def lines(*words: str) -> str:
    """Return the reasons of a step as one text, without empty ones."""
    return "; ".join(filter(None, words))


def known(value: Any) -> Any:
    """Return a value of a table, or None if it is missing (None or NaN)."""
    return None if value is None or value != value else value


def compared(value: float, limit: float) -> str:
    """Return a distance and its limit (m) with enough digits to show which is larger.

    >>> compared(63.24, 50.0), compared(50.0004, 50.0)
    ('63.2 m > 50 m', '50.0004 m > 50 m')
    """
    digits = 1
    while digits < MOST_DIGITS and (round(value, digits) > limit) != (value > limit):
        digits += 1
    sign = ">" if value > limit else "<="
    return f"{value:.{digits}f} m {sign} {limit:g} m"


def apart(band: Any, here: Any, there: Any) -> float:
    """Return the distance (m) of two positions (x, y, z in m) in the metric of a band's range."""
    axes = 3 if band.range_metric == "slant" else 2
    return math.dist(here[:axes], there[:axes])


def rows_where(table: Any, **values: Any) -> Any:
    """Return the rows of a table that have the given values."""
    kept = np.ones(len(table), dtype=bool)
    for name, value in values.items():
        kept &= (table[name] == value).to_numpy()
    return table[kept]


def row_of(result: "Result", table: str, key: str, number: int) -> Any:
    """Return the row of an event table whose column `key` has this number.

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


def position_at(result: "Result", vehicle: str, time: float) -> NDArray[np.float64]:
    """Return the position (x, y, z in m) of a vehicle at time (s), interpolated in its track."""
    track = rows_where(result.tables["tracks"], vehicle=vehicle)
    times = track.time_s.to_numpy(float)
    return np.array([np.interp(time, times, track[name].to_numpy(float))
                     for name in ("x_m", "y_m", "z_m")])  # fmt: skip


def too_fast(result: "Result", band: str, ends: tuple[str, str], time: float) -> str:
    """Tell that the range rate of two vehicles at time (s) exceeds a band's Doppler limit."""
    one, other = ends
    begin, end = [
        math.dist(position_at(result, one, at), position_at(result, other, at))
        for at in (max(time - SHIFT_S, 0.0), time + SHIFT_S)
    ]
    rate = (end - begin) / (time + SHIFT_S - max(time - SHIFT_S, 0.0))
    limit = result.scenario.acoustics.bands[band].doppler_limit_m_per_s
    return (
        f"the way between {one} and {other} changes by some {rate:+.2f} m/s, and more than "
        f"{limit:g} m/s either way is lost to Doppler (doppler_limit_m_per_s)"
    )


def behind(result: "Result", auv: str, asv: str, time: float) -> str:
    """Tell from where to where (m) land lies on the line from an ASV to an AUV at time (s)."""
    (x, y), (a, b) = (position_at(result, name, time)[:2].tolist() for name in (auv, asv))
    land, away = result.setup.land, math.dist((x, y), (a, b))
    assert land is not None, "without land nothing is blocked"
    begin, end = land.met((x, y), (a, b))
    return (
        f"{auv} is behind land: on the {away:.1f} m from {asv} that begins after {begin:.1f} m, "
        f"and ends after {end:.1f} m"
    )


def failed_asvs(result: "Result", time: float) -> list[int]:
    """Return the numbers of the ASVs that do not work at time (s)."""
    failures = result.setup.failures
    return [] if failures is None else list(failures.failed(time))


def failed_at(result: "Result", asv: str, time: float) -> str:
    """Return when an ASV last failed before time (s), for instance "failed at 20 s"."""
    failures = result.scenario.asvs.failures
    begun = [each.at_s for each in failures if f"ASV{each.asv}" == asv and each.at_s <= time]
    return f"failed at {max(begun):g} s" if begun else "failed"


def lost_in_a_row(band: Any, table: Any, time: float) -> str:
    """Tell how long losses last, and since when (s) a pair lost all its signals up to time (s).

    `table` holds the receptions of this pair in the order of arrival.
    """
    lasts = f"losses last {band.burst_s:g} s on average (burst_s)"
    before = table[table.arrived_at_s <= time]
    heard = before.arrived_at_s[before.outcome == "heard"].max()
    lost = before[(before.why == "burst") & ~(before.arrived_at_s <= heard)]
    if len(lost) < 2:
        return lasts
    begun = lost.arrived_at_s.min()
    return f"{lasts}, and this pair had lost its last {len(lost)} signals since {begun:.2f} s"
