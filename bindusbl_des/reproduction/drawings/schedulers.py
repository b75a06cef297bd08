"""Schedulers compared: rates, and the gain of spatial reuse."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...core.palette import COLOURS, INK
from ...figures.style import TWO_COLUMNS, legend_below, new_figure
from ..experiments.schedulers import DSATUR, MOVING, ONE_PER_SLOT, REUSE, STILL, compared

if TYPE_CHECKING:
    from ..experiments.running import Runs

LOOKS = {
    REUSE: {"color": COLOURS[0], "marker": "o", "ms": 3.5},
    DSATUR: {"color": COLOURS[4], "marker": "x", "ms": 5, "ls": ""},
    ONE_PER_SLOT: {"color": COLOURS[1], "marker": "s", "ms": 3},
}
SHOWN = {REUSE: "spatial reuse", DSATUR: "DSATUR", ONE_PER_SLOT: "one per slot"}
PAINTS = {60.0: COLOURS[2], 100.0: COLOURS[3], 140.0: COLOURS[0]}


def schedulers(runs: "Runs") -> Figure:
    """Draw rates over team size for each number of ASVs, and gains for each side."""
    moving, still = compared(runs, MOVING), compared(runs, STILL)
    figure = new_figure(TWO_COLUMNS, 4.4)
    grid = figure.subplots(2, 3, sharex=True, sharey="row")
    for number, asvs in enumerate((1, 2, 3)):
        rates, gains = grid[:, number]
        mine = moving[(moving.asvs == asvs) & (moving.side_m == 140)]
        for name, looks in LOOKS.items():
            rates.plot(mine.auvs, mine[f"rate_{name}_hz"], **looks)
        rates.set_title(f"{asvs} ASV{'s' * (asvs > 1)}")
        for side, paint in PAINTS.items():
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
    legend_below(figure, _handles(sorted(moving.side_m.unique())))
    return figure


def _handles(sides: list[float]) -> list[Line2D]:
    rates = [
        Line2D([], [], label=SHOWN[name], **looks)  # type: ignore[arg-type]
        for name, looks in LOOKS.items()
    ]
    gains = [Line2D([], [], color=PAINTS[s], lw=2, label=f"gain, L = {s:.0f} m") for s in sides]
    held = Line2D([], [], color=INK, ls=":", label="gain, L = 140 m, holding still")
    return [*rates, *gains, held]
