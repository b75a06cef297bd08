"""Figures of campaigns: a metric over one varied key, or over two."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from ..core.palette import COLOURS
from ..core.wording import with_half
from ..records.metrics import lower_is_better, quantity
from .style import LARGEST_LEGEND, legend_below, new_figure, shortened

# More columns or rows than this leave no room for numbers in the cells of a heatmap.
MOST_WRITTEN = 12

# Distance between series at a value that is no number, in distances between such values
BESIDE = 0.06

MARKERS = "osD^vP*X"

# Luminance of red, green and blue, and from which on black differs more than white (WCAG 2.2)
LUMINANCE, HALF_LIGHT = (0.2126, 0.7152, 0.0722), 0.179

NOTHING = (np.nan, np.nan, 0)
GAPS = "n/m: n of m missions have a value for every AUV"


@dataclass(frozen=True)
class Levels:
    """A varied key: its name, its unit ("" where it has none) and its values."""

    key: str
    unit: str
    values: tuple[Any, ...]

    @property
    def label(self) -> str:
        """The label of an axis: the key without its unit, and that beside it."""
        if self.unit in ("", "1"):
            return self.key
        return f"{self.key.removesuffix('_' + self.unit.replace('/', '_per_'))} ({self.unit})"

    @property
    def is_numeric(self) -> bool:
        """Tell whether its values are numbers that differ."""
        numbers = [v for v in self.values if isinstance(v, int | float) and type(v) is not bool]
        return len(numbers) == len(self.values)

    def written(self) -> list[str]:
        """Return the values as one reads them."""
        return ["null" if v is None else f"{v:g}" if self.is_numeric else str(v)
                for v in self.values]  # fmt: skip


@dataclass(frozen=True)
class Means:
    """The mean of a metric and half its 95 % confidence interval wherever keys have some values.

    `cells` maps the numbers of the values of x and series (0 where there is no series) to mean,
    half width (nan where one mission alone was run) and count of missions.  `gaps` has those in
    which some AUV has no value: in how many missions all have one, of how many.
    """

    metric: str
    unit: str
    x: Levels
    series: Levels | None
    cells: Mapping[tuple[int, int], tuple[float, float, int]]
    title: str
    gaps: Mapping[tuple[int, int], tuple[int, int]] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """The label of the metric's axis."""
        return quantity(self.metric)


def curves(means: Means, width: float) -> Figure:
    """Draw a metric over a varied key, a line for each value of another, with 95 % intervals."""
    figure = new_figure(width, 0.72 * width)
    axes, x = figure.add_subplot(), means.x
    places = [float(v) for v in x.values] if x.is_numeric else list(range(len(x.values)))
    aside = 0.0 if x.is_numeric else BESIDE
    handles: list[Artist] = []
    names = means.series.written() if means.series else [""]
    for number, name in enumerate(names):
        seen = {i for i, line in (*means.cells, *means.gaps) if line == number}
        at = sorted(seen, key=lambda i: places[i])  # a line has a gap where no AUV had a value
        cells = [means.cells.get((i, number), NOTHING) for i in at]
        mean, half, _ = np.array(cells).reshape(-1, 3).T
        bars = axes.errorbar(
            [places[i] + aside * (number - (len(names) - 1) / 2) for i in at], mean,
            yerr=np.nan_to_num(half), label=name, capsize=2.5,
            color=COLOURS[number % len(COLOURS)], marker=MARKERS[number % len(MARKERS)], ms=3.5,
            elinewidth=0.8, ls="-" if x.is_numeric else "",
        )  # fmt: skip
        handles.append(Line2D([], [], color=bars[0].get_color(), marker=bars[0].get_marker(),
                              ms=3.5, label=name))  # fmt: skip
        beside = aside * (number - (len(names) - 1) / 2)
        _mark_gaps(axes, means, number, [place + beside for place in places])
    if means.gaps:
        handles.append(Line2D([], [], ls="", marker="o", mfc="white", mec="black", ms=3.5,
                              label=GAPS))  # fmt: skip
    if not x.is_numeric:
        axes.set(xlim=(-0.5, len(places) - 0.5))
    if len(places) <= MOST_WRITTEN:
        axes.set_xticks(places, x.written())
    axes.set(xlabel=x.label, ylabel=means.label)
    axes.set_title(shortened(means.title, figure, 0.9))
    if means.series or means.gaps:
        lines = handles[: len(names)] if means.series else []
        legend_below(figure, [*lines[: 2 * LARGEST_LEGEND], *handles[len(names) :]])
    if means.series:
        figure.legends[0].set_title(means.series.label)
    return figure


