"""Ablations: Table I with one choice changed at a time."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...figures.style import TWO_COLUMNS, colour_of, legend_below, new_figure, vehicle_handles
from ..experiments.ablations import AUVS, compared
from ..published import published

if TYPE_CHECKING:
    import pandas as pd

    from ..experiments.running import Runs


def ablations(runs: "Runs") -> Figure:
    """Draw fixes (left) and position errors (right) with one ASV (above) and three (below)."""
    table = compared(runs)
    figure = new_figure(TWO_COLUMNS, 5.4)
    grid = figure.subplots(2, 2, sharey=True)
    for row, asvs in zip(grid, (1, 3), strict=True):
        mine = table[table.asvs == asvs].reset_index(drop=True)
        for axes, name, quantity in zip(row, ("fixes", "error"), ("fixes", "cte"), strict=True):
            _draw_dots(axes, mine, name)
            _draw_published(axes, asvs, quantity)
            axes.set_title(f"{asvs} ASV{'s' * (asvs > 1)}")
    labels = [_short(change) for change in table[table.asvs == 1].change]
    grid[0, 0].set_yticks(range(len(labels)), labels)
    grid[0, 0].set_ylim(len(labels) - 0.5, -0.5)
    grid[1, 0].set_xlabel("fixes delivered")
    grid[1, 1].set_xlabel("position error (m)")
    legend_below(figure, vehicle_handles(AUVS))
    return figure


def _short(change: str) -> str:
    """Return a change without the sections of its key.

    >>> _short("acoustics.loss.combine=off")
    'combine=off'
    """
    return change.rpartition(".")[2]


def _draw_dots(axes: Axes, table: "pd.DataFrame", name: str) -> None:
    for shift, auv in enumerate(AUVS):
        places = np.arange(len(table)) + 0.22 * (shift - 1)
        axes.errorbar(
            table[f"{name}_{auv}"], places, xerr=table[f"{name}_{auv}_half_width"], fmt="o", ms=3,
            color=colour_of(auv), elinewidth=0.8,
        )  # fmt: skip
    axes.set_xlim(left=0)


def _draw_published(axes: Axes, asvs: int, quantity: str) -> None:
    for row in published():
        if row.source == "tab:case_study" and row.asvs == str(asvs) and row.quantity == quantity:
            axes.axvline(row.value, color=colour_of(row.auv), ls="--", lw=0.8)
