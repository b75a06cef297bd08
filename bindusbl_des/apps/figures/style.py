"""One style for all figures: colours, sizes and type that suit a paper of one or two columns."""

import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator

from ...support.files import draft_of
from ...support.palette import COLOURS

# Width (in) of a figure over one and over two columns of a paper (IEEE)
ONE_COLUMN, TWO_COLUMNS = 3.5, 7.16

# Widths (in) at which a figure still shows something, and fits into memory
NARROWEST, WIDEST = 1.0, 50.0

FORMATS = ("png", "svg", "pdf")

# Resolution (dots/in) at which notebooks show figures
SCREEN_DPI = 144

# With more AUVs than this a legend entry for each hides the figure.
LARGEST_LEGEND = 10

STYLE: Any = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "figure.titlesize": 9,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.linewidth": 0.4,
    "grid.alpha": 0.5,
    "grid.color": "#c8c8c8",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "legend.title_fontsize": 7,
    "legend.handlelength": 1.8,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,  # journals want type that can be searched
    "svg.fonttype": "none",  # text stays text: searched, edited, in the type of the paper
    "svg.hashsalt": "bindusbl-des",  # the same figure, the same bytes
}

# Dates would make equal figures differ.
METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
    "png": {},
}


def styled() -> AbstractContextManager[None]:
    """Return the context in which figures are made and saved; it leaves no trace behind."""
    return matplotlib.rc_context(STYLE)


