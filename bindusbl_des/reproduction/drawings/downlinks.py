"""Downlinks compared with their bounds."""

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...core.palette import COLOURS, INK
from ...figures.style import TWO_COLUMNS, legend_below, new_figure
from ..experiments.downlinks import LATENCY_S, POLICIES, compared

if TYPE_CHECKING:
    from ..experiments.running import Runs

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
    table = compared(runs)
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
