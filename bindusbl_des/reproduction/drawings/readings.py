"""How many published numbers the joint readings foretell."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.palette import COLOURS, FAINT, INK
from ...figures.style import ONE_COLUMN, new_figure
from ..readings.counting import Tally
from ..readings.readings import DEFAULT


def readings(counted: Tally) -> Figure:
    """Draw a histogram of all readings, with `default`, the best, and the best by chance."""
    figure = new_figure(ONE_COLUMN, 2.4)
    axes = figure.subplots()
    chance = counted.by_chance
    axes.axvspan(chance.low - 0.5, chance.high + 0.5, color=FAINT, zorder=0)
    most = int(counted.foretold.max())
    axes.hist(
        counted.foretold,
        bins=[edge - 0.5 for edge in range(most + 2)],
        color=COLOURS[0],
        rwidth=0.85,
    )
    for label, place in (("default", counted.place(DEFAULT)), ("best", counted.ranks[0])):
        _mark(axes, int(counted.foretold[place]), label)
    axes.set_xlabel(f"numbers foretold, of {int(counted.free.sum())}")
    axes.set_ylabel("joint readings")
    axes.grid(visible=False, axis="x")
    return figure


def _mark(axes: Axes, foretold: int, label: str) -> None:
    axes.axvline(foretold, color=INK, ls="--", lw=0.8)
    axes.text(
        foretold, 1.0, f"{label} ", rotation=90, ha="right", va="top", fontsize=6.5,
        transform=axes.get_xaxis_transform(),
    )  # fmt: skip
