"""The comparison as text: Markdown for the document, 80 columns for the terminal."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from .claims import Claimed
from .experiments.measured import Measured
from .verdicts import REPRODUCED, Prediction

# Beside a number that differs in the paper's own words but not in another reading of them
OTHERWISE = "*"

# A number may differ beyond chance and yet by little.
NEAR = 0.05

UNITS = {"m": " m", "s": " s", "Hz": " Hz", "1": ""}


def digits(it: Measured) -> int:
    """Return the decimals that suit a number: one more than the paper prints, two for counts."""
    printed = len(it.row.text.partition(".")[2])
    return printed + 1 if printed else 1


def interval(prediction: Prediction, decimals: int) -> str:
    """Return an interval as text.

    >>> interval(Prediction(1.0, 0.5, 1.5, 20), 2)
    '[0.50, 1.50]'
    """
    return f"[{prediction.low:.{decimals}f}, {prediction.high:.{decimals}f}]"


def mark(it: Measured) -> str:
    """Return the verdict in short: with a star where another reading reproduces the number."""
    return f"{it.verdict} {OTHERWISE}" if it.verdict != REPRODUCED and it.agreeing else it.verdict


def numbers_in_markdown(found: Sequence[Measured]) -> str:
    """Return a table of numbers: paper, measured, interval, verdict and why."""
    rows = [
        (
            it.row.case,
            f"{it.row.auv} {it.row.quantity}",
            f"{_relation(it)}{it.row.text}{UNITS[it.row.unit]}",
            f"{it.prediction.mean:.{digits(it)}f}",
            interval(it.prediction, digits(it)),
            _share(it.deviation()),
            _judgement(it),
        )
        for it in found
    ]
    return markdown(("mission", "quantity", "paper", "here", "95 %", "off by", "verdict"), rows)


def _relation(it: Measured) -> str:
    return {"equals": "", "at most": "<= ", "at least": ">= "}[it.claim]


def _judgement(it: Measured) -> str:
    why = it.why()
    others = f" It is reproduced as {', or as '.join(it.agreeing)}." if it.agreeing else ""
    if it.verdict == REPRODUCED:
        return f"**{it.verdict}**"
    return f"**{it.verdict}**: {why}.{others}"


def _share(deviation: float | None) -> str:
    return "" if deviation is None else f"{deviation:+.1%}".replace("%", " %")


def readings_in_markdown(found: Sequence[Measured]) -> str:
    """Return a table of errors in every reading; those that agree with the paper are bold."""
    names = [found[0].reading, *(other.reading for other in found[0].others)]
    rows = []
    for it in found:
        predictions = [it.prediction, *(other.prediction for other in it.others)]
        agree = [it.verdict == REPRODUCED, *(o.reading in it.agreeing for o in it.others)]
        cells = [
            f"**{p.mean:.2f}**" if good else f"{p.mean:.2f}"
            for p, good in zip(predictions, agree, strict=True)
        ]
        label = f"{it.row.case}: {it.row.auv} {it.row.quantity}"
        rows.append((label, f"{_relation(it)}{it.row.text}", *cells))
    return markdown(("error (m)", "paper", *names), rows)


def claims_in_markdown(claims: Iterable[Claimed]) -> str:
    """Return a table of sentences with their verdicts and the numbers they rest on."""
    rows = [
        (it.sentence, f"**{it.verdict}**" + (f": {it.why}" if it.why else ""), it.evidence)
        for it in claims
    ]
    return markdown(("sentence", "verdict", "measured"), rows)


def markdown(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table.

    >>> print(markdown(("a", "b"), [(1, 2)]))
    | a | b |
    |---|---|
    | 1 | 2 |
    """
    lines = [heads, ["---"] * len(heads), *([str(cell) for cell in row] for row in rows)]
    return "\n".join(
        f"|{'|'.join(line)}|" if line[0] == "---" else f"| {' | '.join(line)} |" for line in lines
    )


def for_terminal(found: Sequence[Measured], claims: Sequence[Claimed]) -> str:
    """Return all numbers and sentences in 80 columns."""
    return "\n".join([*_numbers(found), "", *_sentences(claims), "", *legend(found)])


def _numbers(found: Sequence[Measured]) -> Iterator[str]:
    yield f"{'':28}{'paper':>9}{'here':>9}  {'95 %':<18}verdict"
    for case, group in groupby(found, key=lambda it: it.row.case):
        yield case
        for it in group:
            name = f"  {it.row.auv} {it.row.quantity}"
            paper = f"{_relation(it)}{it.row.text}"
            here = f"{it.prediction.mean:.{digits(it)}f}"
            span = interval(it.prediction, digits(it))
            yield f"{name:<28}{paper:>9}{here:>9}  {span:<18}{mark(it)}"


def _sentences(claims: Sequence[Claimed]) -> Iterator[str]:
    for it in claims:
        words, room = it.sentence, 66
        yield f"{words if len(words) <= room else words[: room - 3] + '...':<68}{it.verdict}"


def legend(found: Sequence[Measured]) -> Iterator[str]:
    """Yield how many numbers have which verdict."""
    counts = count(found)
    yield (
        f"{len(found)} numbers: {counts['reproduced']} reproduced, {counts['differs']} differ, "
        f"{counts['cannot be']} cannot be."
    )
    if any(it.others for it in found):
        yield (
            f"{OTHERWISE} {counts['otherwise']} of the others another reading of the paper "
            f"reproduces; {counts['near']} are within 5 %."
        )
    else:
        yield f"{counts['near']} of the others are within 5 %."


def count(found: Iterable[Measured]) -> dict[str, int]:
    """Return how many numbers have each verdict.

    `otherwise`: of those not reproduced, how many another reading reproduces; `near`: how many are
    nevertheless within 5 %.
    """
    counts = {"reproduced": 0, "differs": 0, "cannot be": 0, "otherwise": 0, "near": 0}
    for it in found:
        counts[it.verdict] += 1
        counts["otherwise"] += it.verdict != REPRODUCED and bool(it.agreeing)
        counts["near"] += it.verdict != REPRODUCED and abs(it.deviation() or 1.0) <= NEAR
    return counts
