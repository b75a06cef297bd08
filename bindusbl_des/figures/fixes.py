"""How many fixes each AUV has received by when."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .style import (
    LARGEST_LEGEND,
    add_lines,
    colour_of,
    count_from_zero,
    legend_below,
    names,
    new_figure,
    shortened,
)

if TYPE_CHECKING:
    from ..results.result import Result


def fixes(result: "Result", width: float) -> Figure:
    """Draw the cumulative count of fixes delivered to each AUV."""
    figure = new_figure(width, 0.62 * width)
    axes = figure.add_subplot()
    draw_fixes(axes, result)
    axes.set_title(shortened(f"{result.scenario.name}, seed {result.seed}", figure, 0.8))
    handles: list[Artist] = []
    pings = result.tables["pings"]
    sent = pings.groupby("auv").size()
    for name in names("AUV", result.scenario.auvs.count)[:LARGEST_LEGEND]:
        got = len(deliveries(result, name))
        own = len(pings) if result.scenario.protocol.is_passive else sent.get(name, 0)
        label = f"{name}: {got} of {own} pings"
        handles.append(Line2D([], [], color=colour_of(name), label=label))
    legend_below(figure, handles)
    return figure


def deliveries(result: "Result", auv: str) -> np.ndarray:
    """Return the instants (s) at which fixes reached an AUV, in order."""
    table = result.tables["fixes"]
    mine = table[(table.auv == auv) & (table.outcome == "delivered")]
    return np.sort(mine.delivered_at_s.to_numpy(float))


def draw_fixes(axes: Axes, result: "Result") -> None:
    """Draw each AUV's cumulative count of delivered fixes as steps."""
    duration, auvs = result.scenario.duration_s, names("AUV", result.scenario.auvs.count)
    lines = [_steps(deliveries(result, name), duration) for name in auvs]
    add_lines(axes, lines, [colour_of(name) for name in auvs], linewidths=1.2)
    most = max(line[-1, 1] for line in lines)
    axes.set(xlabel="time (s)", ylabel="fixes delivered (count)")
    axes.set_xlim(0, duration)
    count_from_zero(axes, most)


def _steps(arrivals: np.ndarray, duration: float) -> np.ndarray:
    """Return the corners (n, 2) of a count that rises by one at each arrival."""
    count = np.arange(len(arrivals) + 1)
    times = np.concatenate(([0.0], np.repeat(arrivals, 2), [duration]))
    return np.column_stack((times, np.repeat(count, 2)))
