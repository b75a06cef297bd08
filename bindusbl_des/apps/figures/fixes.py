"""How many fixes each AUV has received by when, how old they are when they come, and how long AUVs
wait for the next.
"""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...support.palette import INK
from ...support.wording import significant
from ..report.gaps import shown_until
from .style import (
    LARGEST_LEGEND,
    add_lines,
    colour_of,
    count_from_zero,
    legend_below,
    names,
    new_figure,
    vehicle_handles,
)

if TYPE_CHECKING:
    from ...core.results.result import Result


def fixes(result: "Result", width: float) -> Figure:
    """Draw the cumulative count of fixes delivered to each AUV."""
    figure = new_figure(width, 0.62 * width)
    axes = figure.add_subplot()
    draw_fixes(axes, result)
    axes.set_title(f"{result.scenario.name}, seed {result.seed}")
    handles: list[Artist] = []
    pings = result.tables["pings"]
    sent = pings.groupby("auv").size()
    for name in names("AUV", result.scenario.auvs.count)[:LARGEST_LEGEND]:
        got = len(deliveries(result, name))
        own = len(pings) if result.scenario.protocol.asvs_ping else sent.get(name, 0)
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
    _draw_histogram(left, ages, "latency, ping to delivery (s)", "fixes (count)")
    _draw_histogram(right, waits, "interval between deliveries (s)", "intervals (count)")
    figure.suptitle(f"{result.scenario.name}, seed {result.seed}")
    legend_below(figure, vehicle_handles(auvs))
    return figure


def _draw_histogram(axes: Axes, values: list[np.ndarray], label: str, counted: str) -> None:
    """Draw a histogram stacked over AUVs, with the mean and the 95 % quantile of all."""
    together = np.concatenate(values)
    axes.set(xlabel=label, ylabel=counted)
    if not len(together):
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center")
        axes.set(xlim=(0, 1), ylim=(0, 1))
        return
    if len(values) <= LARGEST_LEGEND:
        colours = [colour_of(name) for name in names("AUV", len(values))]
    else:
        values, colours = [together], [INK]
    # From zero: what matters of a delay is how far it is from none.
    edges = np.linspace(0.0, shown_until(together) * 1.02, BINS + 1)
    beyond = int(np.sum(together > shown_until(together)))
    clipped = [np.minimum(own, edges[-1]) for own in values]
    axes.hist(clipped, bins=list(edges), stacked=True, color=colours, ec="white", lw=0.2)
    for value, style, what in (
        (float(together.mean()), "-", "mean"),
        (float(np.quantile(together, 0.95)), "--", "95 %"),
    ):
        label = f"{what} {significant(value)} s"
        axes.axvline(value, color=INK, ls=style, lw=0.9, label=label)
    if beyond:
        label = f"last bar: {beyond} beyond, up to {significant(float(together.max()))} s"
        axes.plot([], [], " ", label=label)
    axes.set_xlim(0.0, edges[-1])
    count_from_zero(axes, max(np.histogram(np.concatenate(clipped), edges)[0]))
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, borderaxespad=0.2)
