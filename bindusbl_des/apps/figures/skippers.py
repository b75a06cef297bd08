"""One sheet of paper for the bridge: a chart with its graticule, tables, and plain words."""

import math
from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure

from ...core.geometry.geodesy import east_north
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.palette import FAINT, HF, INK
from .style import LARGEST_LEGEND, Drawing, colour_of
from .trajectory import closed_handles, draw_survey, heard_patches

# A4 (in), its margin, and how high a line of text and the chart are
PAPER, MARGIN, LINE, CHART = (8.27, 11.69), 0.6, 0.165, 4.9
# Type (pt), and how many letters of TEXT a line has
TITLE, HEADING, TEXT, SMALL, LETTERS = 15, 10, 8.5, 7, 118

# Steps of a graticule (minutes of arc): so many of its lines are wanted across a chart
MINUTES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60)
WANTED = 5
# A scale is about so much of the width of a chart.
SCALE = 0.25


class Table(NamedTuple):
    """A table of a sheet: its heading, its columns with their widths (shares), and its rows."""

    heading: str
    columns: Sequence[tuple[str, float]]
    rows: Sequence[Sequence[str]]


class Sheet(NamedTuple):
    """What a sheet says: title, a line under it, paragraphs, tables, and a line at its foot."""

    title: str
    subtitle: str
    paragraphs: Sequence[str]
    tables: Sequence[Table]
    foot: str


def skippers_sheet(
    setup: Setup, sheet: Sheet, lanes: Mapping[int, Floats], ways: Any = ()
) -> Figure:
    """Draw a sheet of A4 for the crew of a survey that is on Earth: chart, tables, words.

    `lanes` (n, 2), m, are those of AUVs, by their numbers; `ways` (n, 2), m, those of vessels that
    move.
    """
    figure, writer = Drawing(figsize=PAPER), _Writer()
    writer.write(figure, sheet.title, TITLE, weight="bold")
    writer.write(figure, sheet.subtitle, TEXT, colour="#555555")
    for paragraph in sheet.paragraphs:
        writer.write(figure, paragraph, TEXT + 0.5)
    writer.down -= 0.3
    width, height = PAPER[0] - 2 * MARGIN - 0.7, CHART
    place = (MARGIN + 0.7, writer.down - height, width, height)
    axes = figure.add_axes(_share(place))
    _draw_chart(axes, setup, lanes, ways)
    writer.down -= height + 0.42
    for table in sheet.tables:
        _tabulate(figure, writer, table)
    foot = "\n".join(wrap(sheet.foot, int(LETTERS * TEXT / SMALL)))
    figure.text(
        MARGIN / PAPER[0], 0.35 / PAPER[1], foot, fontsize=SMALL, color="#555555", va="bottom"
    )
    return figure


def room_for(paragraphs: Sequence[str], headings: int) -> int:
    """Return how many rows the tables of a sheet may have in all."""
    lines = sum(len(wrap(text, LETTERS)) for text in paragraphs)
    left = PAPER[1] - 2 * MARGIN - CHART - 1.5 - LINE * lines - headings * (3.2 * LINE)
    return max(int(left / LINE), 4)


class _Writer:
    """Where on a sheet the next line goes, counted from its bottom (in)."""

    def __init__(self) -> None:
        self.down = PAPER[1] - MARGIN

    def write(
        self, figure: Figure, text: str, size: float, gap: float = 0.06, **looks: Any
    ) -> None:
        """Write a text in as many lines as it takes, and leave a gap (in) below."""
        colour = looks.pop("colour", INK)
        for line in wrap(text, int(LETTERS * TEXT / size)):
            figure.text(
                MARGIN / PAPER[0], self.down / PAPER[1], line, fontsize=size, color=colour,
                va="top", **looks,
            )  # fmt: skip
            self.down -= LINE * size / TEXT
        self.down -= gap


