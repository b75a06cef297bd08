"""Comparisons in tables and sentences for the terminal."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from math import floor, isfinite, log10

from ...wording import plain
from .differences import Difference
from .intervals import CONFIDENCE
from .outcomes import unit

# A larger comparison shows its first pairs; `--json` and `--out` give all.
MOST_PAIRS = 20
LONGEST_NAME = 16


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
        wrong = f"{(1 - CONFIDENCE) * len(differences):.2g}"
        lines.append(
            f"95 % is for each CI alone: of {len(differences)}, some {wrong} miss by chance."
        )
    return "\n".join(lines)


def _pair(rows: Sequence[Difference]) -> Iterator[str]:
    pair, counts = rows[0].pair, {it.found.count for it in rows}
    held = "".join(f", {key}={plain(value)}" for key, value in pair.held.items())
    seeds = f"; {counts.pop()} paired seeds" if len(counts) == 1 else ""
    one, other = _short(pair.baseline.name), _short(pair.other.name)
    yield f"{f'{pair.key}: ' if pair.key else ''}{other} compared with {one}{held}{seeds}"
    cells = [("metric", one, other, "difference [95 % CI]", "", "" if seeds else "pairs", "")]
    cells += [_row(it, "" if seeds else str(it.found.count)) for it in rows]
    widths = [max(len(row[n]) for row in cells) for n in range(len(cells[0]))]
    heading, *lines = (_line(row, widths) for row in cells)
    yield from (heading, "-" * max(map(len, (heading, *lines))), *lines)
    yield sentence(rows[0])


def _line(row: tuple[str, ...], widths: Sequence[int]) -> str:
    """Return a row in columns: names to the left, numbers to the right, none that are empty."""
    columns = [cell.rjust(width) for cell, width in zip(row, widths, strict=True) if width]
    return "  ".join((row[0].ljust(widths[0]), *columns[1:-1], row[-1])).rstrip()


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else f"~{name[1 - LONGEST_NAME :]}"


def _row(it: Difference, count: str) -> tuple[str, str, str, str, str, str, str]:
    digits = _digits(it)
    return (
        it.metric,
        _number(it.baseline, digits),
        _number(it.other, digits),
        f"{_number(it.found.mean, digits, '+')} {_interval(it, digits)}".strip(),
        f"{100 * it.relative:+.0f} %" if isfinite(it.relative) else "",
        count,
        it.verdict,
    )


def _interval(it: Difference, digits: int) -> str:
    if it.found.count < 2:
        return ""
    return f"[{_number(it.low, digits, '+')}, {_number(it.high, digits, '+')}]"


def _digits(it: Difference) -> int:
    """Return the decimals that show two digits of the half width, three of the difference."""
    scale = [it.found.half_width, abs(it.found.mean) / 10, abs(it.baseline) / 100]
    known = [value for value in scale if isfinite(value) and value > 0]
    return min(max(1 - floor(log10(known[0])), 0), 9) if known else 3


def _number(value: float, digits: int, sign: str = "") -> str:
    return f"{value:{sign}.{digits}f}" if isfinite(value) else "-"


def sentence(it: Difference) -> str:
    """Return what a difference shows, in words."""
    one, other, digits = it.pair.baseline.name, it.pair.other.name, _digits(it)
    count = f"{it.found.count} paired seeds"
    measure = unit(it.metric).replace("1", "")
    amount = f"{_number(it.found.mean, digits, '+')} {measure}".rstrip()
    sure = f"{amount} {_interval(it, digits)} over {count}"
    match it.verdict:
        case "no pairs":
            return f"No seed has {it.metric} at both."
        case "one pair":
            return f"{it.metric}: {amount} in one paired seed, which shows nothing; run more seeds."
        case "same":
            return f"{it.metric}: equal in all {count}."
        case "not shown":
            return f"No difference in {it.metric} shown between {other} and {one}: {sure}."
        case "better" | "worse":
            return f"{other} is {it.verdict} than {one}: {it.metric} {sure}."
    return f"{other} has {it.verdict} {it.metric} than {one}: {sure}."
