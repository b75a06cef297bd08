"""The document of a reproduction: every figure and number of the paper, each with its verdict."""

import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from itertools import groupby
from re import split
from string import ascii_lowercase as LETTERS
from typing import TYPE_CHECKING

from bindusbl_des.apps.campaigns.experiments.experiment import model_version
from bindusbl_des.core.results.result import versions

from . import measuring, sentences
from .campaigns import READINGS_FOLDER, Runs
from .numbers import REPRODUCED, Claimed, Measured, Prediction, Published, published

if TYPE_CHECKING:
    import pandas as pd

# The figures of a reproduction, by the name of their file: what each shows.


CAPTIONS = {
    "baseline": "Baseline, L = 60 m: four AUVs, one ASV that hears them all. One run: "
    "map, and position errors; ticks are fixes delivered.",
    "failure_and_recovery": "Coverage failure and recovery, L = 140 m: one ASV and three, paths of "
    "one run. AUV0's path is the westernmost.",
    "errors_and_fixes": "Failure (above) and recovery (below): position error with the bias in "
    "the body frame (the paper's equation) and in the world frame, and fixes delivered; means and "
    "range over the runs.",
    "two_asvs": "Two ASVs over the formation angle, L = 140 m: means with 95 % intervals; crosses "
    "are the paper's numbers for AUV0.",
    "heatmap": "Mean error over all angles and seeds in three readings of the paper: "
    "cross-track error with 300 s for every team, position error at equal distance travelled, and "
    "position error with a bias in the world frame. Above: the paper's numbers (of so many ASVs).",
    "sweep_distance": "The sweep by formation angle at equal distance travelled (900 s / N): mean "
    "position error and fix rate, one standard deviation over seeds.",
    "sweep": "The sweep by formation angle with 300 s for every team: mean position error and fix "
    "rate, one standard deviation over seeds.",
    "schedulers": "Schedulers on moving AUVs: fix rates at L = 140 m (above) and the gain of "
    "spatial reuse over one AUV per slot at each side (below); bands are the range over formation "
    "angles.",
    "downlinks": "Downlinks where one ASV hears all AUVs: fix rate and mean latency (marks), rate "
    "of the slots in closed form (lines), and what the 2 kbit/s downlink allows at best (dashed).",
    "ablations": "Table I with one choice changed at a time: fixes delivered and position error, "
    "means with 95 % intervals; dashed lines are the paper's numbers.",
}

READINGS_CAPTION = (
    "How many numbers each joint reading foretells, of those that no reading puts in. Dashed: "
    "`default` and the best; shaded: what the best would foretell if the numbers had no reading in "
    "common (5 to 95 %)."
)


# The comparison as text: Markdown for the document, 80 columns for the terminal.


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
    """Return a table of numbers (paper, measured, interval, verdict), and why some differ below."""
    whys = list(dict.fromkeys(it.why() for it in found if it.why()))
    rows = [
        (
            it.row.case,
            f"{it.row.auv} {it.row.quantity}",
            f"{_relation(it)}{it.row.text}{UNITS[it.row.unit]}",
            f"{it.prediction.mean:.{digits(it)}f}",
            interval(it.prediction, digits(it)),
            _share(it.deviation()),
            _judgement(it, whys),
        )
        for it in found
    ]
    heads = ("mission", "quantity", "paper", "here", "95 %", "off by", "verdict")
    below = "\n".join(f"* ({letter}) {why}." for letter, why in zip(LETTERS, whys, strict=False))
    return f"{markdown(heads, rows)}\n\n{below}".strip()


def _relation(it: Measured) -> str:
    return {"equals": "", "at most": "<= ", "at least": ">= "}[it.claim]


def _judgement(it: Measured, whys: Sequence[str]) -> str:
    """Return a verdict with the letter of its reason; errors have their other readings in a table
    of their own.
    """
    letter = f" ({LETTERS[whys.index(it.why())]})" if it.why() else ""
    is_error = it.row.quantity.startswith("cte")
    others = f"; met as {', or as '.join(it.agreeing)}" if it.agreeing and not is_error else ""
    return f"**{it.verdict}**{letter}{others}"


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


# Every published number beside what was measured here, and the tables that hold them.


MEASURED_BY = {
    "tab:case_study": measuring.measure_case_study,
    "sec:case_study": measuring.measure_case_study,
    "sec:baseline": measuring.measure_baseline,
    "sec:sweep": measuring.measure_sweep,
    "con": measuring.measure_sweep,
}


def compared(runs: Runs) -> list[Measured]:
    """Return every published number with what was measured, in the order of the paper's table."""
    return [MEASURED_BY[row.source](row, runs) for row in published()]


