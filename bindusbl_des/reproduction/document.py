"""The document of a reproduction: every figure and number of the paper, each with its verdict."""

import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime

from ..campaigns.experiments.plan import model_version
from ..results.result import versions
from .captions import CAPTIONS
from .claims import Claimed
from .experiments import ablations, downlinks, schedulers
from .experiments.measured import Measured
from .experiments.running import Runs
from .published import published
from .readings import sentences
from .readings.crossing import READINGS_FOLDER
from .tables import claims_in_markdown, count, markdown, numbers_in_markdown, readings_in_markdown

FIGURES = "figures/reproduction"

INTRODUCTION = """\
The paper is *BIND-USBL: Bounding IMU Navigation Drift using USBL in Heterogeneous ASV-AUV Teams*
(Kedia, Makam, Hamann, Sundaram). Its experiments are the files of `experiments/`, which anyone can
run alone with `bindusbl-des sweep experiments/NAME.yaml`; this page was written by

    bindusbl-des reproduce{option}

No parameter is tuned towards a published number. Verdicts follow a rule:

* **reproduced**: the published number lies, but for its rounding, in the interval that holds the
  mean of as many further runs (1 in Table I, 5 in the baseline, 20 in the sweep) with 95 %
  probability: mean +- t s sqrt(1/n + 1/m). One of twenty true numbers falls outside by chance. Of a
  bound ("below 0.8 m") the mean must keep it.
* **cannot be**: it lies beyond a limit that follows from the paper's own equations.
* **differs**: neither; why is said, and E-numbers are sections of [errata](errata.md).

Numbers are first measured in the paper's own words: "cross-track error" is the component of the
error across the track, the bias turns with the vehicle (eq. dead_reckoning), a fix is compared with
the estimate at its delivery (eq. update). Other readings are measured beside, the same ones for
every error; where one of them reproduces a number that the words do not, that is said. Which single
reading meets most of all numbers is counted [at the end](#the-paper-in-one-reading)."""

CONTENTS = """\
The folder then holds this page as `reproduction.md` with its figures, all numbers as
`paper_vs_measured.csv` and `.parquet`, and a campaign folder for each experiment; the page in
`docs/` is a copy of that of a full run."""

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
        "not reproduced, but in another reading",
        "not reproduced, but within 5 %",
    )
    return markdown(heads, rows)


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
        "words": sentences.claims(runs),
        "schedulers": schedulers.claims(runs),
        "downlinks": downlinks.claims(runs),
    }


def _errors(found: Sequence[Measured]) -> list[Measured]:
    return [it for it in found if it.row.quantity.startswith("cte")]


def _figures(*names: str) -> Iterator[str]:
    for name in names:
        yield f"![{CAPTIONS[name]}]({FIGURES}/{name}.png)"
        yield f"*{CAPTIONS[name]}*"


def _ablations(runs: Runs) -> str:
    rows: list[tuple[object, ...]] = [
        ("**published**", asvs, _published(asvs, "fixes"), _published(asvs, "cte"), "")
        for asvs in (1, 3)
    ]
    table = ablations.compared(runs)
    for row in table.to_dict("records"):
        fixes = " / ".join(f"{row[f'fixes_{auv}']:.1f}" for auv in ablations.AUVS)
        errors = " / ".join(f"{row[f'error_{auv}']:.2f}" for auv in ablations.AUVS)
        rows.append((f"`{row['change']}`", row["asvs"], fixes, errors, f"{row['collisions']:.1f}"))
    heads = ("change", "ASVs", "fixes of AUV0 / 1 / 2", "position error (m)", "collisions")
    return markdown(heads, rows)


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
        f"{total} missions, {day}, model {model_version()}, Python {platform.python_version()}, "
        f"{packages}."
    )
    yield (
        "To make it again (a call that was cut short continues where it stopped):\n\n"
        f"    bindusbl-des {command}"
    )
