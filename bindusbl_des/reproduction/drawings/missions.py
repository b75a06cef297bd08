"""Single missions: maps, errors and fixes over time."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ...campaigns.storage.parts import read_table
from ...campaigns.storage.soundness import TABLES
from ...figures.error import draw_errors
from ...figures.style import TWO_COLUMNS, colour_of, legend_below, new_figure, vehicle_handles
from ...figures.trajectory import draw_map, map_handles
from ...results.result import Result
from ..published import published

if TYPE_CHECKING:
    import pandas as pd

    from ...campaigns.campaign import Campaign
    from ..experiments.running import Runs

Array = NDArray[np.float64]
AUVS = ("AUV0", "AUV1", "AUV2")


def result_of(campaign: "Campaign", number: int) -> Result:
    """Return one mission of a campaign as the result of a run.

    Raises:
        LookupError: when the campaign kept no events.
    """
    mission = campaign.plan.mission(number)
    tables = {}
    for name in TABLES:
        rows = read_table(campaign.folder, name)
        if rows is not None and name != "missions":
            tables[name] = rows.take(np.flatnonzero(rows["mission"].to_numpy() == number))
    if "tracks" not in tables:
        raise LookupError(f"{campaign.folder} holds no tracks; its experiment needs detail: full")
    return Result(campaign.plan.experiment.scenario(mission.point), mission.seed, tables, 1.0)


def baseline(runs: "Runs") -> Figure:
    """Draw the map of a baseline mission and its errors."""
    result = result_of(runs["baseline"], 0)
    figure = new_figure(TWO_COLUMNS, 3.9)
    axes = figure.subplots(1, 2, width_ratios=(1, 1.1))
    draw_map(axes[0], result)
    axes[0].set_title(f"L = {result.scenario.survey.side_m:.0f} m, one AUV per second in turn")
    draw_errors(axes[1], result)
    legend_below(figure, map_handles(result.scenario))
    return figure


def failure_and_recovery(runs: "Runs") -> Figure:
    """Draw the maps of one ASV and of three side by side."""
    figure = new_figure(TWO_COLUMNS, 4.35)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, asvs in zip(axes, (1, 3), strict=True):
        number = next(_numbers(runs["trajectories"], asvs, "world"))
        result = result_of(runs["trajectories"], number)
        draw_map(ax, result)
        ax.set(xlim=(-106, 106), ylim=(-106, 106))
        ax.set_title(f"{asvs} ASV{'s' * (asvs > 1)}, bias in the world frame")
    axes[1].set_ylabel("")
    legend_below(figure, map_handles(result.scenario))
    return figure


def _numbers(campaign: "Campaign", asvs: int, frame: str) -> Iterator[int]:
    """Yield the missions of a case, seed after seed."""
    for number in range(len(campaign.plan)):
        varied = campaign.plan.points[campaign.plan.mission(number).point].varied
        if varied["asvs.count"] == asvs and varied["navigation.bias_frame"] == frame:
            yield number


def errors_and_fixes(runs: "Runs") -> Figure:
    """Draw errors in both frames and cumulative fixes, one ASV above, three below."""
    campaign = runs["trajectories"]
    tracks = read_table(campaign.folder, "tracks").to_pandas()  # type: ignore[union-attr]
    fixes = read_table(campaign.folder, "fixes").to_pandas()  # type: ignore[union-attr]
    figure = new_figure(TWO_COLUMNS, 4.3)
    grid = figure.subplots(2, 3, sharex=True)
    for row, asvs in zip(grid, (1, 3), strict=True):
        for axes, frame in zip(row, ("body", "world"), strict=False):
            mine = tracks[tracks.mission.isin(list(_numbers(campaign, asvs, frame)))]
            _draw_errors(axes, mine)
            axes.set_title(f"{asvs} ASV{'s' * (asvs > 1)}: bias in the {frame} frame")
        mine = fixes[fixes.mission.isin(list(_numbers(campaign, asvs, "body")))]
        _draw_fixes(row[2], mine)
        _draw_published(row[2], asvs)
        row[2].set_title(f"{asvs} ASV{'s' * (asvs > 1)}: fixes delivered")
        row[0].set_ylabel("position error (m)")
        top = max(axes.get_ylim()[1] for axes in row[:2])
        for axes in row[:2]:
            axes.set_ylim(0, top)
    for axes in grid[1]:
        axes.set_xlabel("time (s)")
    cross = Line2D([], [], color="k", ls="", marker="x", ms=4, mew=1.2, label="fixes in the paper")
    legend_below(figure, [*vehicle_handles(AUVS), cross])
    return figure


def _draw_errors(axes: Axes, tracks: "pd.DataFrame") -> None:
    """Draw the mean and the range over runs of each AUV's error."""
    for auv in AUVS:
        rows = tracks[tracks.vehicle == auv]
        errors = rows.pivot_table(index="time_s", columns="mission", values="position_error_m")
        _band(axes, errors.index.to_numpy(float), errors.to_numpy(float), auv)
    axes.set_xlim(0, 300)


def _draw_fixes(axes: Axes, fixes: "pd.DataFrame") -> None:
    """Draw the mean and the range over runs of each AUV's count of fixes."""
    times = np.linspace(0.0, 300.0, 301)
    for auv in AUVS:
        mine = fixes[(fixes.auv == auv) & (fixes.outcome == "delivered")]
        counts = [
            np.searchsorted(np.sort(rows.delivered_at_s.to_numpy(float)), times)
            for _, rows in mine.groupby("mission")
        ]
        _band(axes, times, np.array(counts, float).T, auv)
    axes.set_xlim(0, 300)
    axes.set_ylim(bottom=0)


def _draw_published(axes: Axes, asvs: int) -> None:
    """Mark how many fixes each AUV of the paper has at the end."""
    for row in published():
        if (row.source, row.asvs, row.quantity) == ("tab:case_study", str(asvs), "fixes"):
            axes.plot(
                300.0, row.value, "x", color=colour_of(row.auv), ms=4, mew=1.2, clip_on=False,
                zorder=5,
            )  # fmt: skip
    axes.set_ylim(0, 210)


def _band(axes: Axes, times: Array, values: Array, auv: str) -> None:
    colour = colour_of(auv)
    axes.fill_between(times, values.min(axis=1), values.max(axis=1), color=colour, alpha=0.2, lw=0)
    axes.plot(times, values.mean(axis=1), color=colour)