def table(found: Sequence[Measured]) -> "pd.DataFrame":
    """Return the comparison as a table, a row per published number."""
    import pandas as pd

    return pd.DataFrame([record(it) for it in found])


def record(it: Measured) -> dict[str, object]:
    """Return the comparison of one number as plain data."""
    row: Published = it.row
    return {
        "source": row.source,
        "case": row.case,
        "auv": row.auv,
        "quantity": row.quantity,
        "unit": row.unit,
        "claim": it.claim,
        "paper": row.value,
        "measured": it.prediction.mean,
        "low": it.prediction.low,
        "high": it.prediction.high,
        "runs": it.prediction.runs,
        "reading": it.reading,
        "verdict": it.verdict,
        "why": it.why(),
        "reproduced_by": "; ".join(it.agreeing),
    }


# The document of a reproduction: every figure and number of the paper, each with its verdict.


FIGURES = "figures/reproduction"

INTRODUCTION = """\
After this page you know which numbers of *BIND-USBL: Bounding IMU Navigation Drift using USBL in
Heterogeneous ASV-AUV Teams* (Kedia, Makam, Hamann, Sundaram) this simulator reproduces, and why not
the others. Its experiments are the files of `experiments/` (`bindusbl-des sweep
experiments/NAME.yaml`); this page was written by

    bindusbl-des reproduce{option}

No parameter is tuned towards a published number. A number is

* **reproduced** if it lies, but for its rounding, in the interval that holds the mean of as many
  further runs (1 in Table I, 5 in the baseline, 20 in the sweep) with 95 % probability: mean +- t s
  sqrt(1/n + 1/m). Of a bound the mean must keep it. One of twenty true numbers falls outside;
* **cannot be** if it lies beyond a limit that follows from the paper's own equations;
* **differs** otherwise; E-numbers are sections of [errata](errata.md).

A sentence without a number **holds** where all missions bear it out.

Numbers are measured in the paper's own words first: "cross-track error" is across the track, the
bias turns with the vehicle (eq. dead_reckoning), a fix is compared with the estimate at its
delivery (eq. update). Which single reading meets most numbers is counted
[at the end](#the-paper-in-one-reading)."""

CONTENTS = """\
The folder then holds this page with its figures, all numbers as `paper_vs_measured.csv` and
`.parquet`, and a campaign folder for each experiment."""

SECTIONS = {
    "Baseline": ("sec:baseline",),
    "Coverage failure and recovery": ("tab:case_study", "sec:case_study"),
    "Configuration sweep": ("sec:sweep", "con"),
}


def document(
    found: Sequence[Measured],
    claims: Mapping[str, Sequence[Claimed]],
    runs: Runs,
    *,
    quick: bool,
    joint: Iterable[str],
    joint_runs: Runs,
) -> str:
    """Return the whole document in Markdown; `joint` is the section on joint readings."""
    every = {**runs, **{f"{READINGS_FOLDER}/{name}": run for name, run in joint_runs.items()}}
    parts = [
        "# The paper, reproduced",
        INTRODUCTION.format(option=" --quick" if quick else ""),
        *warning(quick),
        "## In short",
        _in_short(found),
        *_sections(found, claims, runs),
        *joint,
        "## How it was made",
        *origin(every, f"reproduce{' --quick' if quick else ''} --out results/reproduction"),
        CONTENTS,
    ]
    return "\n\n".join(parts) + "\n"


def warning(quick: bool) -> Iterator[str]:
    """Yield the sentence that a quick look opens with."""
    if quick:
        yield (
            "**This is a quick look**: few seeds and few team sizes, so that intervals are wide "
            "and verdicts provisional."
        )


def _in_short(found: Sequence[Measured]) -> str:
    rows = []
    for title, sources in SECTIONS.items():
        counts = count(it for it in found if it.row.source in sources)
        rows.append((title, *counts.values()))
    rows.append(("all", *count(found).values()))
    heads = (
        "numbers",
        "reproduced",
        "differ",
        "cannot be",
        "not reproduced, but in another reading of its table",
        "not reproduced, but within 5 %",
    )
    return f"{markdown(heads, rows)}\n\n{_furthest(found)}"


def _furthest(found: Sequence[Measured]) -> str:
    """Return which number is furthest from the paper's, and which error is."""
    errors = [it for it in found if it.row.quantity.startswith("cte")]
    most, error = (max(some, key=lambda it: abs(it.deviation() or 0.0)) for some in (found, errors))
    return f"Furthest off: {_off(most)}; of the errors {_off(error)}."


