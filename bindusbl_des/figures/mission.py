"""The picture that every run leaves: map, error and fixes on one page."""

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from .error import draw_errors
from .fixes import draw_fixes
from .style import save, shortened, styled
from .trajectory import draw_map, map_handles

if TYPE_CHECKING:
    from ..result import Result

DOTS_PER_INCH = 110

# zlib level: a few kilobytes more than the best, for a tenth of its time
COMPRESSION = 1

# Ticks cost more than lines.
MOST_TICKS = 6


def save_mission_figure(result: "Result", path: Path) -> None:
    """Draw a mission: the map, and beside it each error over time and cumulative fixes.

    Its axes stand at fixed places: every run pays for this picture, and a layout engine would
    double the price.
    """
    with styled():
        figure = mission_figure(result)
        save(figure, path, dpi=DOTS_PER_INCH, pil_kwargs={"compress_level": COMPRESSION})


def mission_figure(result: "Result") -> Figure:
    """Return the picture of a mission."""
    figure = Figure(figsize=(11.0, 5.9))
    draw_map(figure.add_axes((0.065, 0.2, 0.41, 0.72)), result)
    error = figure.add_axes((0.555, 0.6, 0.425, 0.32))
    draw_errors(error, result)
    error.set_xlabel("")
    error.tick_params(labelbottom=False)
    draw_fixes(figure.add_axes((0.555, 0.12, 0.425, 0.38)), result)
    for axes in figure.axes:
        axes.locator_params(nbins=MOST_TICKS)
    scenario = result.scenario
    figure.suptitle(
        shortened(
            f"{scenario.name}, seed {result.seed}: AUVs {scenario.auvs.count}, "
            f"ASVs {scenario.asvs.count}, L = {scenario.survey.side_m:g} m",
            figure,
        ),
        y=0.985,
    )
    handles = map_handles(scenario)
    figure.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.27, 0.0), ncols=5)
    return figure
