"""Comparisons in tables and sentences for the terminal."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import get_args

from ....core.records.metrics import WORST, of_an_auv
from ....support.wording import WIDEST, aligned, counted, decimals, filled, plain, significant
from .differences import Difference, End, Verdict
from .findings import who_is_worst, who_lacks
from .intervals import CONFIDENCE, short_key
from .outcomes import lacking, unit

# More points than this are left to `--json` and `--out`.
MOST_POINTS = 40
# The column that gives way where a table would be wider: the difference as a share
RELATIVE = 4

Rows = Sequence[Difference]


def comparison_table(differences: Rows) -> str:
    """Return a table for each point or campaign compared with the baseline, and its confidence.

    A single pair of points has all metrics; several have the first metric at each point, and how
    the others differ.
    """
    lines: list[str] = []
    for rows in by_label(differences).values():
        lines += [*(_alone(rows) if is_alone(rows) else _over_points(rows)), ""]
    lines.append("Paired by seed: equal seeds, equal noise. CI: confidence interval, Student's t.")
    if len(differences) > 1:
        wrong = significant((1 - CONFIDENCE) * len(differences), 2)
        lines.append(
            f"95 % is for each CI alone: of {len(differences)}, {wrong} miss by chance on average."
        )
    return "\n".join(lines)


def by_label(differences: Rows) -> dict[str, list[Difference]]:
    """Return the differences from the baseline by the letter of the compared point or campaign."""
    found: dict[str, list[Difference]] = {}
    for row in differences:
        found.setdefault(row.pair.other.label, []).append(row)
    return found


def is_alone(rows: Rows) -> bool:
    """Tell whether all differences belong to one pair of points."""
    return all(row.pair is rows[0].pair for row in rows)


def _alone(rows: Rows) -> Iterator[str]:
    """Yield the metrics of one pair of points, its main finding, and the worst AUVs."""
    pair = rows[0].pair
    keys, paired = list(pair.held), _paired(rows)
    held = ", ".join(f"{short_key(key, keys)}={plain(pair.held[key])}" for key in keys)
    at = f" at {held}" * bool(held)
    yield filled(f"{_versus(rows[0])}{at}{paired}")
    whose, names = _metrics(rows)
    yield from _table(whose, names, rows, bool(paired))
    said = [sentence(rows[0]), *worst_named(rows[0])]
    for text in dict.fromkeys((*said, *(lack for row in rows for lack in unserved(row)))):
        yield filled(text)


def _over_points(rows: Rows) -> Iterator[str]:
    """Yield the first metric at each point, and how often each metric differs."""
    metric = rows[0].metric
    points = [row for row in rows if row.metric == metric]
    paired, versus = _paired(points), _versus(points[0])
    measure = f" ({unit(metric)})".replace(" (1)", "")
    yield filled(f"{versus}: {_named(points[0])}{measure}{paired}")
    at = [{key: plain(value) for key, value in point.pair.held.items()} for point in points]
    keys = [key for key in at[0] if len({held[key] for held in at}) > 1] or list(at[0])
    heading = ", ".join(short_key(key, list(at[0])) for key in keys)
    names = [", ".join(held[key] for key in keys) for held in at[:MOST_POINTS]]
    yield from _table(heading, names, points[:MOST_POINTS], bool(paired))
    if len(points) > MOST_POINTS:
        yield f"... {len(points) - MOST_POINTS} more points; --out FILE.csv writes all"
    yield ""
    yield f"{versus}, at how many of {len(points)} points:"
    yield from _verdicts(rows)


def _versus(row: Difference) -> str:
    return f"{row.pair.other.label} compared with {row.pair.baseline.label}"


def _paired(rows: Rows) -> str:
    """Return how many seeds all rows have in pairs; "" where that differs."""
    counts = {_count(row) for row in rows}
    return f"; {counts.pop()} paired seeds" if len(counts) == 1 else ""


def _metrics(rows: Rows) -> tuple[str, list[str]]:
    """Return the heading of metrics, and their names without whose they are."""
    if all(row.metric.startswith(WORST) for row in rows):
        return "of the worst AUV", [of_an_auv(row.metric) for row in rows]
    return "metric", [row.metric for row in rows]


def _verdicts(rows: Rows) -> Iterator[str]:
    """Yield at how many points each metric is better, worse, ..."""
    whose, names = _metrics(rows)
    counts: dict[str, Counter[str]] = {}
    for name, row in zip(names, rows, strict=True):
        counts.setdefault(name, Counter())[row.verdict] += 1
    shown = [word for word in get_args(Verdict) if any(count[word] for count in counts.values())]
    cells = [[name, *(str(count[word] or "-") for word in shown)] for name, count in counts.items()]
    yield from aligned([[whose, *shown], *cells])


def _table(heading: str, names: Sequence[str], rows: Rows, is_paired: bool) -> Iterator[str]:
    """Yield a row for each difference, with its pairs unless all have the same."""
    pair = rows[0].pair
    ends, pairs = (pair.baseline.label, pair.other.label), "" if is_paired else "pairs"
    cells = [(heading, *ends, "difference [95 % CI]", "", pairs, "")]
    cells += [
        (name, *_row(row, "" if is_paired else _count(row)))
        for name, row in zip(names, rows, strict=True)
    ]
    widths = [max(len(row[n]) for row in cells) for n in range(len(cells[0]))]
    if sum(widths) + 2 * (sum(map(bool, widths)) - 1) > WIDEST:
        widths[RELATIVE] = 0
    first, *lines = (_line(row, widths) for row in cells)
    yield from (first, "-" * max(map(len, (first, *lines))), *lines)


def _line(row: tuple[str, ...], widths: Sequence[int]) -> str:
    """Return a row in columns: names to the left, numbers to the right, none that are empty."""
    columns = [cell.rjust(width) for cell, width in zip(row, widths, strict=True) if width]
    return "  ".join((row[0].ljust(widths[0]), *columns[1:-1], row[-1])).rstrip()


def _count(row: Difference) -> str:
    """Return the pairs that have a value, of how many where some have none."""
    return (
        str(row.missions)
        if row.lacks or row.found.count == row.missions
        else f"{row.found.count} of {row.missions}"
    )


def _row(row: Difference, count: str) -> tuple[str, str, str, str, str, str]:
    digits = _digits(row)
    is_known = isfinite(row.found.mean)
    return (
        _shown(row.baseline, digits),
        _shown(row.other, digits),
        f"{_number(row.found.mean, digits, '+')} {_interval(row, digits)}".strip()
        if is_known
        else "",
        f"{100 * row.relative:+.0f} %" if isfinite(row.relative) else "",
        count,
        row.verdict,
    )


def _shown(end: End, digits: int) -> str:
    """Return a mean, with the number of whole missions if AUVs lack a value."""
    if not end.without:
        return _number(end.mean, digits)
    return f"{_number(end.mean, digits)} ({end.whole}/{end.missions})"


def _interval(row: Difference, digits: int) -> str:
    if row.found.count < 2:
        return ""
    return f"[{_number(row.found.low, digits, '+')}, {_number(row.found.high, digits, '+')}]"


def _digits(row: Difference) -> int:
    """Return the decimals that show two digits of the half width, three of the difference."""
    means = [abs(end.mean) / 10 for end in (row.baseline, row.other)]
    return decimals(row.found.half_width, abs(row.found.mean) / 10, *means)


def _number(value: float, digits: int, sign: str = "") -> str:
    return f"{value:{sign}.{digits}f}" if isfinite(value) else "-"


def sentence(row: Difference) -> str:
    """Return what a difference shows, in words."""
    one, other, digits, name = (
        row.pair.baseline.label,
        row.pair.other.label,
        _digits(row),
        _named(row),
    )
    count = f"{_count(row)} paired seeds"
    measure = unit(row.metric).replace("1", "")
    amount = f"{_number(row.found.mean, digits, '+')} {measure}".rstrip()
    sure = f"{amount} {_interval(row, digits)} over {count}"
    if not row.missions:
        return f"No seed has {row.metric} at both."
    if row.lacks:
        return f"{other} and {one} are not comparable in {name}: an AUV has no value."
    if not row.found.count:
        return f"No value of {row.metric} in any of {counted(row.missions, 'seed')} that both have."
    if row.found.count < 2:
        return f"{name}: {amount} in one paired seed, which shows nothing; run more seeds."
    match row.verdict:
        case "equal":
            return f"{other} and {one} are equal in {name}, in all {count}."
        case "no difference shown":
            return f"No difference shown between {other} and {one}: {name} {sure}."
        case "better" | "worse":
            return f"{other} is {row.verdict} than {one}: {name} {sure}."
    return f"{other} has {row.verdict} {name} than {one}: {sure}."


def _named(row: Difference) -> str:
    if row.metric.startswith(WORST):
        return f"the worst AUV's {of_an_auv(row.metric)}"
    return row.metric


def worst_named(row: Difference) -> Iterator[str]:
    """Yield which AUVs were the worst at both points, by the worst AUV's metric."""
    one, other = row.pair.baseline.label, row.pair.other.label
    who, their_who = row.baseline.who, row.other.who
    if len({*who, *their_who}) == 1:
        yield f"{next(iter(who or their_who))} is the worst at both, in all seeds."
    elif who and their_who:
        yield f"At {one} {who_is_worst(who)}; at {other} {who_is_worst(their_who)}."


def unserved(row: Difference) -> Iterator[str]:
    """Yield which AUVs have no value of a metric at the points of a pair."""
    for side, end in ((row.pair.baseline, row.baseline), (row.pair.other, row.other)):
        if end.without:
            yield _lacks(side.label, end.without, end.missions, row.metric)


def _lacks(name: str, auvs: Mapping[str, int], missions: int, metric: str) -> str:
    """Return which AUVs lack a value, such as "At B AUV0 got no fix in 20 of 20 seeds"."""
    if len(auvs) == 1:
        ((auv, count),) = auvs.items()
        return f"At {name} {auv} {lacking(metric)} in {count} of {counted(missions, 'seed')}."
    return f"At {name} some AUVs {lacking(metric)}: {who_lacks(auvs, missions)}."