def _mark_gaps(axes: Axes, means: Means, number: int, places: list[float]) -> None:
    """Mark where some AUV has no value: hollow, with how many missions have a value for all."""
    for (column, line), (whole, missions) in means.gaps.items():
        if line != number:
            continue
        text, colour = f"{whole}/{missions}", COLOURS[number % len(COLOURS)]
        cell = means.cells.get((column, line))
        if cell is None:  # nothing to draw a point at: on the axis
            axes.annotate(
                text, (places[column], 0.02), xycoords=axes.get_xaxis_transform(),
                ha="center", color=colour, fontsize=6,
            )  # fmt: skip
            continue
        marker = MARKERS[number % len(MARKERS)]
        axes.plot(
            places[column], cell[0], marker=marker, ms=3.5, mfc="white", mec=colour, zorder=5,
        )  # fmt: skip
        axes.annotate(
            text, (places[column], cell[0]), xytext=(4, 4), textcoords="offset points",
            color=colour, fontsize=6,
        )  # fmt: skip


def heatmap(means: Means, width: float) -> Figure:
    """Draw a metric over two varied keys: colour for the mean, mean +- 95 % interval written.

    Hatched cells are of missions in which some AUV has no value.

    Raises:
        ValueError: when only one key varies.
    """
    if means.series is None:
        raise ValueError("a heatmap needs two varied keys")
    figure = new_figure(width, 0.8 * width)
    axes = figure.add_subplot()
    shape = (len(means.series.values), len(means.x.values))
    grid = np.full(shape, np.nan)
    for (column, row), (mean, _, _) in means.cells.items():
        grid[row, column] = mean
    shades = "cividis_r" if lower_is_better(means.metric) else "cividis"  # dark is bad
    image = axes.imshow(grid, cmap=shades, origin="lower", aspect="auto")
    axes.grid(visible=False)
    axes.set_xticks(range(shape[1]), means.x.written())
    axes.set_yticks(range(shape[0]), means.series.written())
    axes.set(xlabel=means.x.label, ylabel=means.series.label)
    axes.set_title(shortened(means.title, figure, 0.9))
    figure.colorbar(image, label=means.label)
    if means.gaps:
        figure.supxlabel(f"hatched, {GAPS}", fontsize=6)
    for column, row in means.gaps:
        axes.add_patch(
            Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, ec="#ffffff80", hatch="//", lw=0)
        )
    if max(shape) <= MOST_WRITTEN:
        _write_cells(axes, means, image)
    return figure


def _write_cells(axes: Axes, means: Means, image: AxesImage) -> None:
    """Write means and intervals in black or white, whichever differs more from the ground."""
    size = 7 if max(image.get_size()) <= 6 else 4.5
    for cell in dict.fromkeys((*means.cells, *means.gaps)):
        mean, half, _ = means.cells.get(cell, NOTHING)
        told, spread = with_half(mean, half)
        text = told + ("" if np.isnan(half) else f"\n±{spread}")
        if cell in means.gaps:
            text += "\n{}/{}".format(*means.gaps[cell])
        light = np.dot(np.power(image.to_rgba(np.array([mean]))[0, :3], 2.2), LUMINANCE)
        colour = "black" if np.isnan(mean) or light > HALF_LIGHT else "white"
        axes.text(*cell, text, ha="center", va="center", color=colour, fontsize=size)