def _off(it: Measured) -> str:
    return (
        f"{it.row.auv} {it.row.quantity} ({it.row.case}), "
        f"{_relation(it)}{it.row.text}{UNITS[it.row.unit]} in the paper, "
        f"{it.prediction.mean:.{digits(it)}f} here ({_share(it.deviation())})"
    )


def _sections(
    found: Sequence[Measured], claims: Mapping[str, Sequence[Claimed]], runs: Runs
) -> Iterator[str]:
    by_section = {
        title: [it for it in found if it.row.source in sources]
        for title, sources in SECTIONS.items()
    }
    yield "## Baseline"
    yield from _figures("baseline")
    yield numbers_in_markdown(by_section["Baseline"])
    yield "## Coverage failure and recovery"
    yield from _figures("failure_and_recovery", "errors_and_fixes", "two_asvs")
    yield numbers_in_markdown(by_section["Coverage failure and recovery"])
    yield "The errors in every reading; bold ones agree with the paper:"
    yield readings_in_markdown(_errors(by_section["Coverage failure and recovery"]))
    yield "## Configuration sweep"
    yield from _figures("heatmap", "sweep_distance", "sweep")
    yield numbers_in_markdown(by_section["Configuration sweep"])
    yield "The errors in every reading; bold ones agree with the paper:"
    yield readings_in_markdown(_errors(by_section["Configuration sweep"]))
    yield "## What the paper says in words"
    yield claims_in_markdown(claims["words"])
    yield "## Schedulers"
    yield from _figures("schedulers")
    yield claims_in_markdown(claims["schedulers"])
    yield "## Downlinks"
    yield from _figures("downlinks")
    yield claims_in_markdown(claims["downlinks"])
    yield "## Ablations"
    yield from _figures("ablations")
    yield _ablations(runs)


def claimed(runs: Runs) -> dict[str, list[Claimed]]:
    """Return every sentence with its verdict, by section."""
    return {
        "words": sentences.result_claims(runs),
        "schedulers": sentences.scheduler_claims(runs),
        "downlinks": sentences.downlink_claims(runs),
    }


def _errors(found: Sequence[Measured]) -> list[Measured]:
    return [it for it in found if it.row.quantity.startswith("cte")]


def figure(name: str, caption: str) -> str:
    """Return a figure with its caption; the text for those who do not see it is its beginning."""
    return f"![{split(r'[:,.]', caption)[0]}]({FIGURES}/{name}.png)\n\n*{caption}*"


def _figures(*names: str) -> Iterator[str]:
    for name in names:
        yield figure(name, CAPTIONS[name])


def _ablations(runs: Runs) -> str:
    """Return a row per change: fixes and errors of the three AUVs, with one ASV and with three."""
    cells = [(_published(asvs, "fixes"), _published(asvs, "cte")) for asvs in (1, 3)]
    rows: list[tuple[object, ...]] = [("**published**", *cells[0], *cells[1])]
    for change, both in measuring.ablated(runs).groupby("change", sort=False):
        found = [
            " / ".join(f"{row[f'{name}_{auv}']:.{decimals}f}" for auv in measuring.AUVS)
            for row in both.to_dict("records")
            for name, decimals in (("fixes", 1), ("error", 2))
        ]
        rows.append((f"`{change}`", *found))
    heads = ("change", "1 ASV: fixes", "position error (m)", "3 ASVs: fixes", "position error (m)")
    return f"AUV0 / 1 / 2 each.\n\n{markdown(heads, rows)}"


def _published(asvs: int, quantity: str) -> str:
    return " / ".join(
        row.text
        for row in published()
        if (row.source, row.asvs, row.quantity) == ("tab:case_study", str(asvs), quantity)
    )


def origin(runs: Runs, command: str) -> Iterator[str]:
    """Yield what was run, by which versions, and the command that runs it again."""
    rows = [
        (f"`{name}`", len(run.plan.points), len(run.plan.experiment.seeds), len(run.plan))
        for name, run in runs.items()
    ]
    yield markdown(("experiment", "points", "seeds", "missions"), rows)
    total = sum(len(run.plan) for run in runs.values())
    packages = ", ".join(f"{name} {number}" for name, number in versions().items())
    day = datetime.now(UTC).date().isoformat()
    yield (
        f"{total} missions, {day}, model {model_version().partition('+')[0]}, "
        f"Python {platform.python_version()}, {packages}."
    )
    yield (
        "To make it again (a call that was cut short continues where it stopped):\n\n"
        f"    bindusbl-des {command}"
    )