class Drawing(Figure):
    """A figure that notebooks show, with or without pyplot."""

    def _repr_png_(self) -> bytes:
        with styled():
            self.savefig(drawn := BytesIO(), format="png", dpi=SCREEN_DPI)
        return drawn.getvalue()


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure (in) that finds room for its labels by itself."""
    return Drawing(figsize=(width, height), layout="constrained")


def finished(draw: Callable[[float], Figure], width: float, path: str | Path | None) -> Figure:
    """Return a figure of this width (in) in the house style; also write it to `path`, if given.

    Raises:
        ValueError: when the width or the ending of `path` is not supported.
        OSError: when it cannot be written.
    """
    if not NARROWEST <= width <= WIDEST:
        raise ValueError(f"a figure is {NARROWEST:g} to {WIDEST:g} inches wide; got {width:g}")
    if path is not None and Path(path).suffix[1:].lower() not in FORMATS:
        raise ValueError(f"{path}: a figure is a file that ends in .{', .'.join(FORMATS)}")
    with styled():
        figure = draw(width)
        fit_labels(figure)
        if path is not None:
            save(figure, Path(path))
    return figure


def fits(text: str, axes: Axes, length: float, size: float) -> bool:
    """Tell whether a text of some size (pt) has room along a length on the x axis."""
    left, right = axes.get_xlim()
    width = axes.figure.get_figwidth()  # type: ignore[union-attr]  # no figure in a figure
    room = width * 72 * 0.85 * length / (right - left)
    return len(text) * 0.5 * size < room


def save(figure: Figure, path: Path, *, replace: bool = True, **options: Any) -> None:
    """Write a figure in the format that its name ends in, whole or not at all.

    Raises:
        FileExistsError: when the file is there, and not to be replaced.
        OSError: when it cannot be written.
    """
    kind = path.suffix[1:].lower()
    with draft_of(path, replace=replace) as draft:
        figure.savefig(draft, format=kind, metadata=METADATA[kind], **options)


def without_titles(figure: Figure) -> Figure:
    """Return a figure whose titles are gone: where it stands it has a caption."""
    for axes in figure.axes:
        axes.set_title("")
    figure.suptitle("").set_in_layout(False)
    return figure


def colour_of(vehicle: str) -> str:
    """Return the colour of a vehicle, the same in all figures.

    >>> colour_of("AUV1") == colour_of("AUV9")
    True
    """
    return COLOURS[int(vehicle[3:]) % len(COLOURS)]


def names(kind: str, count: int) -> list[str]:
    """Return the names of a fleet.

    >>> names("AUV", 2)
    ['AUV0', 'AUV1']
    """
    return [f"{kind}{index}" for index in range(count)]


def by_vehicle(tracks: Any) -> dict[str, Any]:
    """Return the track of each vehicle, AUVs first."""
    return {str(name): track for name, track in tracks.groupby("vehicle", sort=False)}


def add_lines(axes: Axes, lines: Sequence[Any], colours: Sequence[str], **looks: Any) -> None:
    """Draw many lines, each of shape (n, 2), as one artist."""
    axes.add_collection(LineCollection(lines, colors=colours, **looks))


def count_from_zero(axes: Axes, most: float) -> None:
    """Let an axis of counts begin at zero and show whole numbers only."""
    axes.set_ylim(0, max(1.05 * most, 1.0))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=8, integer=True))


def vehicle_handles(vehicles: Iterable[str]) -> list[Artist]:
    """Return a legend entry for each vehicle, or none where they would be too many."""
    shown = list(vehicles)
    if len(shown) > LARGEST_LEGEND:
        return []
    return [Line2D([], [], color=colour_of(name), lw=2, label=name) for name in shown]


def legend_below(figure: Figure, handles: Sequence[Artist]) -> int:
    """Put a legend under the axes, in as many columns as the width holds; return its lines."""
    room = int((figure.get_figwidth() * 72 - 40) / 4)
    for handle in handles:
        handle.set_label(broken(str(handle.get_label()), room, ENTRY_LINES))
    labels = [str(handle.get_label()).split("\n") for handle in handles]
    longest = max((len(line) for lines in labels for line in lines), default=1)
    widest = max(1, int(figure.get_figwidth() * 72 / (3.7 * longest + 30)))
    columns = min(len(handles), widest)
    if not columns:
        return 0
    figure.legend(handles=list(handles), loc="outside lower center", ncols=columns)
    return -(-len(handles) // columns) * max(map(len, labels))


# Width of a letter, on average, as a share of its size (pt); and where names may be parted
LETTER, PARTS = 0.6, re.compile(r"(?<=[\s_:/,;=-])")

# Lines that an entry of a legend, a title, and each line of an axis' label, may become
ENTRY_LINES, MOST_LINES = 2, 3

# So much of the figure's length a text may take, and of its height axes have at least
FILLED, LEAST_SPAN, MOST_FITTINGS = 0.98, 0.4, 3


def letters_in(length: float, size: float) -> int:
    """Return how many letters of some size (pt) have room on a length (in)."""
    return max(int(72 * length / (LETTER * size)), 1)


def in_lines(text: str, longest: int) -> list[str]:
    """Return a text in lines no longer than that, parted where words or names are; what has no such
    place is parted anywhere.

    >>> in_lines("my_parts:WeighingOfAll", 12), in_lines("abcdef", 4)
    (['my_parts:', 'WeighingOfAl', 'l'], ['abcd', 'ef'])
    """
    lines = [""]
    for part in PARTS.split(text):
        if len(lines[-1]) + len(part.rstrip()) > longest and lines[-1]:
            lines.append("")
        lines[-1] += part
        while len(lines[-1].rstrip()) > longest:
            lines[-1:] = lines[-1][:longest], lines[-1][longest:]
    return [line.rstrip() for line in lines]


def has_room(text: str, longest: int, most: int) -> bool:
    """Tell whether a text has room in so many lines, parted where words or names are."""
    words = PARTS.split(text)
    return len(in_lines(text, longest)) <= most and max(map(len, map(str.rstrip, words))) <= longest


def broken(text: str, longest: int, most: int) -> str:
    """Return a text in at most so many lines; one that is longer loses its middle.

    >>> broken("mean position error (m)", 14, 2), broken("recovery_of_three_vehicles", 8, 2)
    ('mean position\\nerror (m)', 'recover…\\nvehicles')
    """
    lines = in_lines(text, longest)
    if len(lines) > most:  # the end says what is shown of whatever has the name
        head, tail = lines[: most // 2], lines[-(most - most // 2) :]
        head[-1] = f"{head[-1][: longest - 1]}…"
        lines = [*head, *tail]
    return "\n".join(lines)


def fit_labels(figure: Figure) -> None:
    """Break long titles and axis labels into lines; enlarge the figure if its axes get too low."""
    of_axes = [
        text for axes in figure.axes for text in (axes.title, axes.xaxis.label, axes.yaxis.label)
    ]
    whole = {text: text.get_text().split("\n") for text in of_axes + figure.texts}
    figure.draw_without_rendering()
    for _ in range(MOST_FITTINGS):  # what has more lines moves the others
        longest = {text: _longest(text, figure) for text in whole}
        if not any(longest.values()):
            break
        for text, room in longest.items():
            if room:
                text.set_text("\n".join(broken(line, room, MOST_LINES) for line in whole[text]))
        figure.draw_without_rendering()
    boxes = [axes.get_position() for axes in figure.axes]
    span = max(box.y1 for box in boxes) - min(box.y0 for box in boxes)
    if span < LEAST_SPAN:
        figure.set_figheight(figure.get_figheight() * (1 + LEAST_SPAN - span))


def _longest(text: Text, figure: Figure) -> int:
    """Return how many letters lines of a text may have where it was drawn; 0: as many as it has."""
    box, is_upright = text.get_window_extent(), text.get_rotation() == 90
    begin, end = (box.y0, box.y1) if is_upright else (box.x0, box.x1)
    whole = figure.bbox.height if is_upright else figure.bbox.width
    room = FILLED * min(begin + end, 2 * whole - begin - end)
    if end - begin <= room:
        return 0
    letters = max(map(len, text.get_text().split("\n")))
    return max(int(letters * room / (end - begin)), 1)
