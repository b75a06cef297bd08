"""The paper's figures, drawn from the Parquet tables of its campaigns."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from bindusbl_des.apps.campaigns.statistics.intervals import interval
from bindusbl_des.apps.campaigns.storage.part_rows import read_table
from bindusbl_des.apps.campaigns.storage.parts import TABLES
from bindusbl_des.apps.figures.error import draw_errors
from bindusbl_des.apps.figures.style import (
    ONE_COLUMN,
    TWO_COLUMNS,
    colour_of,
    legend_below,
    new_figure,
    save,
    styled,
    vehicle_handles,
)
from bindusbl_des.apps.figures.trajectory import draw_map, map_handles
from bindusbl_des.core.results.result import Result
from bindusbl_des.support.palette import COLOURS, FAINT, INK

from .campaigns import Runs
from .counting import Tally
from .measuring import AUVS, BOUNDS, READINGS, ablated, cells
from .numbers import chosen, per_seed, published
from .readings import DEFAULT, Reading
from .sentences import (
    DSATUR,
    LATENCY_S,
    MOVING,
    ONE_PER_SLOT,
    POLICIES,
    REUSE,
    STILL,
    compared_downlinks,
    compared_schedulers,
)

if TYPE_CHECKING:
    import pandas as pd

    from bindusbl_des.apps.campaigns.campaign import Campaign

# Single missions: maps, errors and fixes over time.


Array = NDArray[np.float64]


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
    legend_below(figure, map_handles(result.setup))
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
    legend_below(figure, map_handles(result.setup))
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
    tracks = read_table(campaign.folder, "tracks").to_pandas()  # type: ignore[union-attr]  # kept
    fixes = read_table(campaign.folder, "fixes").to_pandas()  # type: ignore[union-attr]  # as well
    figure = new_figure(TWO_COLUMNS, 4.3)
    grid = figure.subplots(2, 3, sharex=True)
    for row, asvs in zip(grid, (1, 3), strict=True):
        for axes, frame in zip(row, ("body", "world"), strict=False):
            mine = tracks[tracks.mission.isin(list(_numbers(campaign, asvs, frame)))]
            _draw_errors(axes, mine)
            axes.set_title(f"{asvs} ASV{'s' * (asvs > 1)}: bias in the {frame} frame")
        mine = fixes[fixes.mission.isin(list(_numbers(campaign, asvs, "body")))]
        _draw_fixes(row[2], mine)
        _draw_published_fixes(row[2], asvs)
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


def _draw_published_fixes(axes: Axes, asvs: int) -> None:
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


# Two ASVs over the formation angle: errors, fixes and coverage of each AUV.


ANGLES = (0.0, 30.0, 60.0, 90.0)
WIDTH = 0.26


def two_asvs(runs: "Runs") -> Figure:
    """Draw bars for each angle and AUV: errors in two readings, fixes, coverage."""
    auvs = runs["two_asvs"].auvs
    figure = new_figure(TWO_COLUMNS, 4.2)
    grid = figure.subplots(2, 2, sharex=True)
    first, third = READINGS[0], READINGS[2]
    for axes, reading, column, label, quantity in (
        (grid[0, 0], first, first.metric, "cross-track error (m)", "cte"),
        (grid[0, 1], third, third.metric, "position error, world bias (m)", "cte"),
        (grid[1, 0], first, "fixes_delivered", "fixes delivered", "fixes"),
        (grid[1, 1], first, "hf_coverage", "HF coverage", "coverage"),
    ):
        _draw_bars(axes, auvs, reading, column)
        _draw_published_errors(axes, quantity)
        axes.set_ylabel(label)
    for axes in grid[1]:
        axes.set_xticks(range(len(ANGLES)), [f"{angle:.0f}" for angle in ANGLES])
        axes.set_xlabel("formation angle (deg)")
    cross = Line2D([], [], color="k", ls="", marker="x", ms=5, mew=1.4, label="paper, AUV0")
    legend_below(figure, [*vehicle_handles(AUVS), cross])
    return figure


def _draw_bars(axes: Axes, auvs: "pd.DataFrame", reading: Reading, column: str) -> None:
    for shift, auv in enumerate(AUVS):
        found = [
            interval(
                per_seed(
                    auvs,
                    column,
                    {**reading.fusion, "auv": auv, "asvs.formation.angle_deg": angle},
                )
            )
            for angle in ANGLES
        ]
        places = np.arange(len(ANGLES)) + (shift - 1) * WIDTH
        axes.bar(
            places, [it.mean for it in found], WIDTH, yerr=[it.half_width for it in found],
            color=colour_of(auv), error_kw={"elinewidth": 0.7}, capsize=1.5,
        )  # fmt: skip
    axes.grid(visible=False, axis="x")


def _draw_published_errors(axes: Axes, quantity: str) -> None:
    for row in published():
        if row.asvs == "2" and row.auv == "AUV0" and row.quantity == quantity:
            place = ANGLES.index(float(row.angle_deg)) - WIDTH
            axes.plot(place, row.value, "x", color="k", ms=5, mew=1.4, clip_on=False, zorder=5)


# Ablations: Table I with one choice changed at a time.


def ablations(runs: "Runs") -> Figure:
    """Draw fixes (left) and position errors (right) with one ASV (above) and three (below)."""
    table = ablated(runs)
    figure = new_figure(TWO_COLUMNS, 5.4)
    grid = figure.subplots(2, 2, sharey=True)
    for row, asvs in zip(grid, (1, 3), strict=True):
        mine = table[table.asvs == asvs].reset_index(drop=True)
        for axes, name, quantity in zip(row, ("fixes", "error"), ("fixes", "cte"), strict=True):
            _draw_dots(axes, mine, name)
            _draw_published_lines(axes, asvs, quantity)
            axes.set_title(f"{asvs} ASV{'s' * (asvs > 1)}")
    labels = [_short(change) for change in table[table.asvs == 1].change]
    grid[0, 0].set_yticks(range(len(labels)), labels)
    grid[0, 0].set_ylim(len(labels) - 0.5, -0.5)
    grid[1, 0].set_xlabel("fixes delivered")
    grid[1, 1].set_xlabel("position error (m)")
    legend_below(figure, vehicle_handles(AUVS))
    return figure


def _short(change: str) -> str:
    """Return a change without the sections of its key.

    >>> _short("acoustics.loss.combine=off")
    'combine=off'
    """
    return change.rpartition(".")[2]


def _draw_dots(axes: Axes, table: "pd.DataFrame", name: str) -> None:
    for shift, auv in enumerate(AUVS):
        places = np.arange(len(table)) + 0.22 * (shift - 1)
        axes.errorbar(
            table[f"{name}_{auv}"], places, xerr=table[f"{name}_{auv}_half_width"], fmt="o", ms=3,
            color=colour_of(auv), elinewidth=0.8,
        )  # fmt: skip
    axes.set_xlim(left=0)


def _draw_published_lines(axes: Axes, asvs: int, quantity: str) -> None:
    for row in published():
        if row.source == "tab:case_study" and row.asvs == str(asvs) and row.quantity == quantity:
            axes.axvline(row.value, color=colour_of(row.auv), ls="--", lw=0.8)


# Downlinks compared with their bounds.


SIDES = (60.0, 100.0, 140.0)
PAINTS = dict(zip(POLICIES, (COLOURS[1], COLOURS[0], COLOURS[2]), strict=True))

# Latencies of the first two often coincide: one mark shows inside the other.
LOOKS: dict[str, dict[str, Any]] = {
    policy: {"color": PAINTS[policy], "marker": marker, "ms": size, "mfc": fill, "ls": ""}
    for policy, marker, size, fill in zip(
        POLICIES, "osD", (3.0, 5.5, 3.0), (None, "none", None), strict=True
    )
}


def downlinks(runs: "Runs") -> Figure:
    """Draw fix rate and latency over team size, for each side."""
    table = compared_downlinks(runs)
    figure = new_figure(TWO_COLUMNS, 4.4)
    grid = figure.subplots(2, 3, sharex=True, sharey="row")
    for (rates, latencies), side in zip(grid.T, SIDES, strict=True):
        for policy in POLICIES:
            rows = table[(table.side_m == side) & (table.downlink == policy)]
            rates.plot(rows.auvs, rows.rate_hz, **LOOKS[policy])
            rates.plot(rows.auvs, rows.expected_hz, color=PAINTS[policy], lw=0.8)
            latencies.plot(rows.auvs, rows.latency_s, **LOOKS[policy])
            latencies.plot(rows.auvs, rows.latency_bound_s, "--", color=PAINTS[policy], lw=0.8)
        rates.plot(rows.auvs, rows.bound_hz, "--", color=INK, lw=0.8)
        latencies.axhline(LATENCY_S, color=INK, lw=0.8)
        rates.set_title(f"L = {side:.0f} m")
        latencies.set_xlabel("AUVs")
    grid[0, 0].set(ylabel="fix rate per AUV (Hz)", yscale="log")
    grid[1, 0].set_ylabel("mean latency (s)")
    grid[1, 0].set_ylim(bottom=0)
    legend_below(figure, _handles())
    return figure


def _handles() -> list[Line2D]:
    policies = [
        Line2D([], [], **{**LOOKS[policy], "ls": "-"}, lw=0.8, label=policy.replace("_", " "))
        for policy in POLICIES
    ]
    bounds = [
        Line2D([], [], color=INK, ls="--", lw=0.8, label="bound by airtime"),
        Line2D([], [], color=INK, lw=0.8, label=f"the paper's {LATENCY_S:g} s"),
    ]
    return [*policies, *bounds]


# How many published numbers the joint readings foretell.


def readings(counted: Tally) -> Figure:
    """Draw a histogram of all readings, with `default`, the best, and the best by chance."""
    figure = new_figure(ONE_COLUMN, 2.4)
    axes = figure.subplots()
    chance = counted.by_chance
    axes.axvspan(chance.low - 0.5, chance.high + 0.5, color=FAINT, zorder=0)
    most = int(counted.foretold.max())
    axes.hist(
        counted.foretold,
        bins=[edge - 0.5 for edge in range(most + 2)],
        color=COLOURS[0],
        rwidth=0.85,
    )
    for label, place in (("default", counted.place(DEFAULT)), ("best", counted.ranks[0])):
        _mark(axes, int(counted.foretold[place]), label)
    axes.set_xlabel(f"numbers foretold, of {int(counted.free.sum())}")
    axes.set_ylabel("joint readings")
    axes.grid(visible=False, axis="x")
    return figure


def _mark(axes: Axes, foretold: int, label: str) -> None:
    axes.axvline(foretold, color=INK, ls="--", lw=0.8)
    axes.text(
        foretold, 1.0, f"{label} ", rotation=90, ha="right", va="top", fontsize=6.5,
        transform=axes.get_xaxis_transform(),
    )  # fmt: skip


# Schedulers compared: rates, and the gain of spatial reuse.


SCHEDULE_LOOKS = {
    REUSE: {"color": COLOURS[0], "marker": "o", "ms": 3.5},
    DSATUR: {"color": COLOURS[4], "marker": "x", "ms": 5, "ls": ""},
    ONE_PER_SLOT: {"color": COLOURS[1], "marker": "s", "ms": 3},
}
SHOWN = {REUSE: "spatial reuse", DSATUR: "DSATUR", ONE_PER_SLOT: "one per slot"}
SIDE_PAINTS = {60.0: COLOURS[2], 100.0: COLOURS[3], 140.0: COLOURS[0]}


def schedulers(runs: "Runs") -> Figure:
    """Draw rates over team size for each number of ASVs, and gains for each side."""
    moving, still = compared_schedulers(runs, MOVING), compared_schedulers(runs, STILL)
    figure = new_figure(TWO_COLUMNS, 4.4)
    grid = figure.subplots(2, 3, sharex=True, sharey="row")
    for number, asvs in enumerate((1, 2, 3)):
        rates, gains = grid[:, number]
        mine = moving[(moving.asvs == asvs) & (moving.side_m == 140)]
        for name, looks in SCHEDULE_LOOKS.items():
            rates.plot(mine.auvs, mine[f"rate_{name}_hz"], **looks)
        rates.set_title(f"{asvs} ASV{'s' * (asvs > 1)}")
        for side, paint in SIDE_PAINTS.items():
            rows = moving[(moving.asvs == asvs) & (moving.side_m == side)]
            gains.plot(rows.auvs, rows.gain, color=paint)
            gains.fill_between(
                rows.auvs, rows.gain_least, rows.gain_most, color=paint, alpha=0.15, lw=0
            )
        held = still[still.asvs == asvs]
        gains.plot(held.auvs, held.gain, ":", color=INK)
        gains.axhline(1.0, color=INK, lw=0.6)
        gains.set_xlabel("AUVs")
    grid[0, 0].set_ylabel("fix rate at 140 m (Hz)")
    grid[1, 0].set_ylabel("rate of reuse / one per slot")
    grid[0, 0].set_ylim(bottom=0)
    legend_below(figure, _schedule_handles(sorted(moving.side_m.unique())))
    return figure


def _schedule_handles(sides: list[float]) -> list[Line2D]:
    rates = [
        Line2D([], [], label=SHOWN[name], **looks)  # type: ignore[arg-type]  # words of several types
        for name, looks in SCHEDULE_LOOKS.items()
    ]
    gains = [
        Line2D([], [], color=SIDE_PAINTS[s], lw=2, label=f"gain, L = {s:.0f} m") for s in sides
    ]
    held = Line2D([], [], color=INK, ls=":", label="gain, L = 140 m, holding still")
    return [*rates, *gains, held]


# The configuration sweep: heatmap and angle-resolved figure.


SWEPT_SIDES, ASVS, SWEPT_ANGLES = (60.0, 100.0, 140.0), (1, 2, 3), (0.0, 30.0, 60.0, 90.0)
SIGNS = {"at most": "< ", "at least": "> "}
STYLES = {1: "-", 2: "--", 3: ":"}

# "Green <= 1 m (well-localized); red > 4 m (navigation failure)"
COLOUR_RANGE = (0.0, 5.0)


def heatmap(runs: "Runs") -> Figure:
    """Draw the mean error over team size and ASVs for each side, in three readings."""
    world = {"navigation.bias_frame": "world", "navigation.filter.delay_compensation": "none"}
    same, late = runs["sweep"].missions, runs["sweep_distance"].missions
    turned = chosen(runs["sweep_readings"].missions, world)
    readings = (
        ("cross-track error,\nbody bias, 300 s", same, "cross_track_error_m"),
        ("position error, body\nbias, equal distance", late, "position_error_m"),
        ("position error,\nworld bias, 300 s", turned, "position_error_m"),
    )
    figure = new_figure(TWO_COLUMNS, 5.2)
    grid = figure.subplots(3, 3, sharex=True, sharey=True)
    for row, (label, missions, metric) in zip(grid, readings, strict=True):
        table = cells(missions, metric)
        for axes, side in zip(row, SWEPT_SIDES, strict=True):
            image = _draw_cells(axes, table[table["survey.side_m"] == side])
        row[0].set_ylabel(f"{label}\nASVs", fontsize=7)
    for axes, side in zip(grid[0], SWEPT_SIDES, strict=True):
        axes.set_title(f"L = {side:.0f} m\npaper: {_in_the_paper(side)}", fontsize=6.5)
    for axes in grid[-1]:
        axes.set_xlabel("AUVs")
    figure.colorbar(image, ax=grid, label="mean error (m)", extend="max", shrink=0.7, pad=0.01)
    return figure


def _in_the_paper(side: float) -> str:
    """Return what the paper's text says of a side, by number of ASVs."""
    said: dict[str, list[str]] = {}
    for row in published():
        if row.quantity.startswith("cte_") and row.side_m == f"{side:.0f}":
            sign = SIGNS.get(BOUNDS.get((row.side_m, row.asvs, row.quantity), "equals"), "")
            known = said.setdefault(row.asvs, [])
            if not (known and row.quantity == "cte_mean"):
                known.append(sign + row.text)
    return ", ".join(f"{'-'.join(texts)} ({asvs})" for asvs, texts in said.items())


