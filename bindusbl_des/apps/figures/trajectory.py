"""The map of a mission: where the AUVs were, where they thought they were, and who heard them."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch, Polygon
from matplotlib.path import Path

from ...core.geometry.geodesy import east_north
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.palette import DEPTH, HF, INK, LAND, MF, PLANNED, SHORE
from .style import (
    LARGEST_LEGEND,
    add_lines,
    by_vehicle,
    colour_of,
    legend_below,
    new_figure,
    vehicle_handles,
)

if TYPE_CHECKING:
    from ...core.geometry.land import Land
    from ...core.results.result import Result


# Points at which a planned path is drawn
PLAN_POINTS = 1000


def trajectory(result: "Result", width: float) -> Figure:
    """Draw the map of a mission with its legend."""
    handles = map_handles(result.setup)
    rows = -(-len(handles) // max(1, int(width * 72 / 110)))
    figure = new_figure(width, width + 0.25 + 0.16 * rows)
    axes = figure.add_subplot()
    draw_map(axes, result)
    axes.set_title(f"{result.scenario.name}, seed {result.seed}")
    legend_below(figure, handles)
    return figure


def draw_map(axes: Axes, result: "Result") -> None:
    """Draw planned, true, fused and IMU-only paths, ASVs and their HF and MF ranges."""
    setup, tracks = result.setup, by_vehicle(result.tables["tracks"])
    draw_survey(axes, setup)
    auvs = {name: track for name, track in tracks.items() if name.startswith("AUV")}
    plans = _plans(setup)
    add_lines(axes, plans, [PLANNED] * len(plans), linewidths=0.6, label="planned")
    colours = [colour_of(name) for name in auvs]
    for label, columns, looks in (
        ("dead reckoning", ["imu_x_m", "imu_y_m"], {"linestyles": ":", "linewidths": 1.0}),
        ("true", ["x_m", "y_m"], {"linewidths": 2.6, "alpha": 0.35}),
        ("fused", ["estimate_x_m", "estimate_y_m"], {"linewidths": 0.8}),
    ):
        lines = [east_north(track[columns]) for track in auvs.values()]
        add_lines(axes, lines, colours, label=label, **looks)
    starts = np.array([east_north(track[["x_m", "y_m"]])[0] for track in auvs.values()])
    axes.scatter(starts[:, 0], starts[:, 1], s=18, c=colours, zorder=4, label="start")
    stations = {name: track for name, track in tracks.items() if name.startswith("ASV")}
    _draw_asvs(axes, setup, stations)
    columns = ["x_m", "y_m", "estimate_x_m", "estimate_y_m"]
    places = [track[columns].to_numpy(float).reshape(-1, 2) for track in tracks.values()]
    frame(axes, setup, np.concatenate(places), 1.15)


def _plans(setup: Setup) -> list[Any]:
    """Return the planned paths (n, 2), east and north, none of AUVs that hold or repeat a track."""
    return [
        east_north(plan.path.sample(np.linspace(0.0, plan.path.length, PLAN_POINTS))[:, :2])
        for plan in setup.plans_that_ship
        if plan is not None
    ]


def _draw_asvs(axes: Axes, setup: Setup, asvs: dict[str, Any]) -> None:
    reaches = (
        (setup.horizontal_reach_m, HF, "--", "HF range"),
        (setup.horizontal_mf_reach_m, MF, ":", "MF range"),
    )
    paths = {name: east_north(track[["x_m", "y_m"]]) for name, track in asvs.items()}
    add_lines(axes, list(paths.values()), ["k"] * len(paths), linewidths=0.6, label="ASV track")
    starts = np.array([path[0] for path in paths.values()]).reshape(-1, 2)
    for reach, colour, style, label in reaches:
        heard = heard_patches(setup, starts[:, ::-1], reach)
        axes.add_collection(
            PatchCollection(heard, fc="none", ec=colour, ls=style, lw=0.7, label=label)
        )
    for name, (x, y) in zip(paths, starts.tolist(), strict=True):
        if len(paths) <= LARGEST_LEGEND:
            axes.annotate(name, (x, y), (4, 4), textcoords="offset points", clip_on=True)
    axes.scatter(starts[:, 0], starts[:, 1], s=60, c="k", marker="*", zorder=5, label="ASV")


def draw_survey(axes: Axes, setup: Setup, width: float = 0.8, ground: str = "none") -> None:
    """Draw the outline of a survey on its ground, land, and water where nobody goes."""
    outline = east_north(setup.area.outline)
    _draw_bottom(axes, setup)
    axes.add_patch(Polygon(outline, fc=ground, ec=INK, lw=width, zorder=0.5, label="survey"))
    draw_closed(axes, setup)


def draw_closed(axes: Axes, setup: Setup, middle: tuple[float, float] = (0.0, 0.0)) -> None:
    """Draw land, and water where nobody goes, about a place of the survey (m)."""
    for shown, name, looks in _closed(setup):
        for rings in shown.outlines:
            around = [np.subtract((*ring, ring[0]), middle) for ring in rings]
            closed = [Path(east_north(ring), closed=True) for ring in around]
            shape = PathPatch(Path.make_compound_path(*closed), zorder=1.5, label=name, **looks)
            axes.add_patch(shape)


def _draw_bottom(axes: Axes, setup: Setup) -> None:
    """Draw lines of equal depth of the bottom, with their depth (m) where each is longest."""
    for depth, lines in setup.contours:
        shown = [east_north(line) for line in lines]
        add_lines(axes, shown, [DEPTH] * len(shown), linewidths=0.5, zorder=0.4)
        if shown:
            x, y = max(shown, key=len)[len(max(shown, key=len)) // 2]
            axes.annotate(
                f"{depth:g} m", (x, y), ha="center", va="center", fontsize=6, color=DEPTH,
                clip_on=True, zorder=0.4,
            )  # fmt: skip


def closed_handles(setup: Setup) -> list[Artist]:
    """Return the legend of land, and of water where nobody goes; none without any."""
    return [Patch(label=name, **looks) for _, name, looks in _closed(setup)]


def _closed(setup: Setup) -> Iterator[tuple["Land", str, dict[str, Any]]]:
    """Yield what is closed, how it is called, and its looks, the lower first."""
    if setup.keep_out is not None:
        hatched = {"fc": "none", "ec": INK, "hatch": "\\\\\\\\", "ls": "--", "lw": 0.7}
        yield setup.keep_out, "nobody goes here", hatched
    if setup.land is not None:
        yield setup.land, "land", {"fc": LAND, "ec": SHORE, "lw": 0.8}


def heard_patches(setup: Setup, places: Any, reach: float) -> list[Patch]:
    """Return what a vessel at each place (n, 2), x and y in m, hears as far as a reach (m): a
    circle, less what land hides; nothing of one on land.
    """
    if setup.land is None:
        return [Circle(place, reach) for place in east_north(places).tolist()]
    seen = (setup.land.seen((x, y), reach) for x, y in np.asarray(places).tolist())
    return [Polygon(east_north(corners)) for corners in seen if len(corners)]


def frame(axes: Axes, setup: Setup, places: Floats, margin: float) -> None:
    """Show the survey, `margin` times as large, and places (n, 2), x and y in m, NaN for none, on
    a map with the current; ranges may leave the picture.
    """
    box, water = setup.area.box, setup.scenario.environment
    middle = np.array([box.x_min + box.x_max, box.y_min + box.y_max]) / 2
    half = max(box.x_max - box.x_min, box.y_max - box.y_min) / 2
    limit = max(margin * half, 1.1 * float(np.nanmax(np.abs(places - middle))))
    (left, right), (low, high) = ((at - limit, at + limit) for at in east_north(middle))
    axes.set(xlim=(left, right), ylim=(low, high))
    chart_axes(axes)
    axes.grid(visible=False)
    if water.current_m_per_s:
        words = f"current\n{water.current_m_per_s:g} m/s"
        _arrow(axes, math.radians(water.current_direction_deg), 0.83, HF)
        _write(axes, words, (0.985, 0.785), HF, ha="right")


def chart_axes(axes: Axes) -> None:
    """Make axes those of a map, with an arrow to the north."""
    axes.set(xlabel="east (m)", ylabel="north (m)", aspect="equal")
    _write(axes, "N", (0.965, 0.985), INK, ha="center")
    _arrow(axes, 0.0, 0.915, INK)


def _arrow(axes: Axes, heading: float, height: float, colour: str) -> None:
    """Draw an arrow along a heading (rad) at the right edge, at a height (share of the axes)."""
    right, up = (0.035 * math.sin(heading), 0.035 * math.cos(heading))
    axes.annotate(
        "", (0.965 + right, height + up), (0.965 - right, height - up), xycoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.0, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip


def _write(axes: Axes, text: str, top: tuple[float, float], colour: str, ha: str) -> None:
    """Write below a place (shares of the axes)."""
    axes.text(
        *top, text, transform=axes.transAxes, ha=ha, va="top", color=colour,
        bbox={"fc": "w", "lw": 0, "alpha": 0.7, "pad": 0.5},
    )  # fmt: skip


def map_handles(setup: Setup) -> list[Artist]:
    """Return the legend of the map: kinds of line, ASVs and their ranges, AUVs."""
    scenario = setup.scenario
    line, asvs = ("-", "ASV and its track") if scenario.asvs.formation.moves else ("", "ASV")
    handles: list[Artist] = [
        Line2D([], [], color=PLANNED, lw=0.6, label="planned path"),
        Line2D([], [], color=INK, lw=2.6, alpha=0.35, label="true path"),
        Line2D([], [], color=INK, lw=0.8, label="fused estimate"),
        Line2D([], [], color=INK, ls=":", label="dead reckoning only"),
        Line2D([], [], color="k", lw=0.6, ls=line, marker="*", ms=8, label=asvs),
        Line2D([], [], color=HF, ls="--", lw=0.7, label="HF range"),
        Line2D([], [], color=MF, ls=":", lw=0.7, label="MF range"),
    ]
    if not any(wing.asked.is_flown for wing in setup.wings):
        handles = handles[1:]
    handles += closed_handles(setup)
    return handles + vehicle_handles(f"AUV{i}" for i in range(scenario.auvs.count))
