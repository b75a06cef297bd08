"""Reproduce the paper: run its experiments, judge its numbers, draw its figures, write it down."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..campaigns.storage.parts import Draft
from .catalogue import experiments
from .claims import Claimed
from .comparison import compared, table
from .document import FIGURES, claimed, document
from .drawings import draw
from .measured import Measured
from .running import Runs, run_all

DOCUMENT = "reproduction.md"


@dataclass(frozen=True)
class Reproduction:
    """Everything the paper says beside what was measured, and the folder that shows it."""

    folder: Path
    runs: Runs
    numbers: Sequence[Measured]
    claims: Mapping[str, Sequence[Claimed]]

    def sentences(self) -> list[Claimed]:
        """Return every sentence with its verdict."""
        return [claim for section in self.claims.values() for claim in section]


def reproduce(
    folder: str | Path,
    *,
    quick: bool = False,
    workers: int | None = None,
    quiet: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> Reproduction:
    """Run every experiment of the paper in a folder and write what came out of it.

    A call that was cut short is continued by the next one.

    Raises:
        CampaignError: when the folder holds other campaigns.
        Interrupted: when the user stopped it.
        SomeFailed: when a mission failed.
    """
    folder = Path(folder)
    runs = run_all(experiments(quick=quick), folder, workers=workers, quiet=quiet, tell=tell)
    tell("figures and tables")
    found = Reproduction(folder, runs, compared(runs), claimed(runs))
    _write(found, quick)
    return found


def _write(found: Reproduction, quick: bool) -> None:
    """Write tables, figures and at last the document, each whole or not at all."""
    frame = table(found.numbers)
    with Draft(found.folder / "paper_vs_measured.csv") as file:
        file.write(frame.to_csv(index=False).encode())
    with Draft(found.folder / "paper_vs_measured.parquet") as file:
        frame.to_parquet(file, compression="zstd")
    (found.folder / FIGURES).mkdir(parents=True, exist_ok=True)
    draw(found.runs, found.folder / FIGURES)
    with Draft(found.folder / DOCUMENT) as file:
        file.write(document(found.numbers, found.claims, found.runs, quick=quick).encode())
