"""How far off the AUVs' estimates were, with and without fixes."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullFormatter

from ...support.arrays import Floats
from ...support.palette import FAINT, INK
from ..report.envelope import SIGMAS, error_envelope
from ..report.recording import Recording, recording
from .fixes import deliveries
from .style import (
    LARGEST_LEGEND,
    add_lines,
    by_vehicle,
    colour_of,
    legend_below,
    names,
    new_figure,
)

if TYPE_CHECKING:
    from ...core.results.result import Result


# More AUVs than this are drawn as a fleet: median and quantiles.
MOST_PANELS = 6

# Height (share of the axes) of the row of ticks that an AUV's fixes make
TICK_ROW = 0.035


def error(result: "Result", width: float) -> Figure:
    """Draw position errors over time: of each AUV, or of a large fleet as a whole."""
    if result.scenario.auvs.count > MOST_PANELS:
        return _fleet(result, width)
    auvs = names("AUV", result.scenario.auvs.count)
    figure = new_figure(width, 0.9 + len(auvs) * (1.15 if len(auvs) > 1 else 2.2))
    panels = figure.subplots(len(auvs), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    recorded = recording(result)
    for axes, name in zip(panels, auvs, strict=True):
        _draw_panel(axes, result, recorded, name)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(0, result.scenario.duration_s)
    panels[0].set_ylim(*_decades(result))
    panels[0].set_yscale("log")
    panels[0].yaxis.set_major_formatter(lambda metres, _: f"{metres:g}")
    panels[0].yaxis.set_minor_formatter(NullFormatter())
    panels[0].set_title(f"{result.scenario.name}, seed {result.seed}")
    figure.supylabel("horizontal position error (m)", fontsize=8)
    legend_below(
        figure,
        [
            Line2D([], [], color=INK, label="fused estimate"),
            Line2D([], [], color=INK, ls=":", label="dead reckoning only"),
            Line2D([], [], color="#777777", ls="--", lw=0.8, label="drift model, RMS, straight"),
            Patch(
                color=FAINT, label=f"bias left by the fixes + {SIGMAS:g} sigma of walk and fixes"
            ),
            Line2D([], [], color=INK, ls="", marker="|", ms=5, label="fix delivered"),
        ],
    )
    return figure


def _decades(result: "Result") -> tuple[float, float]:
    """Return the limits (m) of a logarithmic axis that shows fused errors and drift alike."""
    tracks = result.tables["tracks"]
    errors = tracks.position_error_m.to_numpy(float)
    known = errors[errors > 0.0]
    drift = np.nanmax(imu_errors(tracks))
    low = float(np.quantile(known, 0.05)) / 2 if len(known) else 0.01
    return low, max(2.5 * float(drift), 20 * low)


def _draw_panel(axes: Axes, result: "Result", recorded: Recording, name: str) -> None:
    track, colour = by_vehicle(result.tables["tracks"])[name], colour_of(name)
    times = track.time_s.to_numpy()
    bound = error_envelope(recorded, int(name[3:]))
    axes.fill_between(times, bound, color=FAINT, lw=0, label="envelope")
    auv = result.setup.auvs[int(name[3:])]
    sensors, speed = result.setup.sensors[auv.number], auv.speed_m_per_s
    model = [sensors.straight_drift_rms(t, speed) for t in times.tolist()]
    axes.plot(times, model, "--", color="#777777", lw=0.8, label="drift model")
    axes.plot(times, imu_errors(track), ":", color=colour, label="dead reckoning")
    axes.plot(times, track.position_error_m, color=colour, lw=0.9, label="fused")
    arrivals = deliveries(result, name)
    mark = np.full(len(arrivals), 1.0 - TICK_ROW)
    axes.plot(
        arrivals, mark, "|", color=colour, ms=4, mew=0.6, transform=axes.get_xaxis_transform(),
        label="fixes",
    )  # fmt: skip
    axes.text(0.01, 0.86, name, transform=axes.transAxes, color=colour, weight="bold", va="top")


def imu_errors(track: Any) -> Floats:
    """Return the horizontal error (m) of dead reckoning alone along tracks."""
    x, y = track.imu_x_m - track.x_m, track.imu_y_m - track.y_m
    return np.asarray(np.hypot(x, y))


def draw_errors(axes: Axes, result: "Result") -> None:
    """Draw the error of every AUV's estimate in one picture, its fixes as ticks on top."""
    tracks = by_vehicle(result.tables["tracks"])
    auvs = names("AUV", result.scenario.auvs.count)
    columns = ["time_s", "position_error_m"]
    lines = [tracks[name][columns].to_numpy(float) for name in auvs]
    add_lines(axes, lines, [colour_of(name) for name in auvs], linewidths=0.9)
    rows = len(auvs) if len(auvs) <= LARGEST_LEGEND else 0
    for row, name in enumerate(auvs[:rows]):
        arrivals = deliveries(result, name)
        axes.plot(
            arrivals, np.full(len(arrivals), 0.985 - TICK_ROW * row), "|", color=colour_of(name),
            ms=4, mew=0.6, transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    largest = max(float(line[:, 1].max()) for line in lines)
    top = max(largest, 1e-3) / (0.96 - TICK_ROW * rows)
    axes.set(xlim=(0, result.scenario.duration_s), ylim=(0, top))
    axes.set(xlabel="time (s)", ylabel="position error (m)")
    axes.set_title("horizontal |estimate - truth|" + ("; ticks: fixes delivered" if rows else ""))


def _fleet(result: "Result", width: float) -> Figure:
    """Draw the errors of a large fleet: median and 5 to 95 % of the AUVs at each instant."""
    tracks = by_vehicle(result.tables["tracks"])
    auvs = [tracks[name] for name in names("AUV", result.scenario.auvs.count)]
    times = auvs[0].time_s.to_numpy()
    figure = new_figure(width, 0.62 * width)
    axes = figure.add_subplot()
    handles: list[Artist] = []
    for errors, style, what in (
        (np.array([imu_errors(track) for track in auvs]), ":", "dead reckoning only"),
        (np.array([track.position_error_m for track in auvs]), "-", "fused estimate"),
    ):
        low, middle, high = np.quantile(errors, (0.05, 0.5, 0.95), axis=0)
        axes.fill_between(times, low, high, color=INK, alpha=0.15, lw=0)
        handles += axes.plot(times, middle, style, color=INK, label=what)
    axes.set(xlabel="time (s)", ylabel="horizontal position error (m)")
    axes.set(xlim=(0, result.scenario.duration_s))
    axes.set_ylim(bottom=0)
    axes.set_title(f"{result.scenario.name}: {len(auvs)} AUVs")
    handles.append(Patch(color=INK, alpha=0.15, lw=0, label="5 to 95 % of the AUVs"))
    legend_below(figure, handles)
    return figure