def _share(place: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    left, bottom, width, height = place
    return left / PAPER[0], bottom / PAPER[1], width / PAPER[0], height / PAPER[1]


def _tabulate(figure: Figure, writer: _Writer, table: Table) -> None:
    writer.down -= 0.1
    writer.write(figure, table.heading, HEADING, gap=0.03, weight="bold")
    span = PAPER[0] - 2 * MARGIN
    header = tuple(name for name, _ in table.columns)
    for row in (header, *table.rows):
        colour = "#555555" if row is header else INK
        at = MARGIN
        for text, (_, share) in zip(row, table.columns, strict=True):
            figure.text(
                at / PAPER[0], writer.down / PAPER[1], text, fontsize=TEXT, va="top", color=colour
            )
            at += share * span
        writer.down -= LINE


def _draw_chart(axes: Axes, setup: Setup, lanes: Mapping[int, Floats], ways: Sequence[Any]) -> None:
    """Draw area, lanes, vessels and HF ranges (m), with a graticule in degrees and minutes."""
    stations = east_north(np.array(setup.kept_stations_m).reshape(-1, 2))
    outline = east_north(setup.area.outline)
    draw_survey(axes, setup, width=1.2)
    colours = [colour_of(f"AUV{auv}") for auv in lanes]
    drawn = [east_north(lane) for lane in lanes.values()]
    axes.add_collection(LineCollection(drawn, colors=colours, linewidths=0.8))
    for auv, lane in enumerate(drawn[:LARGEST_LEGEND]):
        _name(axes, f"AUV{auv}", lane[0], colours[auv])
    moving = [east_north(way) for way in ways]
    axes.add_collection(LineCollection(moving, colors="k", linewidths=0.7, linestyles="--"))
    if not len(stations):
        stations = np.array([way[0] for way in moving]).reshape(-1, 2)
    if not moving:
        rings = heard_patches(setup, setup.kept_stations_m, setup.horizontal_reach_m)
        axes.add_collection(PatchCollection(rings, fc="none", ec=HF, lw=0.6, ls="--"))
    axes.scatter(stations[:, 0], stations[:, 1], s=70, c="k", marker="*", zorder=5)
    for number, place in enumerate(stations):
        _name(axes, f"ASV{number}", place, "k", weight="bold")
    _frame(axes, np.concatenate([outline, stations, *drawn, *moving]))
    _graticule(axes, setup)
    _scale(axes)
    if handles := closed_handles(setup):
        axes.legend(handles=handles, loc="lower right", fontsize=7, framealpha=0.85, frameon=True)


def _name(axes: Axes, name: str, place: Any, colour: str, **looks: Any) -> None:
    axes.annotate(
        name, tuple(place), (5, 4), textcoords="offset points", fontsize=8, color=colour, zorder=6,
        annotation_clip=True, **looks,
    )  # fmt: skip


def _frame(axes: Axes, places: Floats) -> None:
    """Show all places, as large as the paper allows, one metre as long to the east as north."""
    low, high = places.min(axis=0), places.max(axis=0)
    width, height = np.array(PAPER) * axes.get_position().size
    scale = 1.12 * max((high[0] - low[0]) / width, (high[1] - low[1]) / height, 1e-3)
    (east, north) = (low + high) / 2
    axes.set(
        xlim=(east - scale * width / 2, east + scale * width / 2),
        ylim=(north - scale * height / 2, north + scale * height / 2),
        aspect="equal",
    )


def _graticule(axes: Axes, setup: Setup) -> None:
    """Draw meridians and parallels of whole steps, and write what they are."""
    origin = setup.origin_deg
    assert origin is not None
    [(lat, lon, _)] = setup.on_earth([(1000.0, 1000.0)])
    per_metre = (math.remainder(lon - origin[1], 360.0) / 1000.0, (lat - origin[0]) / 1000.0)
    for axis, limits, begin, each, sides, digits in (
        (axes.xaxis, axes.get_xlim(), origin[1], per_metre[0], "EW", 3),
        (axes.yaxis, axes.get_ylim(), origin[0], per_metre[1], "NS", 2),
    ):
        low, high = (60.0 * (begin + each * at) for at in limits)
        step = next((one for one in MINUTES if one >= (high - low) / WANTED), MINUTES[-1])
        minutes = [step * n for n in range(math.ceil(low / step), math.floor(high / step) + 1)]
        axis.set_ticks([(at / 60.0 - begin) / each for at in minutes])
        decimals = max(0, -math.floor(math.log10(step) + 1e-9))
        axis.set_ticklabels([_angle(at, sides, digits, decimals) for at in minutes])
    axes.tick_params(labelsize=7, length=0)
    axes.grid(visible=True, color=FAINT, lw=0.5)
    axes.annotate(
        "N", (0.97, 0.97), (0.97, 0.87), xycoords="axes fraction", ha="center", va="center",
        fontsize=9, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.0},
    )  # fmt: skip


def _angle(minutes: float, sides: str, digits: int, decimals: int) -> str:
    """Return an angle in degrees and minutes.

    >>> _angle(-2031.4, "NS", 2, 1), _angle(10799.999, "EW", 3, 1), _angle(10801.0, "EW", 3, 0)
    ("33°51.4'S", "180°00.0'E", "179°59'W")
    """
    around = math.remainder(minutes, 21_600.0) if abs(minutes) > 10_800.0 else minutes
    whole, rest = divmod(round(abs(around) * 10**decimals), 60 * 10**decimals)
    width = 2 + (decimals > 0) + decimals
    side = sides[around < 0]
    return f"{whole:0{digits}d}°{rest / 10**decimals:0{width}.{decimals}f}'{side}"


def _scale(axes: Axes) -> None:
    """Draw a bar of a round length in the lower left corner."""
    left, right = axes.get_xlim()
    low, high = axes.get_ylim()
    most = SCALE * (right - left)
    power = 10.0 ** math.floor(math.log10(most))
    length = next(part * power for part in (5.0, 2.0, 1.0) if part * power <= most)
    x, y = left + 0.04 * (right - left), low + 0.05 * (high - low)
    axes.plot([x, x + length], [y, y], color=INK, lw=2.5, solid_capstyle="butt", zorder=7)
    axes.annotate(
        f"{length:,.4g} m", (x + length / 2, y), (0, 4), textcoords="offset points", ha="center",
        fontsize=7.5, bbox={"fc": "white", "ec": "none", "pad": 1.0, "alpha": 0.8}, zorder=7,
    )  # fmt: skip
