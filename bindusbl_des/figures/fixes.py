"""How many fixes each AUV has received by when."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .style import LARGEST_LEGEND, add_lines, colour_of, names, new_figure, shortened

if TYPE_CHECKING:
    from ..result import Result


def fixes(result: "Result", width: float) -> Figure:
    """Draw the cumulative count of fixes delivered to each AUV."""
    figure = new_figure(width, 0.62 * width)
    axes = figure.add_subplot()
    draw_fixes(axes, result)
    axes.set_title(shortened(f"{result.scenario.name}, seed {result.seed}", figure, 0.8))
    sent = result.tables["pings"].groupby("auv").size()
    for name in names("AUV", result.scenario.auvs.count)[:LARGEST_LEGEND]:
        got = len(deliveries(result, name))
        axes.plot([], [], color=colour_of(name), label=f"{name}: {got} of {sent.get(name, 0)}")
    more = result.scenario.auvs.count - LARGEST_LEGEND
    title = "delivered of pings" + (f" (first {LARGEST_LEGEND})" if more > 0 else "")
    axes.legend(loc="upper left", title=title, title_fontsize=7)
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
    axes.set(xlim=(0, duration), ylim=(0, max(1.05 * most, 1.0)))
    axes.yaxis.get_major_locator().set_params(integer=True)


def _steps(arrivals: np.ndarray, duration: float) -> np.ndarray:
    """Return the corners (n, 2) of a count that rises by one at each arrival."""
    count = np.arange(len(arrivals) + 1)
    times = np.concatenate(([0.0], np.repeat(arrivals, 2), [duration]))
    return np.column_stack((times, np.repeat(count, 2)))
