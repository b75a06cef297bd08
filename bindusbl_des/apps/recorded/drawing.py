"""A replay as a figure: the tracks among the beacons, and what sights say of them."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.geometry.geodesy import east_north
from ...support.palette import ALARM, COLOURS, INK, PLANNED
from ..figures.style import TWO_COLUMNS, fit_labels, new_figure
from ..figures.trajectory import chart_axes, draw_closed
from .replaying import Replay

HEIGHT = 3.6
LOOKS = (
    ("dead reckoning", PLANNED, ":", 1.0),
    ("GTSAM, robust", INK, "-", 2.4),
    ("filter", COLOURS[1], "-", 0.8),
    ("smoother", COLOURS[0], "-", 0.8),
)


def drawn(replay: Replay) -> Figure:
    """Return a map of the tracks, and the residuals of sights over time."""
    figure = new_figure(TWO_COLUMNS, HEIGHT)
    plan, over_time = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
    _draw_plan(plan, replay)
    _draw_residuals(over_time, replay)
    figure.suptitle(replay.log.name)
    fit_labels(figure)
    return figure


def _draw_plan(axes: Axes, replay: Replay) -> None:
    """Draw the tracks, north up; in a frame of its file's own, which knows no north, x and y."""
    drawn = np.asarray if replay.log.start_found else east_north
    reference = None if replay.reference is None else replay.reference.places
    tracks = (replay.log.places, reference, replay.filter.places, replay.smoother.places)
    for (label, colour, style, width), places in zip(LOOKS, tracks, strict=True):
        if places is not None:
            axes.plot(*drawn(places).T, color=colour, ls=style, lw=width, label=label)
    beacons = replay.log.beacons
    stations = drawn(beacons.places[:, :2])
    axes.plot(*stations.T, "k^", ms=5, label="beacon")
    for name, place in zip(beacons.names, stations, strict=True):
        axes.annotate(name, (place[0], place[1]), (4, 4), textcoords="offset points")
    if replay.setup is not None and replay.offset_m is not None:
        draw_closed(axes, replay.setup, replay.offset_m)
    if replay.log.start_found:
        axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    else:
        chart_axes(axes)
    axes.legend(loc="best")


def _draw_residuals(axes: Axes, replay: Replay) -> None:
    """Draw residuals by the smoother; beyond the axis they are drawn at its edge."""
    log, seen = replay.log, replay.smoother.seen
    times = np.sort(np.concatenate((log.ranges.times, log.fixes.times)), kind="stable")
    off, is_outlier = seen["off_m"], seen["inlier"] < 0.5
    edge = 1.3 * float(np.percentile(np.abs(off), 99.0, method="lower"))
    edge = max(edge, 1e-3)  # of sights that fit exactly
    shown = np.clip(off, -edge, edge)
    for which, colour, label in (
        (~is_outlier, COLOURS[0], "sight"),
        (is_outlier, ALARM, "outlier"),
    ):
        axes.plot(times[which], shown[which], ".", ms=3, color=colour, label=label)
    if log.has_ranges:
        sd = replay.noise.range_sd
        axes.axhspan(-2.0 * sd, 2.0 * sd, color=PLANNED, alpha=0.25, lw=0, label="± 2 sd")
    unit = "time (s)" if log.has_clock else "way gone (s at the nominal speed)"
    axes.set(xlabel=unit, ylabel="measured less smoothed (m)", ylim=(-1.05 * edge, 1.05 * edge))
    axes.legend(loc="best")
