"""How old fixes are when they come, and how long AUVs wait for the next."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..palette import INK
from .fixes import deliveries
from .style import (
    LARGEST_LEGEND,
    colour_of,
    count_from_zero,
    legend_below,
    names,
    new_figure,
    shortened,
    vehicle_handles,
)

if TYPE_CHECKING:
    from ..result import Result

BINS = 30


def latency(result: "Result", width: float) -> Figure:
    """Draw histograms of the latency of fixes and of the intervals between them."""
    auvs = names("AUV", result.scenario.auvs.count)
    fixes = result.tables["fixes"]
    ages = [fixes.latency_s[(fixes.auv == name)].dropna().to_numpy(float) for name in auvs]
    waits = [np.diff(deliveries(result, name)) for name in auvs]
    side_by_side = width > 5
    figure = new_figure(width, 2.7 if side_by_side else 4.4)
    left, right = figure.subplots(1, 2) if side_by_side else figure.subplots(2, 1)
    _draw_histogram(left, ages, "latency, ping to delivery (s)")
    _draw_histogram(right, waits, "interval between deliveries (s)")
    figure.suptitle(shortened(f"{result.scenario.name}, seed {result.seed}", figure, 0.9))
    legend_below(figure, vehicle_handles(auvs))
    return figure


def _draw_histogram(axes: Axes, values: list[np.ndarray], label: str) -> None:
    """Draw a histogram stacked over AUVs, with the mean and the 95 % quantile of all."""
    together = np.concatenate(values)
    axes.set(xlabel=label, ylabel="fixes (count)")
    if not len(together):
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center")
        axes.set(xlim=(0, 1), ylim=(0, 1))
        return
    if len(values) <= LARGEST_LEGEND:
        colours = [colour_of(name) for name in names("AUV", len(values))]
    else:
        values, colours = [together], [colour_of("AUV0")]
    # From zero: what matters of a delay is how far it is from none.
    edges = np.linspace(0.0, float(together.max()) * 1.02, BINS + 1)
    axes.hist(values, bins=list(edges), stacked=True, color=colours, ec="white", lw=0.2)
    for value, style, what in (
        (float(together.mean()), "-", "mean"),
        (float(np.quantile(together, 0.95)), "--", "95 %"),
    ):
        axes.axvline(value, color=INK, ls=style, lw=0.9, label=f"{what} {value:.3g} s")
    axes.set_xlim(left=0)
    count_from_zero(axes, max(np.histogram(together, edges)[0]))
    axes.legend(loc="best")