def _draw_cells(axes: Axes, table: "pd.DataFrame") -> AxesImage:
    values = table.pivot_table(index="asvs.count", columns="auvs.count", values="value")
    image = axes.imshow(
        values.to_numpy(), cmap="cividis", norm=Normalize(*COLOUR_RANGE), aspect="auto"
    )
    axes.grid(visible=False)
    axes.set_xticks(range(values.shape[1]), [str(n) for n in values.columns])
    axes.set_yticks(range(values.shape[0]), [str(n) for n in values.index])
    for (row, column), value in np.ndenumerate(values.to_numpy()):
        colour = "black" if value > sum(COLOUR_RANGE) / 2 else "white"
        axes.text(column, row, f"{value:.2f}", ha="center", va="center", color=colour, fontsize=5.2)
    return image


def sweep(runs: "Runs") -> Figure:
    """Draw the sweep with 300 s for every team."""
    return _by_angle(runs["sweep"].missions)


def sweep_distance(runs: "Runs") -> Figure:
    """Draw the sweep at equal distance travelled."""
    return _by_angle(runs["sweep_distance"].missions)


def _by_angle(missions: "pd.DataFrame") -> Figure:
    figure = new_figure(TWO_COLUMNS, 6.2)
    grid = figure.subplots(3, 2, sharex=True)
    for row, side in zip(grid, SWEPT_SIDES, strict=True):
        mine = chosen(missions, {"survey.side_m": side})
        for axes, metric, label in zip(
            row,
            ("position_error_m", "fix_rate_hz"),
            ("position error (m)", "fix rate per AUV (Hz)"),
            strict=True,
        ):
            _draw_curves(axes, mine, metric)
            axes.set_ylabel(f"L = {side:.0f} m\n{label}" if axes is row[0] else label)
            axes.set_ylim(bottom=0)
    for axes in grid[-1]:
        axes.set_xlabel("AUVs")
    legend_below(figure, _sweep_handles())
    return figure


