"""Figures of results, drawn from their tables."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .launch import planned_path

if TYPE_CHECKING:
    from .result import Result

# Okabe-Ito colours: distinguishable with every kind of colour vision
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
PLANNED, HF, MF = "#9a9a9a", "#0072B2", "#E69F00"

# With more AUVs than this a legend entry for each hides the map.
LARGEST_LEGEND = 10

# Points at which a planned path is drawn
PLAN_POINTS = 2000


def save_mission_figure(result: "Result", path: Path) -> None:
    """Draw a mission: the map, and below each other error over time and cumulative fixes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 6.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.05, 1))
    draw_map(figure.add_subplot(grid[:, 0]), result)
    error = figure.add_subplot(grid[0, 1])
    draw_error(error, result)
    draw_fixes(figure.add_subplot(grid[1, 1], sharex=error), result)
    scenario = result.scenario
    figure.suptitle(
        f"{scenario.name}: {scenario.auvs.count} AUVs, {scenario.asvs.count} ASVs, "
        f"L = {scenario.survey.side_m:g} m, seed {result.seed}"
    )
    figure.savefig(path, dpi=110)


def _colour(index: int) -> str:
    return COLOURS[index % len(COLOURS)]


def draw_map(axes: Any, result: "Result") -> None:
    """Draw planned, true, fused and IMU-only paths, ASVs and their HF and MF ranges."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, Rectangle

    scenario, tracks = result.scenario, result.tables["tracks"]
    side = scenario.survey.side_m
    axes.add_patch(Rectangle((-side / 2, -side / 2), side, side, fill=False, lw=1, color="0.3"))
    names = _auv_names(tracks)
    for index, name in enumerate(names):
        track, colour = tracks[tracks.vehicle == name], _colour(index)
        if scenario.auvs.route.kind in ("lawnmower", "waypoints"):
            path = planned_path(scenario, index)
            plan = path.sample(np.linspace(0.0, path.length, PLAN_POINTS))
            axes.plot(plan[:, 0], plan[:, 1], "-", color=PLANNED, lw=0.7, zorder=1)
        axes.plot(track.imu_x_m, track.imu_y_m, ":", color=colour, lw=1.1, alpha=0.8)
        axes.plot(track.x_m, track.y_m, "-", color=colour, lw=2.6, alpha=0.35)
        axes.plot(track.estimate_x_m, track.estimate_y_m, "-", color=colour, lw=0.9)
        axes.plot(track.x_m.iloc[:1], track.y_m.iloc[:1], "o", color=colour, ms=6, zorder=4)
    stations = tracks[tracks.vehicle.str.startswith("ASV")].groupby("vehicle", sort=False).first()
    for label, station in stations.iterrows():
        for reach, colour, style in (
            (scenario.acoustics.hf.range_m, HF, "--"),
            (scenario.acoustics.mf.range_m, MF, ":"),
        ):
            axes.add_patch(
                Circle(
                    (station.x_m, station.y_m), reach, fill=False, color=colour, ls=style, lw=0.9
                )
            )
        axes.plot(station.x_m, station.y_m, "*", color="k", ms=12, zorder=5)
        if len(stations) <= LARGEST_LEGEND:
            axes.annotate(
                str(label), (station.x_m, station.y_m), (6, 6), textcoords="offset points"
            )
    reach = 1.05 * max(side / 2, *(np.abs(stations[["x_m", "y_m"]].to_numpy()).ravel()), 1.0)
    shown = tracks[["x_m", "y_m", "estimate_x_m", "estimate_y_m"]].abs().max().max()
    limit = max(reach + 0.1 * side, 1.05 * float(shown))
    axes.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
    axes.set(xlabel="x along the lanes (m)", ylabel="y across the lanes (m)")
    grey = "0.25"
    handles = [
        Line2D([], [], color=PLANNED, lw=0.7, label="planned path"),
        Line2D([], [], color=grey, lw=2.6, alpha=0.35, label="true path"),
        Line2D([], [], color=grey, lw=0.9, label="fused estimate"),
        Line2D([], [], color=grey, ls=":", label="dead reckoning only"),
        Line2D([], [], color=HF, ls="--", label="HF range"),
        Line2D([], [], color=MF, ls=":", label="MF range"),
    ]
    if len(names) <= LARGEST_LEGEND:
        handles += [Line2D([], [], color=_colour(i), lw=3, label=n) for i, n in enumerate(names)]
    axes.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=4, fontsize=8
    )


def draw_error(axes: Any, result: "Result") -> None:
    """Draw each AUV's position error over time, delivered fixes as marks."""
    tracks, fixes = result.tables["tracks"], result.tables["fixes"]
    for index, name in enumerate(_auv_names(tracks)):
        track, colour = tracks[tracks.vehicle == name], _colour(index)
        axes.plot(track.time_s, track.position_error_m, color=colour, lw=1, label=name)
        mine = fixes[(fixes.auv == name) & (fixes.outcome == "delivered")]
        axes.plot(
            mine.delivered_at_s,
            np.full(len(mine), -0.03 * (index + 1)),
            "|",
            color=colour,
            ms=5,
            transform=axes.get_xaxis_transform(),
            clip_on=False,
        )
    axes.set(ylabel="position error (m)", ylim=(0, None))
    axes.tick_params(labelbottom=False, bottom=False)
    axes.grid(alpha=0.25)
    axes.set_title("Horizontal |estimate - truth|; ticks below: delivered fixes", fontsize=9)


def draw_fixes(axes: Any, result: "Result") -> None:
    """Draw each AUV's cumulative count of delivered fixes."""
    tracks, fixes = result.tables["tracks"], result.tables["fixes"]
    for index, name in enumerate(_auv_names(tracks)):
        mine = fixes[(fixes.auv == name) & (fixes.outcome == "delivered")]
        arrivals = np.sort(mine.delivered_at_s.to_numpy())
        times = np.concatenate(([0.0], arrivals, [result.scenario.duration_s]))
        count = np.concatenate((np.arange(len(times) - 1), [len(times) - 2]))
        axes.step(times, count, where="post", color=_colour(index), lw=1.4, label=name)
    axes.set(xlabel="time (s)", ylabel="delivered fixes", xlim=(0, result.scenario.duration_s))
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.25)


def _auv_names(tracks: Any) -> list[str]:
    return [name for name in tracks.vehicle.unique() if name.startswith("AUV")]
