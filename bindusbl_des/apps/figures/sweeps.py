"""Figures of campaigns: a metric over one varied key, or over two."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from ...core.records.metrics import lower_is_better, quantity
from ...support.palette import COLOURS
from ...support.plugins import is_plugin
from ...support.wording import lettered, plain, with_half
from .style import LARGEST_LEGEND, LETTER, broken, has_room, legend_below, letters_in, new_figure

# More columns or rows than this leave no room for numbers in the cells of a heatmap.
MOST_WRITTEN = 12

# Of a figure's width what its axes have, about; the size (pt) of letters at ticks; the height (in)
# of a line; so many letters of a name have room beside a heatmap, so many lines of a legend below
PLOTTED, TICK, LINE, MOST_BESIDE, LEGEND_LINES = 0.8, 7, 0.13, 18, 3
BESIDE_BAR = 0.65  # of that, beside the bar of colours

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
        """Return the values as one reads them, parts of one's own without their modules."""
        if self.is_numeric:
            return [f"{value:g}" for value in self.values]
        names = [_worded(value) for value in self.values]
        bare = list(map(_without_module, names))
        return bare if len(set(bare)) == len(names) else names


def _worded(value: Any) -> str:
    """Return a value in words: a part with its settings, but for those that are null.

    >>> _worded({"model": "fixed_gain", "gain": 0.5}), _worded(None), _worded([1, 2.0])
    ('fixed_gain (gain 0.5)', 'null', '[1, 2]')
    """
    if not isinstance(value, Mapping) or "model" not in value:
        return plain(value)
    settings = {name: set_to for name, set_to in value.items() if set_to is not None}
    name = settings.pop("model")
    said = ", ".join(f"{setting} {plain(set_to)}" for setting, set_to in settings.items())
    return f"{name} ({said})" if said else str(name)


def _without_module(name: str) -> str:
    """Return a part's name, with its settings, as it is called in its module.

    >>> _without_module("my_parts:Fast (depth 2)"), _without_module("kalman")
    ('Fast (depth 2)', 'kalman')
    """
    part, space, settings = name.partition(" ")
    return f"{part.rpartition(':')[2]}{space}{settings}" if is_plugin(part) else name


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
    key = _name_ticks(axes.xaxis, x, places, width)
    axes.set(xlabel="\n".join([x.label, *key]), ylabel=means.label, title=means.title)
    axes.xaxis.label.set_multialignment("left" if key else "center")
    lines = len(key)
    if means.series or means.gaps:
        named = handles[: len(names)] if means.series else []
        shown = [*named[: 2 * LARGEST_LEGEND], *handles[len(names) :]]
        lines += max(legend_below(figure, shown) - LEGEND_LINES, 0)
    if means.series:
        figure.legends[0].set_title(means.series.label)
    figure.set_figheight(figure.get_figheight() + LINE * lines)
    return figure


def _name_ticks(
    axis: Axis, levels: Levels, places: Sequence[float], length: float, is_upright: bool = False
) -> list[str]:
    """Write the values of a key at their places along an axis of a length (in); return lines of
    names that have no room there, and letters instead, for below the figure.
    """
    names = levels.written()
    each = PLOTTED * length / len(names)
    if levels.is_numeric:
        if not isinstance(places, range):  # as far apart as the values are
            gaps = np.diff(np.sort(places)) / max(float(np.ptp(places)), 1e-300)
            each = PLOTTED * length * float(gaps.min(initial=1.0))
        step = max(ceil(LINE / each), 1)
        if step > 1 and not isinstance(places, range):
            return []  # round numbers say where they are
        axis.set_ticks(list(places)[::step], names[::step])
        if not is_upright and letters_in(each * step, TICK) <= max(map(len, names)):
            axis.set_tick_params(rotation=90)
        return []
    room = MOST_BESIDE if is_upright else max(letters_in(each, TICK) - 1, 1)
    if all(has_room(name, room, 2) for name in names):
        axis.set_ticks(list(places), [broken(name, room, 2) for name in names])
        return []
    letters = [lettered(number) for number in range(len(names))]
    axis.set_ticks(list(places), letters)
    return [f"{letter}: {name}" for letter, name in zip(letters, names, strict=True)]


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
    length = BESIDE_BAR * width
    across = _name_ticks(axes.xaxis, means.x, range(shape[1]), length)
    upright = _name_ticks(axes.yaxis, means.series, range(shape[0]), length, is_upright=True)
    below = [means.x.label, *across, *([f"{means.series.label}:"] if upright else []), *upright]
    axes.set(xlabel="\n".join(below), ylabel=means.series.label, title=means.title)
    axes.xaxis.label.set_multialignment("left" if len(below) > 1 else "center")
    figure.set_figheight(figure.get_figheight() + LINE * (len(below) - 1))
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
    texts = {cell: _cell(means, cell) for cell in dict.fromkeys((*means.cells, *means.gaps))}
    longest = max(len(line) for text in texts.values() for line in text.split("\n"))
    each = BESIDE_BAR * PLOTTED * axes.figure.get_figwidth() / image.get_size()[1]  # type: ignore[union-attr]
    size = min(7 if max(image.get_size()) <= 6 else 4.5, 72 * each / (LETTER * longest))
    for cell, text in texts.items():
        mean, *_ = means.cells.get(cell, NOTHING)
        light = np.dot(np.power(image.to_rgba(np.array([mean]))[0, :3], 2.2), LUMINANCE)
        colour = "black" if np.isnan(mean) or light > HALF_LIGHT else "white"
        axes.text(*cell, text, ha="center", va="center", color=colour, fontsize=size)


def _cell(means: Means, cell: tuple[int, int]) -> str:
    mean, half, _ = means.cells.get(cell, NOTHING)
    told, spread = with_half(mean, half)
    gap = "{}/{}".format(*means.gaps[cell]) if cell in means.gaps else ""
    return "\n".join(filter(None, [told, "" if np.isnan(half) else f"±{spread}", gap]))
