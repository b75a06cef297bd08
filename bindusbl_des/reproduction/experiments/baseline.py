"""The baseline: one ASV that hears four AUVs, L = 60 m."""

from typing import TYPE_CHECKING

from ..published import Published
from ..verdicts import predicted
from .measured import Measured, Other, Reason, chosen
from .running import Runs

if TYPE_CHECKING:
    import pandas as pd

# "Across five independent runs"
RUNS_OF_THE_PAPER = 5

READINGS = {"round_robin": "one AUV per second in turn", "random": "one AUV per second by lot"}
TDMA = "the paper's TDMA"

PINGS = Reason(
    "E3, E26",
    "one ping per second and none lost makes 300 in 300 s; the published 298.2 are 0.6 % fewer, "
    "far from the 7-15 % that the paper's loss law would take",
)
LOT = Reason("E26", "taking turns makes equal shares; by lot the published ones are likely")
AIRTIME = Reason("E23", "the paper's own airtime alone is 192 ms")


def measure(row: Published, runs: Runs) -> Measured:
    """Measure one number of the baseline: conventional USBL, AUVs in turn; by lot; by TDMA."""
    auvs = runs["baseline"].auvs
    found = {
        schedule: predicted(
            values(row, chosen(auvs, {"protocol.schedule": schedule})), RUNS_OF_THE_PAPER
        )
        for schedule in (*READINGS, "spatial_reuse")
    }
    return Measured(
        row,
        READINGS["round_robin"],
        found["round_robin"],
        _reason(row),
        (Other(READINGS["random"], found["random"]), Other(TDMA, found["spatial_reuse"])),
    )


def values(row: Published, auvs: "pd.DataFrame") -> list[float]:
    """Return the published quantity for each seed."""
    seeds = auvs.groupby("seed")
    if row.quantity == "fix_share":
        mine = auvs[auvs.auv == row.auv].set_index("seed").fixes_delivered
        found = mine / seeds.fixes_delivered.sum()
    elif row.quantity == "fixes":
        found = seeds.fixes_delivered.sum()
    elif row.quantity == "fix_rate":
        found = seeds.fix_rate_hz.sum() if row.auv == "fleet" else seeds.fix_rate_hz.mean()
    else:
        columns = {
            "inter_fix_interval": "interval_mean_s",
            "latency_mean": "latency_mean_s",
            "latency_p95": "latency_p95_s",
        }
        found = seeds[columns[row.quantity]].mean()
    return [float(value) for value in found]


def _reason(row: Published) -> Reason:
    if row.quantity == "fix_share":
        return LOT
    return AIRTIME if row.quantity.startswith("latency") else PINGS
