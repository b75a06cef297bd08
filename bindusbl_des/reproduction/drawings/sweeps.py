"""The configuration sweep: heatmap and angle-resolved figure."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D

from ...core.palette import COLOURS, INK
from ...figures.style import TWO_COLUMNS, legend_below, new_figure
from ..experiments.measured import chosen
from ..experiments.sweep import BOUNDS, cells
from ..published import published

if TYPE_CHECKING:
    import pandas as pd

    from ..experiments.running import Runs

SIDES, ASVS, ANGLES = (60.0, 100.0, 140.0), (1, 2, 3), (0.0, 30.0, 60.0, 90.0)
SIGNS = {"at most": "< ", "at least": "> "}
STYLES = {1: "-", 2: "--", 3: ":"}

# "Green <= 1 m (well-localized); red > 4 m (navigation failure)"
COLOUR_RANGE = (0.0, 5.0)


def heatmap(runs: "Runs") -> Figure:
    """Draw the mean error over team size and ASVs for each side, in three readings."""
    world = {"navigation.bias_frame": "world", "navigation.delay_compensation": "none"}
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
        for axes, side in zip(row, SIDES, strict=True):
            image = _draw_cells(axes, table[table["survey.side_m"] == side])
        row[0].set_ylabel(f"{label}\nASVs", fontsize=7)
    for axes, side in zip(grid[0], SIDES, strict=True):
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
    for row, side in zip(grid, SIDES, strict=True):
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
    legend_below(figure, _handles())
    return figure


def _draw_curves(axes: Axes, missions: "pd.DataFrame", metric: str) -> None:
    """Draw a line for each number of ASVs and angle; with one ASV all angles are the same."""
    for asvs in ASVS:
        for number, angle in enumerate(ANGLES if asvs > 1 else ANGLES[:1]):
            where = {"asvs.count": asvs, "asvs.formation.angle_deg": angle}
            teams = chosen(missions, where).groupby("auvs.count")[metric]
            mean, sd = teams.mean(), teams.std()
            colour = INK if asvs == 1 else COLOURS[number]
            axes.plot(mean.index, mean, STYLES[asvs], color=colour, lw=1.1)
            axes.fill_between(mean.index, mean - sd, mean + sd, color=colour, alpha=0.12, lw=0)


def _handles() -> list[Line2D]:
    angles = [
        Line2D([], [], color=COLOURS[number], lw=2, label=f"{angle:.0f} deg")
        for number, angle in enumerate(ANGLES)
    ]
    counts = [
        Line2D([], [], color=INK, ls=style, label=f"{asvs} ASV{'s' * (asvs > 1)}")
        for asvs, style in STYLES.items()
    ]
    return [*counts, *angles]
