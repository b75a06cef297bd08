"""The paper's figures, drawn from the Parquet tables of its campaigns."""

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from ...figures.style import save, styled
from ..experiments.running import Runs
from ..readings.counting import Tally
from .ablations import ablations
from .downlinks import downlinks
from .missions import baseline, errors_and_fixes, failure_and_recovery
from .readings import readings
from .schedulers import schedulers
from .sweeps import heatmap, sweep, sweep_distance
from .two_asvs import two_asvs

DRAWINGS: dict[str, Callable[[Runs], Figure]] = {
    drawing.__name__: drawing
    for drawing in (
        baseline,
        failure_and_recovery,
        errors_and_fixes,
        two_asvs,
        heatmap,
        sweep_distance,
        sweep,
        schedulers,
        downlinks,
        ablations,
    )
}

# Enough for a page on a screen; together the figures stay below a megabyte and a half.
DOTS_PER_INCH = 120


def draw(runs: Runs, folder: Path) -> None:
    """Draw every figure into a folder as PNG."""
    with styled():
        for name, drawing in DRAWINGS.items():
            save(drawing(runs), folder / f"{name}.png", dpi=DOTS_PER_INCH)


def draw_readings(counted: Tally, folder: Path) -> None:
    """Draw the figure of the joint readings into a folder as PNG."""
    with styled():
        save(readings(counted), folder / "readings.png", dpi=DOTS_PER_INCH)
