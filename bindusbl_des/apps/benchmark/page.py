"""Scores for a reader: lines for a terminal, and a page."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from math import isnan
from string import Template

from ...support.wording import counted
from ..report.page import THEME, assembled, filled, table
from .scoring import METRICS, Score
from .tasks import VERSION, citation, task_named

Row = dict[str, Score]


def _rows(found: Sequence[Score], task: str) -> list[tuple[str, Row]]:
    """Return the scores of each method in a task, the best of the worst AUV first."""
    rows = {
        method: {score.metric: score for score in scores}
        for method, scores in groupby(
            (score for score in found if score.task == task), key=lambda score: score.method
        )
    }
    return sorted(rows.items(), key=lambda row: row[1]["worst_error_m"].mean)


def _cell(score: Score, signed: bool = False) -> str:
    digits = METRICS[score.metric][2]
    mean, high = (score.difference, score.difference_high) if signed else (score.mean, score.high)
    if isnan(mean):
        return "-"
    sign = "+" if signed else ""
    half = "" if isnan(high) else f" ± {high - mean:.{digits}f}"
    return f"{mean:{sign}.{digits}f}{half}"


def lines(found: Sequence[Score]) -> Iterator[str]:
    """Yield the scores in lines of at most 80 columns, task by task."""
    for task in dict.fromkeys(score.task for score in found):
        first = next(score for score in found if score.task == task)
        yield f"{task} ({counted(first.seeds, 'seed')}; baseline {task_named(task).baseline})"
        yield f"  {'method':<22}{'worst AUV, m':>17}{'to baseline, m':>19}{'NEES':>8}{'inside':>8}"
        for method, row in _rows(found, task):
            error = row["worst_error_m"]
            name = method if len(method) <= 21 else f"{method[:20]}~"
            yield (
                f"  {name:<22}{_cell(error):>17}{_cell(error, True):>19}"
                f"{_plain(row['nees']):>8}{_plain(row['inside_95']):>8}"
            )
    yield f"Cite as {citation()}, with the seeds"


def _plain(score: Score) -> str:
    return "-" if isnan(score.mean) else f"{score.mean:.2f}"


def _both(score: Score, baseline: str) -> str:
    """Return a mean, and on a line below it the difference from the baseline's where that tells."""
    if METRICS[score.metric][3] is None or score.method == baseline or isnan(score.difference):
        return _cell(score)
    return f"{_cell(score)}\n{_cell(score, True)}"


PAGE = Template(
    """<header><h1>Benchmark, version $version</h1>$theme</header>
<p>Each method flew the same missions as the baseline of its task: means over seeds with 95 %
intervals, and below them the difference from the baseline, paired by seed. NEES is 2 and 95 % are
inside where covariances are right. The best of the worst AUV's mean error stands first. Cite as
$citation, with the seeds.</p>
$tasks"""
)


def benchmark_page(found: Sequence[Score]) -> str:
    """Return the page of scores, as HTML."""
    parts = []
    for task in dict.fromkeys(score.task for score in found):
        own = task_named(task)
        said = own.path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
        headings = [("method", ""), *((words, unit) for words, unit, *_ in METRICS.values())]
        rows, looks = [], dict[tuple[int, int], str]()
        for place, (method, row) in enumerate(_rows(found, task)):
            rows.append([method, *(_both(row[metric], own.baseline) for metric in METRICS)])
            error = row["worst_error_m"]
            if error.difference_high < 0.0:
                looks[place, 1] = "good"
            elif error.difference_low > 0.0:
                looks[place, 1] = "bad"
        parts.append(
            filled("<h2>{task}</h2><p>{said}</p>", task=task, said=said)
            + f'<div class="limits">{table(headings, rows, f"Scores in {task}", looks)}</div>'
        )
    body = PAGE.substitute(
        version=VERSION, citation=citation(), theme=THEME, tasks="\n".join(parts)
    )
    return assembled("Benchmark", f"<main>{body}</main>", (), {}, "")
