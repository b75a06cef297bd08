"""Comparisons in tables and sentences for the terminal."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from math import isfinite
from textwrap import fill

from ...core.wording import plain, significant
from ...records.quantities import WORST
from .differences import Difference, End
from .findings import seeds, who_is_worst, who_lacks
from .intervals import CONFIDENCE
from .judging import lacking, of_an_auv
from .naming import decimals
from .outcomes import unit

# A larger comparison shows its first pairs; `--json` and `--out` give all.
MOST_PAIRS = 20
LONGEST_NAME = 16
WIDEST = 80
# The column that gives way where a table would be wider: the difference as a share
RELATIVE = 4


def comparison_table(differences: Sequence[Difference]) -> str:
    """Return a table for each pair of points, the main finding in words, and how sure it is."""
    pairs = [list(rows) for _, rows in groupby(differences, key=lambda it: id(it.pair))]
    lines: list[str] = []
    for rows in pairs[:MOST_PAIRS]:
        lines += [*_pair(rows), ""]
    if len(pairs) > MOST_PAIRS:
        lines += [f"... {len(pairs) - MOST_PAIRS} more pairs; --out FILE.csv writes all", ""]
    lines.append("Paired by seed: equal seeds, equal noise. CI: confidence interval, Student's t.")
    if len(differences) > 1:
        wrong = significant((1 - CONFIDENCE) * len(differences), 2)
        lines.append(
            f"95 % is for each CI alone: of {len(differences)}, some {wrong} miss by chance."
        )
    return "\n".join(lines)


def _pair(rows: Sequence[Difference]) -> Iterator[str]:
    pair, counts = rows[0].pair, {_count(it) for it in rows}
    held = "".join(f", {key}={plain(value)}" for key, value in pair.held.items())
    paired = f"; {counts.pop()} paired seeds" if len(counts) == 1 else ""
    one, other = _short(pair.baseline.name), _short(pair.other.name)
    yield f"{f'{pair.key}: ' if pair.key else ''}{other} compared with {one}{held}{paired}"
    worst = all(it.metric.startswith(WORST) for it in rows)
    first = "of the worst AUV" if worst else "metric"
    cells = [(first, one, other, "difference [95 % CI]", "", "" if paired else "pairs", "")]
    cells += [
        (of_an_auv(it.metric) if worst else it.metric, *_row(it, "" if paired else _count(it)))
        for it in rows
    ]
    yield from _table(cells)
    said = [sentence(rows[0]), *worst_named(rows[0])]
    for text in dict.fromkeys((*said, *(lack for it in rows for lack in unserved(it)))):
        yield fill(text, WIDEST, break_long_words=False, break_on_hyphens=False)


def _table(cells: list[tuple[str, str, str, str, str, str, str]]) -> Iterator[str]:
    widths = [max(len(row[n]) for row in cells) for n in range(len(cells[0]))]
    if sum(widths) + 2 * (sum(map(bool, widths)) - 1) > WIDEST:
        widths[RELATIVE] = 0
    heading, *lines = (_line(row, widths) for row in cells)
    yield from (heading, "-" * max(map(len, (heading, *lines))), *lines)


def _line(row: tuple[str, ...], widths: Sequence[int]) -> str:
    """Return a row in columns: names to the left, numbers to the right, none that are empty."""
    columns = [cell.rjust(width) for cell, width in zip(row, widths, strict=True) if width]
    return "  ".join((row[0].ljust(widths[0]), *columns[1:-1], row[-1])).rstrip()


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else f"~{name[1 - LONGEST_NAME :]}"


def _count(it: Difference) -> str:
    """Return the pairs that have a value, of how many where some have none."""
    some = it.verdict == "unserved" or it.found.count == it.missions
    return str(it.missions) if some else f"{it.found.count} of {it.missions}"


def _row(it: Difference, count: str) -> tuple[str, str, str, str, str, str]:
    digits = _digits(it)
    is_known = isfinite(it.found.mean)
    return (
        _shown(it.baseline, digits),
        _shown(it.other, digits),
        f"{_number(it.found.mean, digits, '+')} {_interval(it, digits)}".strip()
        if is_known
        else "",
        f"{100 * it.relative:+.0f} %" if isfinite(it.relative) else "",
        count,
        it.verdict,
    )


def _shown(end: End, digits: int) -> str:
    """Return a mean; where AUVs have no value, in how many missions all have one."""
    if not end.without:
        return _number(end.mean, digits)
    return f"{_number(end.mean, digits)} ({end.whole}/{end.missions})"


def _interval(it: Difference, digits: int) -> str:
    if it.found.count < 2:
        return ""
    return f"[{_number(it.low, digits, '+')}, {_number(it.high, digits, '+')}]"


def _digits(it: Difference) -> int:
    """Return the decimals that show two digits of the half width, three of the difference."""
    means = [abs(end.mean) / 10 for end in (it.baseline, it.other)]
    return decimals(it.found.half_width, abs(it.found.mean) / 10, *means)


def _number(value: float, digits: int, sign: str = "") -> str:
    return f"{value:{sign}.{digits}f}" if isfinite(value) else "-"


def sentence(it: Difference) -> str:
    """Return what a difference shows, in words."""
    one, other, digits, name = it.pair.baseline.name, it.pair.other.name, _digits(it), _named(it)
    count = f"{_count(it)} paired seeds"
    measure = unit(it.metric).replace("1", "")
    amount = f"{_number(it.found.mean, digits, '+')} {measure}".rstrip()
    sure = f"{amount} {_interval(it, digits)} over {count}"
    match it.verdict:
        case "no pairs":
            return f"No seed has {it.metric} at both."
        case "no value":
            return f"No value of {it.metric} in any of {seeds(it.missions)} that both have."
        case "unserved":
            return f"{other} and {one} cannot be compared in {name}: an AUV has no value."
        case "one pair":
            return f"{name}: {amount} in one paired seed, which shows nothing; run more seeds."
        case "same":
            return f"{name}: equal in all {count}."
        case "not shown":
            return f"No difference in {name} shown between {other} and {one}: {sure}."
        case "better" | "worse":
            return f"{other} is {it.verdict} than {one}: {name} {sure}."
    return f"{other} has {it.verdict} {name} than {one}: {sure}."


def _named(it: Difference) -> str:
    if it.metric.startswith(WORST):
        return f"the worst AUV's {of_an_auv(it.metric)}"
    return it.metric


def worst_named(it: Difference) -> Iterator[str]:
    """Yield which AUVs were the worst at both points, by the worst AUV's metric."""
    one, other = it.pair.baseline.name, it.pair.other.name
    who, their_who = it.baseline.who, it.other.who
    if len({*who, *their_who}) == 1:
        yield f"{next(iter(who or their_who))} is the worst at both, in all seeds."
    elif who and their_who:
        yield f"At {one} {who_is_worst(who)}; at {other} {who_is_worst(their_who)}."


def unserved(it: Difference) -> Iterator[str]:
    """Yield which AUVs have no value of a metric at the points of a pair."""
    for side, end in ((it.pair.baseline, it.baseline), (it.pair.other, it.other)):
        if end.without:
            yield _lacks(side.name, end.without, end.missions, it.metric)


def _lacks(name: str, auvs: Mapping[str, int], missions: int, metric: str) -> str:
    """Return who lacks what, such as "unserved at 2: AUV0 got no fix in 20 of 20 seeds"."""
    if len(auvs) == 1:
        ((auv, count),) = auvs.items()
        return f"Unserved at {name}: {auv} {lacking(metric)} in {count} of {seeds(missions)}."
    return f"Unserved at {name}, who {lacking(metric)}: {who_lacks(auvs, missions)}."
