"""What of the survey is served: the chance of a fix, HF circles, corners, the loneliest point."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from ...core.geometry.coverage import covered_by_rings, is_within, loneliest_point
from ...core.geometry.formation import keep_station
from ...core.geometry.geodesy import east_north
from ...core.scenario.site import NoStations
from ...core.setup import Setup
from ...support.palette import ALARM, HF, INK
from ..preflight.fix_chance import fix_chance, survey_grid
from .style import LARGEST_LEGEND, legend_below, new_figure
from .trajectory import closed_handles, draw_survey, frame, heard_patches

if TYPE_CHECKING:
    from ...core.results.result import Result
    from ...core.scenario.scenario import Scenario

Points = Sequence[tuple[float, float]]

UNHEARD = "#f6d9cf"

# The survey is shaded by so many cells along each side.
CELLS = 96


def coverage(result: "Result", width: float) -> Figure:
    """Draw the coverage of a survey and, where recorded, the pings that no ASV could hear.

    With passive ranging pings are of ASVs: where these are not heard says nothing of the coverage.
    """
    unheard = None
    if "pings" in result.arrow and not result.scenario.protocol.asvs_ping:
        pings = result.tables["pings"]
        unheard = pings.loc[pings.in_range_of == 0, ["x_m", "y_m"]].to_numpy(float)
    return coverage_figure(result.setup, width, unheard, _stations(result))


def without_stations(result: "Result") -> str:
    """Return why there is no coverage to be drawn: ASVs move, or there is none; "" where they
    keep stations.
    """
    if not result.scenario.asvs.count:
        return "there is no ASV"
    try:
        _ = _stations(result) or result.setup.stations_m
    except ValueError as error:
        return str(error)
    return ""


def _stations(result: "Result") -> "Points | None":
    """Return where a user-defined placement, which is not asked again, has put the ASVs."""
    if not result.scenario.asvs.formation.choice.is_own:
        return None
    if "tracks" not in result.arrow:
        raise ValueError(
            "where ASVs lay is not kept with record.detail: summary, and the placement of "
            "somebody's own is not asked again; run it with full"
        )
    tracks = result.tables["tracks"]
    own = tracks[tracks.vehicle.str.startswith("ASV")].groupby("vehicle", sort=False)
    tracks_m = [track[["x_m", "y_m"]].to_numpy(float) for _, track in own]
    if not keep_station(tracks_m, result.scenario.acoustics.hf.range_m):
        raise NoStations(str(result.scenario.asvs.formation.choice))
    return [(float(x), float(y)) for x, y in (way[0] for way in tracks_m)]


def coverage_figure(
    setup: Setup,
    width: float,
    unheard: np.ndarray | None = None,
    known: "Points | None" = None,
) -> Figure:
    """Draw the coverage of a scenario; `unheard` (n, 2) are places of pings out of all ranges,
    `known` (m, 2) the places of its ASVs where they need not be asked for.
    """
    scenario = setup.scenario
    figure = new_figure(width, width + 0.95)
    axes = figure.add_subplot()
    stations, reach = known or setup.stations_m, setup.horizontal_reach_m
    covered = covered_by_rings(setup.area, stations, [(0.0, reach)], setup.land)
    chance = _draw_chance(axes, setup, stations)
    _draw_area(axes, setup, stations, reach, plain=chance is None)
    handles: list[Artist] = [
        Patch(fc=HF, alpha=0.25, label=f"heard: {100 * covered:.1f} % of the survey"),
        Patch(fc=UNHEARD, label="heard by no ASV"),
    ]
    if chance is not None:
        handles = [Line2D([], [], color=INK, lw=0.7, ls="--", label=_ring_label(scenario, covered))]
        bar = figure.colorbar(chance, ax=axes, fraction=0.046, pad=0.03)
        bar.set_label("chance that a ping makes a fix which is delivered (1)")
    handles += closed_handles(setup)
    handles.append(_draw_corners(axes, setup, stations))
    handles.append(_draw_loneliest(axes, setup, stations, reach))
    if unheard is not None:
        label = f"pings in nobody's range: {len(unheard)}"
        handles += axes.plot(
            *east_north(unheard).T, label=label, marker=".", ls="", ms=3.0, color=ALARM
        )
    frame(axes, setup, np.array(stations), 1.2)
    axes.set_title(f"{scenario.name}: HF range {scenario.acoustics.hf.range_m:g} m "
                             f"({scenario.acoustics.hf.range_metric})")  # fmt: skip
    legend_below(figure, handles)
    return figure


def _ring_label(scenario: "Scenario", covered: float) -> str:
    """Tell what the dashed circles are, and what of the survey they cover."""
    if scenario.acoustics.hf.traits.ends_at_range:
        return f"HF range: {100 * covered:.1f} % of the survey"
    return f"HF range that the protocol plans with ({100 * covered:.1f} % of the survey)"


def _draw_chance(axes: Axes, setup: Setup, stations: Points) -> AxesImage | None:
    """Shade the survey by the chance of a fix; None where a user-defined channel decides it."""
    grid = survey_grid(setup, CELLS)
    chance = fix_chance(setup, stations, grid.middles)
    if chance is None:
        return None
    south, west, north, east = grid.box
    shaded = axes.imshow(
        chance.reshape(-1, grid.across).T, vmin=0.0, vmax=1.0, cmap="cividis", alpha=0.75, zorder=0,
        extent=(west, east, south, north), origin="lower",
    )  # fmt: skip
    outline = east_north(setup.area.outline)
    shaded.set_clip_path(Polygon(outline, transform=axes.transData))
    return shaded


def _draw_area(axes: Axes, setup: Setup, stations: Points, reach: float, *, plain: bool) -> None:
    """Draw survey, ASVs and HF circles; `plain` with what these cover, on the ground of nothing."""
    draw_survey(axes, setup, ground=UNHEARD if plain else "none")
    places, circles = east_north(stations), heard_patches(setup, stations, reach)
    if plain:
        under = PatchCollection(circles, fc="white", lw=0, zorder=1)
        axes.add_collection(under)
        under.set_clip_path(Polygon(east_north(setup.area.outline), transform=axes.transData))
        axes.add_collection(PatchCollection(circles, fc=HF, alpha=0.25, lw=0, zorder=2))
    edge: Any = {
        "fc": "none",
        "ec": HF if plain else INK,
        "lw": 0.7,
        "ls": "--",
        "label": "HF range",
    }
    axes.add_collection(PatchCollection(circles, zorder=2, **edge))
    for number, place in enumerate(places if len(places) <= LARGEST_LEGEND else ()):
        axes.annotate(f"ASV{number}", tuple(place), (4, 4), textcoords="offset points")
    axes.scatter(places[:, 0], places[:, 1], s=60, c="k", marker="*", zorder=5, label="ASV")


def _draw_corners(axes: Axes, setup: Setup, stations: Points) -> Artist:
    """Join each corner to its nearest ASV and say how far that is."""
    places, middle = east_north(stations), east_north(setup.area.centroid)
    corners = np.array(setup.area.outline)
    if setup.closed is not None:  # which corners may lie in
        corners = corners[~setup.closed.holds(corners)]
    for corner in east_north(corners):
        x, y = np.where(corner < middle, -1, 1)
        distances = np.hypot(*(places - corner).T)
        nearest = places[distances.argmin()]
        axes.plot(*zip(corner, nearest, strict=True), "-", color=INK, lw=0.6, label="corner")
        axes.annotate(
            f"{distances.min():.1f} m", tuple(corner), (3 * x, 5 * y), textcoords="offset points",
            ha="left" if x < 0 else "right", va="bottom" if y > 0 else "top", fontsize=7,
        )  # fmt: skip
    return Line2D([], [], color=INK, lw=0.6, label="corner to nearest ASV")


def _draw_loneliest(axes: Axes, setup: Setup, stations: Points, reach: float) -> Artist:
    """Mark the point farthest from all ASVs: its distance is the covering radius."""
    x, y = loneliest_point(setup.area, stations)
    radius = min(float(np.hypot(x - a, y - b)) for a, b in stations)
    verdict = "within" if is_within(radius, reach) else "beyond"
    axes.plot([y], [x], "D", color=ALARM, ms=5, mfc="none", label="loneliest")
    label = f"loneliest point: {radius:.1f} m, {verdict} range"
    return Line2D([], [], color=ALARM, ls="", marker="D", mfc="none", ms=5, label=label)
