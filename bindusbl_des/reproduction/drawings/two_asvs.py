"""Two ASVs over the formation angle: errors, fixes and coverage of each AUV."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...campaigns.statistics.intervals import interval
from ...figures.style import TWO_COLUMNS, colour_of, legend_below, new_figure, vehicle_handles
from ..experiments.case_study import READINGS
from ..experiments.measured import per_seed
from ..published import published
from ..readings.readings import Reading

if TYPE_CHECKING:
    import pandas as pd

    from ..experiments.running import Runs

ANGLES = (0.0, 30.0, 60.0, 90.0)
AUVS = ("AUV0", "AUV1", "AUV2")
WIDTH = 0.26


def two_asvs(runs: "Runs") -> Figure:
    """Draw bars for each angle and AUV: errors in two readings, fixes, coverage."""
    auvs = runs["two_asvs"].auvs
    figure = new_figure(TWO_COLUMNS, 4.2)
    grid = figure.subplots(2, 2, sharex=True)
    first, third = READINGS[0], READINGS[2]
    for axes, reading, column, label, quantity in (
        (grid[0, 0], first, first.metric, "cross-track error (m)", "cte"),
        (grid[0, 1], third, third.metric, "position error, world bias (m)", "cte"),
        (grid[1, 0], first, "fixes_delivered", "fixes delivered", "fixes"),
        (grid[1, 1], first, "hf_coverage", "HF coverage", "coverage"),
    ):
        _draw_bars(axes, auvs, reading, column)
        _draw_published(axes, quantity)
        axes.set_ylabel(label)
    for axes in grid[1]:
        axes.set_xticks(range(len(ANGLES)), [f"{angle:.0f}" for angle in ANGLES])
        axes.set_xlabel("formation angle (deg)")
    cross = Line2D([], [], color="k", ls="", marker="x", ms=5, mew=1.4, label="paper, AUV0")
    legend_below(figure, [*vehicle_handles(AUVS), cross])
    return figure


def _draw_bars(axes: Axes, auvs: "pd.DataFrame", reading: Reading, column: str) -> None:
    for shift, auv in enumerate(AUVS):
        found = [
            interval(
                per_seed(
                    auvs,
                    column,
                    {**reading.fusion, "auv": auv, "asvs.formation.angle_deg": angle},
                )
            )
            for angle in ANGLES
        ]
        places = np.arange(len(ANGLES)) + (shift - 1) * WIDTH
        axes.bar(
            places, [it.mean for it in found], WIDTH, yerr=[it.half_width for it in found],
            color=colour_of(auv), error_kw={"elinewidth": 0.7}, capsize=1.5,
        )  # fmt: skip
    axes.grid(visible=False, axis="x")


def _draw_published(axes: Axes, quantity: str) -> None:
    for row in published():
        if row.asvs == "2" and row.auv == "AUV0" and row.quantity == quantity:
            place = ANGLES.index(float(row.angle_deg)) - WIDTH
            axes.plot(place, row.value, "x", color="k", ms=5, mew=1.4, clip_on=False, zorder=5)