def _draw_curves(axes: Axes, missions: "pd.DataFrame", metric: str) -> None:
    """Draw a line for each number of ASVs and angle; with one ASV all angles are the same."""
    for asvs in ASVS:
        for number, angle in enumerate(SWEPT_ANGLES if asvs > 1 else SWEPT_ANGLES[:1]):
            where = {"asvs.count": asvs, "asvs.formation.angle_deg": angle}
            teams = chosen(missions, where).groupby("auvs.count")[metric]
            mean, sd = teams.mean(), teams.std()
            colour = INK if asvs == 1 else COLOURS[number]
            axes.plot(mean.index, mean, STYLES[asvs], color=colour, lw=1.1)
            axes.fill_between(mean.index, mean - sd, mean + sd, color=colour, alpha=0.12, lw=0)


def _sweep_handles() -> list[Line2D]:
    angles = [
        Line2D([], [], color=COLOURS[number], lw=2, label=f"{angle:.0f} deg")
        for number, angle in enumerate(SWEPT_ANGLES)
    ]
    counts = [
        Line2D([], [], color=INK, ls=style, label=f"{asvs} ASV{'s' * (asvs > 1)}")
        for asvs, style in STYLES.items()
    ]
    return [*counts, *angles]


# The paper's figures, drawn from the Parquet tables of its campaigns.


DRAWINGS: dict[str, Callable[[Runs], Figure]] = {
    drawing.__name__: drawing
    for drawing in (
        baseline,
        failure_and_recovery,
        errors_and_fixes,
        two_asvs,
        heatmap,
        sweep_distance,
        sweep,
        schedulers,
        downlinks,
        ablations,
    )
}

# Enough for a page on a screen; together the figures stay below a megabyte and a half.
DOTS_PER_INCH = 120


def draw(runs: Runs, folder: Path) -> None:
    """Draw every figure into a folder as PNG."""
    with styled():
        for name, drawing in DRAWINGS.items():
            save(drawing(runs), folder / f"{name}.png", dpi=DOTS_PER_INCH)


def draw_readings(counted: Tally, folder: Path) -> None:
    """Draw the figure of the joint readings into a folder as PNG."""
    with styled():
        save(readings(counted), folder / "readings.png", dpi=DOTS_PER_INCH)
