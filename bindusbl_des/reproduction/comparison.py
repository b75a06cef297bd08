"""Every published number beside what was measured here, and the tables that hold them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from .experiments import baseline, case_study, sweep
from .experiments.measured import Measured
from .experiments.running import Runs
from .published import Published, published

if TYPE_CHECKING:
    import pandas as pd

SECTIONS = {
    "tab:case_study": case_study.measure,
    "sec:case_study": case_study.measure,
    "sec:baseline": baseline.measure,
    "sec:sweep": sweep.measure,
    "con": sweep.measure,
}


def compared(runs: Runs) -> list[Measured]:
    """Return every published number with what was measured, in the order of the paper's table."""
    return [SECTIONS[row.source](row, runs) for row in published()]


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
