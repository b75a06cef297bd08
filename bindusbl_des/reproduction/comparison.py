"""Every published number beside what was measured here, and the tables that hold them."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from . import baseline, case_study, sweep
from .measured import Measured
from .published import Published, published
from .running import Runs

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

    return pd.DataFrame([_record(it) for it in found])


def _record(it: Measured) -> dict[str, object]:
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


def write(found: Sequence[Measured], folder: Path) -> None:
    """Write the comparison as CSV and Parquet."""
    frame = table(found)
    frame.to_csv(folder / "paper_vs_measured.csv", index=False)
    frame.to_parquet(folder / "paper_vs_measured.parquet", compression="zstd")
